// Finds out which number somebody has meant, so that the sentence about the fault can say what to write.
#include "written_quantity.hpp"

#include "config_reader.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

namespace webots_cloud::core {
namespace {

constexpr std::size_t longest = 40;
constexpr double day = 24 * 60 * 60;
constexpr double kilobyte = 1024;
constexpr double megabyte = kilobyte * kilobyte;
constexpr double gigabyte = kilobyte * megabyte;
constexpr double terabyte = kilobyte * gigabyte;

enum class Measure
{
    time,  ///< In seconds.
    size,  ///< In bytes.
    share, ///< In percent.
    rate   ///< In requests or bytes per second.
};

struct Unit
{
    std::string_view name; ///< In small letters.
    Measure measure;
    double size;
};

constexpr std::array units{
    Unit{"s", Measure::time, 1},
    Unit{"sec", Measure::time, 1},
    Unit{"secs", Measure::time, 1},
    Unit{"second", Measure::time, 1},
    Unit{"seconds", Measure::time, 1},
    Unit{"ms", Measure::time, 0.001},
    Unit{"millisecond", Measure::time, 0.001},
    Unit{"milliseconds", Measure::time, 0.001},
    Unit{"m", Measure::time, 60},
    Unit{"min", Measure::time, 60},
    Unit{"mins", Measure::time, 60},
    Unit{"minute", Measure::time, 60},
    Unit{"minutes", Measure::time, 60},
    Unit{"h", Measure::time, 60 * 60},
    Unit{"hr", Measure::time, 60 * 60},
    Unit{"hrs", Measure::time, 60 * 60},
    Unit{"hour", Measure::time, 60 * 60},
    Unit{"hours", Measure::time, 60 * 60},
    Unit{"d", Measure::time, day},
    Unit{"day", Measure::time, day},
    Unit{"days", Measure::time, day},
    Unit{"week", Measure::time, 7 * day},
    Unit{"weeks", Measure::time, 7 * day},
    Unit{"b", Measure::size, 1},
    Unit{"byte", Measure::size, 1},
    Unit{"bytes", Measure::size, 1},
    Unit{"k", Measure::size, kilobyte},
    Unit{"kb", Measure::size, kilobyte},
    Unit{"kib", Measure::size, kilobyte},
    Unit{"m", Measure::size, megabyte},
    Unit{"mb", Measure::size, megabyte},
    Unit{"mib", Measure::size, megabyte},
    Unit{"megabyte", Measure::size, megabyte},
    Unit{"megabytes", Measure::size, megabyte},
    Unit{"g", Measure::size, gigabyte},
    Unit{"gb", Measure::size, gigabyte},
    Unit{"gib", Measure::size, gigabyte},
    Unit{"gigabyte", Measure::size, gigabyte},
    Unit{"gigabytes", Measure::size, gigabyte},
    Unit{"t", Measure::size, terabyte},
    Unit{"tb", Measure::size, terabyte},
    Unit{"tib", Measure::size, terabyte},
    Unit{"%", Measure::share, 1},
    Unit{"percent", Measure::share, 1},
    Unit{"b/s", Measure::rate, 1},
    Unit{"kb/s", Measure::rate, kilobyte},
    Unit{"mb/s", Measure::rate, megabyte},
    Unit{"gb/s", Measure::rate, gigabyte},
    Unit{"/s", Measure::rate, 1},
    Unit{"per second", Measure::rate, 1},
    Unit{"/min", Measure::rate, 1.0 / 60},
    Unit{"per minute", Measure::rate, 1.0 / 60},
    Unit{"/h", Measure::rate, 1.0 / (60 * 60)},
    Unit{"per hour", Measure::rate, 1.0 / (60 * 60)},
};

/// In what keys count.
constexpr std::array key_units{
    Unit{"seconds", Measure::time, 1},
    Unit{"days", Measure::time, day},
    Unit{"megabytes", Measure::size, megabyte},
    Unit{"gigabytes", Measure::size, gigabyte},
    Unit{"percent", Measure::share, 1},
    Unit{"bytes per second", Measure::rate, 1},
    Unit{"requests per second", Measure::rate, 1},
};

/// A number and the unit behind it, in small letters; empty: none is.
struct Part
{
    double number = 0;
    std::string unit;
};

bool is_digit(char c) noexcept
{
    return c >= '0' && c <= '9';
}

/// Takes a number from the beginning of `text`, whose comma is a decimal one unless it could be between
/// thousands.
std::optional<double> take_number(std::string_view& text)
{
    std::string number;
    std::size_t used = 0;
    bool has_point = false;
    for (; used < text.size(); ++used) {
        char const c = text[used];
        bool const is_exponent =
            (c == 'e' || c == 'E') && used > 0 && used + 1 < text.size() && is_digit(text[used + 1]);
        bool const is_point =
            (c == '.' || c == ',') && used > 0 && used + 1 < text.size() && is_digit(text[used + 1]);
        if (is_point && has_point)
            return std::nullopt;
        if (c == ',' && is_point) {
            auto const digits = text.substr(used + 1);
            auto const end = std::size_t(std::ranges::find_if_not(digits, is_digit) - digits.begin());
            if (end == 3)
                return std::nullopt;
        }
        has_point = has_point || is_point;
        if (!is_digit(c) && !is_exponent && !is_point && !(used == 0 && c == '-'))
            break;
        number += c == ',' ? '.' : c;
    }
    double value = 0;
    auto const [end, failed] = std::from_chars(number.data(), number.data() + number.size(), value);
    if (number.empty() || failed != std::errc() || end != number.data() + number.size())
        return std::nullopt;
    text.remove_prefix(used);
    return value;
}

/// Nothing: the text is something else.
std::vector<Part> parts_of(std::string_view text)
{
    std::vector<Part> parts;
    if (text.size() > longest)
        return parts;
    for (text = trim(text); !text.empty(); text = trim(text)) {
        auto const number = take_number(text);
        if (!number)
            return {};
        auto const next = std::size_t(std::ranges::find_if(text, is_digit) - text.begin());
        parts.push_back({*number, lower_case(trim(text.substr(0, next)))});
        text.remove_prefix(next);
    }
    return parts;
}

bool is_known(Part const& part)
{
    return std::ranges::find(units, std::string_view(part.unit), &Unit::name) != units.end();
}

/// In what `measure` counts.
std::optional<double> worth(Part const& part, Measure measure)
{
    for (auto const& unit : units)
        if (unit.name == part.unit && unit.measure == measure)
            return part.number * unit.size;
    return std::nullopt;
}

bool may_have(ConfigKey const& key, double number)
{
    bool const is_integer = key.value.type == KeyType::integer;
    return number >= key.min && number <= key.max && !(number > 0 && number < key.least) &&
           (!is_integer || number == std::floor(number));
}

/// Without what comes of fractions that have no exact form.
double rounded(double number)
{
    constexpr double digits = 1e6;
    return std::round(number * digits) / digits;
}

std::optional<double> sum_of(std::vector<Part> const& parts, ConfigKey const& key)
{
    if (parts.size() == 1 && parts[0].unit.empty())
        return parts[0].number;
    auto const* const unit = std::ranges::find(key_units, key.unit, &Unit::name);
    if (unit == key_units.end())
        return std::nullopt;
    double sum = 0;
    for (auto const& part : parts) {
        auto const value = worth(part, unit->measure);
        if (!value)
            return std::nullopt;
        sum += *value;
    }
    return rounded(sum / unit->size);
}

} // namespace

bool is_quantity(std::string_view text)
{
    auto const parts = parts_of(text);
    return !parts.empty() && std::ranges::all_of(parts, is_known);
}

std::optional<double> number_meant(std::string_view text, ConfigKey const& key)
{
    auto const parts = parts_of(text);
    auto const number = parts.empty() ? std::nullopt : sum_of(parts, key);
    return number && may_have(key, *number) ? number : std::nullopt;
}

std::string number_advice(std::string_view text, ConfigKey const& key, Quotes quotes)
{
    auto const number = number_meant(text, key);
    if (!number)
        return {};
    auto const parts = parts_of(text);
    bool const has_unit = !parts.front().unit.empty();
    bool const is_converted = parts.size() > 1 || parts.front().number != *number;
    return concat(": write ", number_text(*number),
                  quotes == Quotes::none ? ""
                  : has_unit             ? ", without quotes and unit"
                                         : ", without quotes",
                  is_converted ? concat(" (", trim(text), " in ", key.unit, ")") : std::string());
}

} // namespace webots_cloud::core
