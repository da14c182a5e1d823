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
    text.append(digits, static_cast<std::size_t>(written.ptr - digits));
}

std::string number_text(double value)
{
    std::string text;
    append_value(text, value);
    return text;
}

std::string_view type_name(MetricType type) noexcept
{
    switch (type) {
    case MetricType::counter:
        return "counter";
    case MetricType::gauge:
        return "gauge";
    case MetricType::histogram:
        break;
    }
    return "histogram";
}

/// Addresses of machines come from the configuration, and a program that embeds the service may have others
/// than our servers take.
void append_escaped(std::string& text, std::string_view label)
{
    for (char const each : label) {
        if (each == '\\' || each == '"')
            text += '\\';
        if (each == '\n')
            text += "\\n";
        else
            text += each;
    }
}

void append_labels(std::string& text, MetricsText::Labels labels, std::string_view bound)
{
    char separator = '{';
    auto const label = [&text, &separator](std::string_view key, std::string_view value) {
        text.append(1, separator).append(key).append("=\"");
        append_escaped(text, value);
        text.append("\"");
        separator = ',';
    };
    for (auto const& [key, value] : labels)
        label(key, value);
    if (!bound.empty())
        label("le", bound);
    if (separator == ',')
        text.append("}");
}

} // namespace

MetricsText& MetricsText::family(Metric const& metric)
{
    name_.assign("webots_").append(metric.name);
    text_.append("# HELP ").append(name_).append(" ").append(metric.help);
    text_.append("\n# TYPE ").append(name_).append(" ").append(type_name(metric.type)).append("\n");
    return *this;
}

MetricsText& MetricsText::add(double value, Labels labels)
{
    line({}, labels, {}, value);
    return *this;
}

MetricsText& MetricsText::add(Histogram const& histogram, Labels labels)
{
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < histogram.bounds().size(); ++i) {
        count += histogram.counts()[i];
        line("_bucket", labels, number_text(histogram.bounds()[i]), static_cast<double>(count));
    }
    auto const all = static_cast<double>(histogram.count());
    line("_bucket", labels, "+Inf", all);
    line("_sum", labels, {}, histogram.sum());
    line("_count", labels, {}, all);
    return *this;
}

/// `bound`: of a bucket; none where it is empty.
void MetricsText::line(std::string_view suffix, Labels labels, std::string_view bound, double value)
{
    text_.append(name_).append(suffix);
    append_labels(text_, labels, bound);
    text_.append(" ");
    append_value(text_, value);
    text_.append("\n");
}

MetricsText& MetricsText::add_labelled(double value, std::string_view labels)
{
    text_.append(name_).append(labels).append(" ");
    append_value(text_, value);
    text_.append("\n");
    return *this;
}

std::string MetricsText::labels_text(Labels labels)
{
    std::string text;
    append_labels(text, labels, {});
    return text;
}

} // namespace webots_cloud::core
