#include "metrics_text.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>

namespace webots_cloud::core {

namespace {

/// Whole numbers are written as such, and not as 3e+06, which is as right, but hard to read and to search
/// for.
void append_value(std::string& text, double value)
{
    constexpr double exact = 9007199254740992; // up to 2^53 a double holds every whole number
    char digits[32];
    auto* const end = digits + sizeof digits;
    bool const is_whole = value >= -exact && value <= exact && value == std::trunc(value);
    auto const written = is_whole ? std::to_chars(digits, end, static_cast<std::int64_t>(value))
                                  : std::to_chars(digits, end, value);
    text.append(" ").append(digits, written.ptr).append("\n");
}

} // namespace

MetricsText& MetricsText::family(std::string_view name, std::string_view type, std::string_view help)
{
    name_.assign("webots_").append(name);
    text_.append("# HELP ").append(name_).append(" ").append(help);
    text_.append("\n# TYPE ").append(name_).append(" ").append(type).append("\n");
    return *this;
}

MetricsText& MetricsText::add(double value, Labels labels)
{
    text_.append(name_);
    char separator = '{';
    for (auto const& [key, label] : labels) {
        text_.append(1, separator).append(key).append("=\"").append(label).append("\"");
        separator = ',';
    }
    if (labels.size() > 0)
        text_.append("}");
    append_value(text_, value);
    return *this;
}

} // namespace webots_cloud::core
