#include "metrics_text.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>

namespace webots_cloud::core {

namespace {

/// Whole numbers are written as such, and not as 3e+06, which is as right, but hard to read and to search
/// for.
std::string number_text(double value)
{
    constexpr double exact = 9007199254740992; // up to 2^53 a double holds every whole number
    char digits[32];
    auto* const end = digits + sizeof digits;
    bool const is_whole = value >= -exact && value <= exact && value == std::trunc(value);
    auto const written = is_whole ? std::to_chars(digits, end, static_cast<std::int64_t>(value))
                                  : std::to_chars(digits, end, value);
    return std::string(digits, written.ptr);
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
    text_.append(" ").append(number_text(value)).append("\n");
    return *this;
}

MetricsText& MetricsText::histogram(std::string_view name, std::string_view help, Histogram const& histogram)
{
    family(name, "histogram", help);
    auto const whole = name_;
    std::uint64_t count = 0;
    name_ = whole + "_bucket";
    for (std::size_t i = 0; i < histogram.bounds().size(); ++i) {
        count += histogram.counts()[i];
        add(static_cast<double>(count), {{"le", number_text(histogram.bounds()[i])}});
    }
    count += histogram.counts().back();
    add(static_cast<double>(count), {{"le", "+Inf"}});
    name_ = whole + "_sum";
    add(histogram.sum());
    name_ = whole + "_count";
    return add(static_cast<double>(count));
}

} // namespace webots_cloud::core
