#include "day_history.hpp"

#include "core/time_text.hpp"
#include "json_text.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace webots_cloud::core {
namespace {

constexpr int day_decimals = 1;

} // namespace

DayHistory::DayHistory(std::span<std::string_view const> names)
{
    for (auto const name : names) {
        auto& figure = figures_.emplace_back();
        figure.name = name;
        figure.series = history_.series();
    }
}

void DayHistory::add(std::span<float const> values) noexcept
{
    for (std::size_t i = 0; i < std::min(values.size(), figures_.size()); ++i) {
        if (std::isnan(values[i]))
            continue;
        figures_[i].sum += static_cast<double>(values[i]);
        ++figures_[i].added;
    }
}

bool DayHistory::advance(TimePoint now) noexcept
{
    if (!history_.is_due(now))
        return false;
    for (auto& figure : figures_) {
        figure.last = figure.added == 0 ? std::numeric_limits<float>::quiet_NaN()
                                        : static_cast<float>(figure.sum / figure.added);
        history_.set_next(figure.series, figure.last);
        figure.sum = 0;
        figure.added = 0;
    }
    history_.advance(now);
    return true;
}

void DayHistory::append_to(std::string& text, TimePoint now) const
{
    append_key(text, "day");
    text += '{';
    append_key(text, "last");
    append_number(text, as_seconds(now - history_.last()), 1);
    append_key(text, "spacing");
    append_number(text, as_seconds(history_.spacing(max_points)), 0);
    append_key(text, "series");
    text += '[';
    for (auto const& figure : figures_) {
        text += text.back() == '[' ? "{" : ",{";
        append_key(text, "name");
        append_quoted(text, figure.name);
        append_key(text, "history");
        append_numbers(text, history_.line(figure.series, max_points).values, day_decimals);
        text += '}';
    }
    text += "]}";
}

void DayHistory::append_point_to(std::string& text) const
{
    std::vector<float> values;
    for (auto const& figure : figures_)
        values.push_back(figure.last);
    append_key(text, "dayPoint");
    append_numbers(text, values, day_decimals);
}

} // namespace webots_cloud::core
