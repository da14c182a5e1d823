#include "class_text.hpp"

#include "class_limits.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <cstdint>

namespace webots_cloud::core {
namespace {

constexpr std::string_view code_letters = "23456789ABCDEFGHJKMNPQRSTVWXYZ"; // without 0, 1, I, L, O and U
constexpr std::size_t code_length = 6;
constexpr std::size_t token_bytes = 16;

char upper(char c) noexcept
{
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - ('a' - 'A')) : c;
}

/// The first character of `text`, which must be UTF-8, and its length in bytes.
struct Character
{
    explicit Character(std::string_view text)
    {
        auto const first = static_cast<unsigned char>(text.front());
        length = first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
        code = length == 1 ? first : first & (0x7Fu >> length);
        for (std::size_t i = 1; i < length; ++i)
            code = code << 6 | (static_cast<unsigned char>(text[i]) & 0x3Fu);
    }

    std::size_t length;
    std::uint32_t code;
};

bool is_invisible(std::uint32_t code) noexcept
{
    constexpr std::uint32_t tags = 0xE0000; // a plane of tags and variation selectors
    return code == 0xAD || code == 0x61C || code == 0x115F || code == 0x1160 || code == 0x180E ||
           code == 0x200B || (code >= 0x200E && code <= 0x200F) || (code >= 0x2028 && code <= 0x202E) ||
           (code >= 0x2060 && code <= 0x206F) || code == 0x3164 || code == 0xFEFF || code == 0xFFA0 ||
           (code >= 0xFFF0 && code <= 0xFFFB) || code >= tags;
}

} // namespace

std::string make_class_code(RandomBytes const& random)
{
    // Of bytes from here on some letters would be more frequent than others.
    constexpr unsigned end = 256 / code_letters.size() * code_letters.size();
    std::string code;
    while (code.size() < code_length)
        for (char const c : random(code_length - code.size()))
            if (auto const byte = static_cast<unsigned char>(c); byte < end)
                code += code_letters[byte % code_letters.size()];
    return code;
}

std::string read_class_code(std::string_view typed)
{
    constexpr std::size_t longest = 32;
    std::string code;
    for (char const c : typed.substr(0, longest))
        if (c != ' ' && c != '-')
            code += upper(c);
    bool const can_be_one = typed.size() <= longest && code.size() == code_length &&
                            code.find_first_not_of(code_letters) == std::string::npos;
    return can_be_one ? code : std::string();
}

std::string make_class_token(RandomBytes const& random)
{
    constexpr std::string_view digits = "0123456789abcdef";
    std::string token;
    for (char const c : random(token_bytes)) {
        auto const byte = static_cast<unsigned char>(c);
        token += digits[byte >> 4];
        token += digits[byte & 15];
    }
    return token;
}

std::optional<std::string> line_of_person(std::string_view text, std::size_t max_characters)
{
    text = trim(text);
    if (text.empty() || !is_printable(text))
        return std::nullopt;
    std::size_t characters = 0;
    for (auto rest = text; !rest.empty(); ++characters) {
        Character const next(rest);
        if (is_invisible(next.code))
            return std::nullopt;
        rest.remove_prefix(next.length);
    }
    if (characters > max_characters)
        return std::nullopt;
    return std::string(text);
}

bool is_world_address(std::string_view text)
{
    auto const scheme = text.substr(0, text.find(':'));
    auto const is_scheme_letter = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '+' ||
               c == '-' || c == '.';
    };
    return text.size() <= class_limits::world && !scheme.empty() && scheme.size() < text.size() &&
           std::all_of(scheme.begin(), scheme.end(), is_scheme_letter) && scheme != "javascript" &&
           is_printable(text) && text.find_first_of(" \"<>\\^`{|}") == std::string_view::npos &&
           without_query(text).ends_with(".wbt");
}

} // namespace webots_cloud::core
