#include "json_text.hpp"

#include <boost/json/serialize.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace webots_cloud::core {

void append_number(std::string& text, double value, int decimals)
{
    if (!std::isfinite(value)) {
        text += "null";
        return;
    }
    std::array<char, 400> buffer; // the largest double has 309 digits
    auto const written = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                       std::chars_format::fixed, decimals);
    std::string_view digits(buffer.data(), static_cast<std::size_t>(written.ptr - buffer.data()));
    if (decimals > 0) {
        digits.remove_suffix(digits.size() - 1 - digits.find_last_not_of('0'));
        if (digits.back() == '.')
            digits.remove_suffix(1);
    }
    text += digits == "-0" ? std::string_view("0") : digits;
}

namespace {

/// Most names and addresses are: they need no escapes, and a serializer takes ten times as long for each.
bool is_plain(std::string_view value) noexcept
{
    return std::all_of(value.begin(), value.end(),
                       [](char each) { return each >= ' ' && each <= '~' && each != '"' && each != '\\'; });
}

} // namespace

void append_quoted(std::string& text, std::string_view value)
{
    if (is_plain(value))
        text.append(1, '"').append(value).append(1, '"');
    else
        text += boost::json::serialize(boost::json::string_view(value.data(), value.size()));
}

void append_key(std::string& text, std::string_view key)
{
    if (!text.empty() && text.back() != '{')
        text += ',';
    append_quoted(text, key);
    text += ':';
}

void append_numbers(std::string& text, std::vector<float> const& values, int decimals)
{
    text += '[';
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (i > 0)
            text += ',';
        append_number(text, values[i], decimals);
    }
    text += ']';
}

} // namespace webots_cloud::core
