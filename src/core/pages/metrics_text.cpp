#include "metrics_text.hpp"

#include <charconv>

namespace webots_cloud::core {

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
    char digits[32];
    text_.append(" ").append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr).append("\n");
    return *this;
}

} // namespace webots_cloud::core
