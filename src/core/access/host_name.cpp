// Punycode, RFC 3492: the sections that comments name are of it.
#include "host_name.hpp"

#include "core/text.hpp"
#include "core/unicode_characters.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace webots_cloud::core {
namespace {

using Characters = std::vector<std::uint32_t>;

constexpr std::size_t longest_part = 63; // RFC 1035, 2.3.4
constexpr std::uint32_t first_beyond_ascii = 0x80;

// Section 5
constexpr std::uint32_t base = 36;
constexpr std::uint32_t t_min = 1;
constexpr std::uint32_t t_max = 26;
constexpr std::uint32_t skew = 38;
constexpr std::uint32_t damp = 700;
constexpr std::uint32_t initial_bias = 72;

std::uint32_t small_letter(std::uint32_t character) noexcept
{
    constexpr std::uint32_t multiplication_sign = 0xd7;
    bool const is_capital_of_latin_1 =
        character >= 0xc0 && character <= 0xde && character != multiplication_sign;
    return is_capital_of_latin_1 ? character + 0x20 : character;
}

/// Precondition: `part` is UTF-8.
Characters characters_of(std::string_view part)
{
    Characters characters;
    while (!part.empty()) {
        auto const length = utf8_length(part);
        characters.push_back(small_letter(code_point(part, length)));
        part.remove_prefix(length);
    }
    return characters;
}

char digit(std::uint32_t value) noexcept
{
    return static_cast<char>(value < 26 ? 'a' + value : '0' + (value - 26));
}

/// Section 6.1
std::uint32_t adapted_bias(std::uint32_t delta, std::uint32_t points, bool is_first) noexcept
{
    delta = is_first ? delta / damp : delta / 2;
    delta += delta / points;
    std::uint32_t k = 0;
    for (; delta > ((base - t_min) * t_max) / 2; k += base)
        delta /= base - t_min;
    return k + (base - t_min + 1) * delta / (delta + skew);
}

void append_number(std::string& text, std::uint32_t number, std::uint32_t bias)
{
    for (auto k = base;; k += base) {
        auto const threshold = k <= bias ? t_min : std::min(k - bias, t_max);
        if (number < threshold)
            break;
        text += digit(threshold + (number - threshold) % (base - threshold));
        number = (number - threshold) / (base - threshold);
    }
    text += digit(number);
}

/// Section 6.3. Of so few characters no number overflows: 63 times the highest code point.
std::string punycode(Characters const& characters)
{
    std::string text;
    for (auto const character : characters)
        if (character < first_beyond_ascii)
            text += static_cast<char>(character);
    auto const basic = static_cast<std::uint32_t>(text.size());
    if (basic > 0)
        text += '-';
    auto next = first_beyond_ascii;
    std::uint32_t delta = 0;
    auto bias = initial_bias;
    // Each round inserts the least of the characters that are left, wherever it occurs. `delta` counts the
    // places and characters that were passed over since the last one.
    for (auto handled = basic; handled < characters.size(); ++delta, ++next) {
        auto least = UINT32_MAX;
        for (auto const character : characters)
            if (character >= next)
                least = std::min(least, character);
        delta += (least - next) * (handled + 1);
        next = least;
        for (auto const character : characters) {
            if (character < next)
                ++delta;
            if (character != next)
                continue;
            append_number(text, delta, bias);
            bias = adapted_bias(delta, handled + 1, handled == basic);
            delta = 0;
            ++handled;
        }
    }
    return text;
}

} // namespace

std::string ascii_host_name(std::string_view name)
{
    if (!is_utf8(name))
        return std::string(name);
    auto const port = std::min(name.find(':'), name.size());
    std::string ascii;
    for (auto const part : split(name.substr(0, port), '.')) {
        if (part.data() != name.data())
            ascii += '.';
        auto const characters = characters_of(lower_case(part));
        bool const is_ascii = std::all_of(characters.begin(), characters.end(),
                                          [](std::uint32_t each) { return each < first_beyond_ascii; });
        if (characters.size() > longest_part)
            return std::string(name);
        ascii += is_ascii ? std::string(part) : concat("xn--", punycode(characters));
    }
    return ascii.append(name.substr(port));
}

} // namespace webots_cloud::core
