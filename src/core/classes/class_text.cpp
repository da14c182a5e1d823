#include "class_text.hpp"

#include "class_limits.hpp"
#include "core/text.hpp"
#include "core/unicode_characters.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::string_view code_letters = "23456789ABCDEFGHJKMNPQRSTVWXYZ"; // without 0, 1, I, L, O and U
constexpr std::size_t code_length = 6;
constexpr std::size_t token_bytes = 16;

char upper(char c) noexcept
{
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - ('a' - 'A')) : c;
}

constexpr int max_on_one = 4; // marks and joiners on one character: Thai needs two, Tibetan up to four
constexpr std::uint32_t zero_width_non_joiner = 0x200C;
constexpr std::uint32_t zero_width_joiner = 0x200D;

/// Of ASCII, to which joiners do nothing.
bool is_letter(std::uint32_t code) noexcept
{
    return (code >= 'a' && code <= 'z') || (code >= 'A' && code <= 'Z');
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
    if (!is_utf8(text))
        return std::nullopt;
    std::string line;
    std::size_t characters = 0;
    int on_it = max_on_one; // so far nothing that others could follow
    std::uint32_t last = 0;
    for (auto rest = text; !rest.empty(); ++characters) {
        auto const length = utf8_length(rest);
        auto const code = code_point(rest, length);
        auto const kind = kind_of_character(code);
        if (kind == CharacterKind::mark || kind == CharacterKind::joining)
            ++on_it;
        else
            on_it = kind == CharacterKind::visible ? 0 : max_on_one;
        bool const changes_nothing = kind == CharacterKind::joining && is_letter(last);
        if (kind == CharacterKind::hidden || on_it > max_on_one || changes_nothing)
            return std::nullopt;
        line += kind == CharacterKind::space ? " " : rest.substr(0, length);
        last = code;
        rest.remove_prefix(length);
    }
    if (last == zero_width_non_joiner || last == zero_width_joiner)
        return std::nullopt;
    text = trim(line);
    if (text.empty() || characters > max_characters)
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
