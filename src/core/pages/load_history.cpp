#include "load_history.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace webots_cloud::core {
namespace {

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

} // namespace

LoadHistory::LoadHistory(Duration step, Duration span)
    : step_(std::max<Duration>(step, std::chrono::seconds(1))),
      capacity_(std::max<std::size_t>(1, static_cast<std::size_t>(span / step_)))
{}

LoadHistory::Series LoadHistory::series() const
{
    return Series(capacity_, unknown);
}

bool LoadHistory::is_due(TimePoint now) const noexcept
{
    return count_ == 0 || now >= last_ + step_;
}

void LoadHistory::advance(TimePoint now) noexcept
{
    next_ = (next_ + 1) % capacity_;
    count_ = std::min(count_ + 1, capacity_);
    last_ = now;
}

float LoadHistory::at(Series const& series, std::size_t age) const noexcept
{
    return series[(next_ + capacity_ - 1 - age) % capacity_];
}

/// How many points become one where at most `max` are wanted; 0: none is.
std::size_t LoadHistory::merged(std::size_t max) const noexcept
{
    return max == 0 ? 0 : std::max<std::size_t>(1, (count_ + max - 1) / max);
}

Duration LoadHistory::spacing(std::size_t max) const noexcept
{
    return step_ * static_cast<Duration::rep>(std::max<std::size_t>(1, merged(max)));
}

LoadHistory::Line LoadHistory::line(Series const& series, std::size_t max) const
{
    Line line;
    std::size_t const merged = this->merged(max);
    line.spacing = spacing(max);
    if (merged == 0)
        return line;
    for (std::size_t newest = 0; newest < count_; newest += merged) {
        float sum = 0;
        int known = 0;
        for (std::size_t age = newest; age < std::min(newest + merged, count_); ++age) {
            auto const value = at(series, age);
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
