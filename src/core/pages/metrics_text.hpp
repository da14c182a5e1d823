// Figures in the text format of Prometheus, version 0.0.4.
#pragma once

#include "histogram.hpp"
#include "metrics_table.hpp"

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace webots_cloud::core {

inline constexpr std::string_view metrics_type = "text/plain; version=0.0.4; charset=utf-8";

/// Builds the body of `GET /metrics`. Names get the prefix `webots_`; values are in base units (seconds,
/// bytes, ratios).
///
/// Names and labels are ours or the operator's, never a user's text: their number is limited.
class MetricsText
{
public:
    using Labels = std::initializer_list<std::pair<std::string_view, std::string_view>>;

    /// Begins a family of figures, as in `family(metric("servers"))`. Its values follow by `add`.
    MetricsText& family(Metric const& metric);

    MetricsText& add(double value, Labels labels = {});

    /// With labels that many figures have: `labels_text` has written them.
    MetricsText& add_labelled(double value, std::string_view labels);

    /// All lines of one histogram; the family is of this type.
    MetricsText& add(Histogram const& histogram, Labels labels = {});

    /// As in `{machine="sim1:2000"}`.
    static std::string labels_text(Labels labels);

    std::string take() { return std::move(text_); }

    std::string const& text() const noexcept { return text_; }

    /// To write anew, in the same memory.
    void clear() noexcept
    {
        text_.clear();
        name_.clear();
    }

private:
    void line(std::string_view suffix, Labels labels, std::string_view bound, double value);

    std::string text_;
    std::string name_;
};

} // namespace webots_cloud::core
