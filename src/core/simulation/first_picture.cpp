#include "first_picture.hpp"

#include "core/text.hpp"

#include <charconv>
#include <optional>
#include <string>

namespace webots_cloud::core {
namespace {

constexpr std::string_view end_of_head = "\r\n\r\n";
constexpr std::size_t longest_head = std::size_t{8} << 10;

/// The value of a header in a head in small letters; nothing: there is none.
std::optional<std::string_view> header_in(std::string_view head, std::string_view name)
{
    auto const line = concat("\r\n", name, ":");
    auto const at = head.find(line);
    if (at == std::string_view::npos)
        return std::nullopt;
    auto value = head.substr(at + line.size());
    return trim(value.substr(0, value.find("\r\n")));
}

bool streams_parts(std::string_view head)
{
    bool const is_good = head.starts_with("http/1.0 200") || head.starts_with("http/1.1 200");
    auto const type = header_in(head, "content-type").value_or("");
    return is_good && type.starts_with("multipart/") && !header_in(head, "transfer-encoding");
}

std::size_t length_of_part(std::string_view head)
{
    auto const text = header_in(head, "content-length").value_or("");
    std::size_t length = 0;
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), length);
    return error == std::errc() && end == text.data() + text.size() ? length : 0;
}

/// Splits a head off; nothing: its end has not come.
std::optional<std::string> take_head(std::string_view& rest)
{
    auto const end = rest.find(end_of_head);
    if (end == std::string_view::npos)
        return std::nullopt;
    auto head = lower_case(rest.substr(0, end));
    rest.remove_prefix(end + end_of_head.size());
    return head;
}

FirstPicture::State without_head(std::string_view rest)
{
    return rest.size() > longest_head ? FirstPicture::State::none : FirstPicture::State::incomplete;
}

} // namespace

bool is_world_picture(std::string_view bytes) noexcept
{
    return bytes.starts_with("\xff\xd8\xff") && bytes.size() <= max_world_picture;
}

FirstPicture first_picture(std::string_view answer)
{
    using enum FirstPicture::State;
    auto rest = answer;
    auto const head = take_head(rest);
    if (!head)
        return without_head(rest);
    if (!streams_parts(*head))
        return none;
    auto part = take_head(rest);
    if (!part)
        return without_head(rest);
    auto const length = length_of_part(concat("\r\n", *part));
    if (length == 0 || length > max_world_picture)
        return none;
    if (rest.size() < length)
        return incomplete;
    auto const picture = rest.substr(0, length);
    return is_world_picture(picture) ? FirstPicture(found, picture) : FirstPicture(none);
}

} // namespace webots_cloud::core
