#include "load_history.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace webots_cloud::core {
namespace {

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

} // namespace

LoadHistory::LoadHistory(Duration step, Duration span)
    : step_(std::max<Duration>(step, std::chrono::seconds(1))),
      capacity_(std::max<std::size_t>(1, static_cast<std::size_t>(span / step_)))
{}

void LoadHistory::set_series(std::vector<std::string> const& names)
{
    bool const same =
        std::equal(names.begin(), names.end(), series_.begin(), series_.end(),
                   [](std::string const& name, Series const& series) { return name == series.name; });
    if (same)
        return;
    std::unordered_map<std::string, std::vector<float>> known;
    for (auto& series : series_)
        known.emplace(std::move(series.name), std::move(series.ring));
    series_.clear();
    for (auto const& name : names) {
        auto const found = known.find(name);
        bool const is_new = found == known.end() || found->second.empty();
        series_.push_back({name, is_new ? std::vector<float>(capacity_, unknown) : std::move(found->second)});
    }
}

bool LoadHistory::is_due(TimePoint now) const noexcept
{
    return count_ == 0 || now >= last_ + step_;
}

void LoadHistory::add(std::vector<float> const& values, TimePoint now)
{
    for (std::size_t i = 0; i < series_.size(); ++i)
        series_[i].ring[next_] = i < values.size() ? values[i] : unknown;
    next_ = (next_ + 1) % capacity_;
    count_ = std::min(count_ + 1, capacity_);
    last_ = now;
}

float LoadHistory::at(Series const& series, std::size_t age) const noexcept
{
    return series.ring[(next_ + capacity_ - 1 - age) % capacity_];
}

LoadHistory::Line LoadHistory::line(std::size_t series, std::size_t max) const
{
    Line line;
    std::size_t const merged = max == 0 ? 0 : std::max<std::size_t>(1, (count_ + max - 1) / max);
    line.spacing = step_ * static_cast<Duration::rep>(std::max<std::size_t>(1, merged));
    if (merged == 0)
        return line;
    for (std::size_t newest = 0; newest < count_; newest += merged) {
        float sum = 0;
        int known = 0;
        for (std::size_t age = newest; age < std::min(newest + merged, count_); ++age) {
            auto const value = at(series_[series], age);
            if (std::isnan(value))
                continue;
            sum += value;
            ++known;
        }
        line.values.push_back(known == 0 ? unknown : sum / static_cast<float>(known));
    }
    std::reverse(line.values.begin(), line.values.end());
    return line;
}

} // namespace webots_cloud::core
