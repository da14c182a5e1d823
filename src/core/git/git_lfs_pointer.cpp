#include "git_lfs_pointer.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>

namespace webots_cloud::core {
namespace {

// The second and third are of versions that were called "hawser" and "git-media".
constexpr std::array<std::string_view, 3> versions{
    "https://git-lfs.github.com/spec/v1", "https://hawser.github.com/spec/v1", "http://git-media.io/v/2"};
constexpr std::string_view sha256 = "sha256:";
constexpr std::size_t sha256_digits = 64;

struct Line
{
    std::string_view key;
    std::string_view value;
};

/// The next line that is not empty; one without a key when there is none.
Line take_line(std::string_view& text)
{
    std::string_view line;
    while (line.empty() && !text.empty()) {
        auto const end = std::min(text.find('\n'), text.size());
        line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (line.ends_with('\r'))
            line.remove_suffix(1);
    }
    auto const space = line.find(' ');
    if (space == std::string_view::npos)
        return {};
    return {line.substr(0, space), line.substr(space + 1)};
}

bool is_digest(std::string_view value)
{
    if (!value.starts_with(sha256) || value.size() != sha256.size() + sha256_digits)
        return false;
    value.remove_prefix(sha256.size());
    return std::all_of(value.begin(), value.end(),
                       [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

/// `ext-0-name`
bool is_extension(Line const& line)
{
    constexpr std::string_view mark = "ext-";
    constexpr std::size_t name_at = 6;
    return line.key.size() > name_at && line.key.starts_with(mark) && line.key[mark.size()] >= '0' &&
           line.key[mark.size()] <= '9' && line.key[mark.size() + 1] == '-' && is_digest(line.value);
}

std::optional<std::uint64_t> read_size(std::string_view digits)
{
    std::uint64_t size = 0;
    auto const [end, failed] = std::from_chars(digits.data(), digits.data() + digits.size(), size);
    bool const is_number = failed == std::errc() && end == digits.data() + digits.size();
    bool const is_plain = digits == "0" || !digits.starts_with('0');
    bool const fits = size <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    return is_number && is_plain && fits ? std::optional(size) : std::nullopt;
}

} // namespace

std::optional<LfsPointer> parse_lfs_pointer(std::string_view text)
{
    if (text.size() < shortest_lfs_pointer || text.size() > max_lfs_pointer_length)
        return std::nullopt;
    text = trim(text);
    auto line = take_line(text);
    if (line.key != "version" || std::find(versions.begin(), versions.end(), line.value) == versions.end())
        return std::nullopt;
    LfsPointer pointer;
    for (line = take_line(text); is_extension(line); line = take_line(text))
        pointer.extended = true;
    if (line.key != "oid" || !is_digest(line.value))
        return std::nullopt;
    pointer.object = line.value.substr(sha256.size());
    line = take_line(text);
    auto const size = line.key == "size" ? read_size(line.value) : std::nullopt;
    if (!size || !text.empty())
        return std::nullopt;
    pointer.size = *size;
    return pointer;
}

} // namespace webots_cloud::core
