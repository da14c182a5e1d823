#include "printed_lines.hpp"

#include "text.hpp"

namespace webots_cloud::demo {

std::optional<std::string> PrintedLines::next()
{
    auto const end = text_.find('\n');
    if (end <= max_line)
        return take(end, 1);
    if (text_.size() <= max_line)
        return std::nullopt;
    auto size = max_line;
    while (size > max_line - 4 && (static_cast<unsigned char>(text_[size]) & 0xC0) == 0x80)
        --size; // a character is not cut
    return take(size, 0);
}

std::optional<std::string> PrintedLines::last()
{
    if (auto line = next())
        return line;
    return text_.empty() ? std::nullopt : std::optional(take(text_.size(), 0));
}

std::string PrintedLines::take(std::size_t size, std::size_t end)
{
    std::string_view line = std::string_view(text_).substr(0, size);
    if (line.ends_with('\r'))
        line.remove_suffix(1);
    std::string expanded;
    for (char const c : line)
        expanded += c == '\t' ? std::string(4, ' ') : std::string(1, c);
    std::string result = printable(expanded, 4 * max_line);
    text_.erase(0, size + end);
    return result;
}

} // namespace webots_cloud::demo
