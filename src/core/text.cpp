// Small functions on text without a better home. Some are a matter of security (printable,
// equal_in_constant_time, is_shown): change them with their tests at hand.
#include "text.hpp"

#include "unicode_characters.hpp"

#include <webots_cloud/transport/http.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

namespace webots_cloud {
namespace {

char lower(char c) noexcept
{
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c + ('a' - 'A')) : c;
}

} // namespace

bool equal_ignoring_case(std::string_view left, std::string_view right) noexcept
{
    return std::equal(left.begin(), left.end(), right.begin(), right.end(),
                      [](char a, char b) { return lower(a) == lower(b); });
}

} // namespace webots_cloud

namespace webots_cloud::core {
namespace {

/// Whether the character of this many bytes at the start of `text` is seen, and leaves the others in their
/// order: so that no text reads as another one.
bool is_shown(std::string_view text, std::size_t length) noexcept
{
    if (length == 0)
        return false;
    auto const kind = kind_of_character(code_point(text, length));
    return kind != CharacterKind::hidden && kind != CharacterKind::joining;
}

std::size_t edit_distance(std::string_view left, std::string_view right)
{
    std::vector<std::size_t> row(right.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 1; i <= left.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= right.size(); ++j) {
            std::size_t const changed = diagonal + (left[i - 1] == right[j - 1] ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, changed});
        }
    }
    return row.back();
}

} // namespace

std::vector<std::string_view> split(std::string_view text, char separator)
{
    std::vector<std::string_view> pieces;
    pieces.reserve(static_cast<std::size_t>(std::count(text.begin(), text.end(), separator)) + 1);
    for (;;) {
        auto const end = text.find(separator);
        pieces.push_back(text.substr(0, end));
        if (end == std::string_view::npos)
            return pieces;
        text.remove_prefix(end + 1);
    }
}

std::string join(std::vector<std::string_view> const& pieces, std::string_view separator)
{
    std::string text;
    for (auto const piece : pieces) {
        if (!text.empty())
            text += separator;
        text += piece;
    }
    return text;
}

std::string_view trim(std::string_view text) noexcept
{
    constexpr std::string_view blank = " \t\r\n";
    auto const first = text.find_first_not_of(blank);
    if (first == std::string_view::npos)
        return {};
    return text.substr(first, text.find_last_not_of(blank) - first + 1);
}

std::string lower_case(std::string_view text)
{
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(), lower);
    return result;
}

std::string escape_html(std::string_view text)
{
    auto const is_special = [](char c) { return c == '&' || c == '<' || c == '>' || c == '"' || c == '\''; };
    if (std::none_of(text.begin(), text.end(), is_special)) // as most names: monitor pages have thousands
        return std::string(text);
    std::string escaped;
    escaped.reserve(text.size());
    for (char const c : text) {
        switch (c) {
        case '&':
            escaped += "&amp;";
            break;
        case '<':
            escaped += "&lt;";
            break;
        case '>':
            escaped += "&gt;";
            break;
        case '"':
            escaped += "&quot;";
            break;
        case '\'':
            escaped += "&#39;";
            break;
        default:
            escaped += c;
        }
    }
    return escaped;
}

std::string printable(std::string_view text, std::size_t limit)
{
    constexpr std::string_view digits = "0123456789abcdef";
    std::string safe;
    std::size_t at = 0;
    while (at < text.size() && safe.size() < limit) {
        auto const length = utf8_length(text.substr(at));
        auto const byte = static_cast<unsigned char>(text[at]);
        if (!is_shown(text.substr(at), length)) {
            safe.append("\\x").append(1, digits[byte >> 4]).append(1, digits[byte & 15]);
            ++at;
        } else {
            safe.append(text.substr(at, length));
            at += length;
        }
    }
    if (at < text.size())
        safe += "...";
    return safe;
}

bool is_printable(std::string_view text) noexcept
{
    while (!text.empty()) {
        auto const length = utf8_length(text);
        if (!is_shown(text, length))
            return false;
        text.remove_prefix(length);
    }
    return true;
}

bool is_utf8(std::string_view text) noexcept
{
    while (!text.empty()) {
        auto const length = utf8_length(text);
        if (length == 0)
            return false;
        text.remove_prefix(length);
    }
    return true;
}

std::string of_client(std::string_view address)
{
    return address.empty() ? std::string() : concat(" (", address, ")");
}

std::string python_float(double value)
{
    char buffer[64];
    double const size = std::abs(value);
    // Python's repr changes to an exponent below 1e-4 and from 1e16 on.
    bool const plain = size == 0 || (size >= 1e-4 && size < 1e16);
    auto const format = plain ? std::chars_format::fixed : std::chars_format::scientific;
    auto const end = std::to_chars(buffer, buffer + sizeof buffer, value, format).ptr;
    std::string text(buffer, end);
    if (plain && std::isfinite(value) && text.find('.') == std::string::npos)
        text += ".0";
    return text;
}

std::string gigabytes(std::uint64_t bytes)
{
    return concat(python_float(std::round(static_cast<double>(bytes) / (1 << 30) * 10) / 10), "GB");
}

int hex_digit(char c) noexcept
{
    if (c >= '0' && c <= '9')
        return c - '0';
    if (c >= 'a' && c <= 'f')
        return c - 'a' + 10;
    if (c >= 'A' && c <= 'F')
        return c - 'A' + 10;
    return -1;
}

std::uint16_t parse_port(std::string_view text) noexcept
{
    std::uint16_t port = 0;
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
    bool const is_port = error == std::errc() && end == text.data() + text.size() && !text.starts_with('0');
    return is_port ? port : 0;
}

bool equal_in_constant_time(std::string_view left, std::string_view right) noexcept
{
    unsigned difference = left.size() == right.size() ? 0 : 1;
    for (std::size_t i = 0; i < left.size() && !right.empty(); ++i)
        difference |=
            static_cast<unsigned char>(left[i]) ^ static_cast<unsigned char>(right[i % right.size()]);
    return difference == 0;
}

bool percent_decode(std::string_view text, std::string& decoded)
{
    decoded.clear();
    decoded.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            decoded += text[i];
            continue;
        }
        if (i + 2 >= text.size() || hex_digit(text[i + 1]) < 0 || hex_digit(text[i + 2]) < 0)
            return false;
        decoded += static_cast<char>(hex_digit(text[i + 1]) * 16 + hex_digit(text[i + 2]));
        i += 2;
    }
    return true;
}

std::string_view without_query(std::string_view url) noexcept
{
    return url.substr(0, std::min(url.find('?'), url.find('#'))); // both by memchr
}

std::string_view nearest(std::string_view word, std::vector<std::string_view> const& candidates)
{
    std::string_view best;
    std::size_t min = std::max<std::size_t>(2, word.size() / 3) + 1;
    for (auto const candidate : candidates) {
        if (auto const distance = edit_distance(word, candidate); distance < min) {
            min = distance;
            best = candidate;
        }
    }
    return best;
}

} // namespace webots_cloud::core
