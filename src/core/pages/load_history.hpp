// The last ten minutes of several figures, in bounded memory: what the charts of the monitor pages show.
#pragma once

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <vector>

namespace webots_cloud::core {

/// The times of points, which several series share; the series belong to the page that shows them. Every
/// series has a point at each time; an unknown one is NaN.
class LoadHistory
{
public:
    static constexpr Duration default_span = std::chrono::minutes(10);

    /// Points are `step` apart, at least a second; those older than `span` are forgotten.
    explicit LoadHistory(Duration step, Duration span = default_span);

    /// A ring of points.
    using Series = std::vector<float>;

    /// One whose points are unknown.
    Series series() const;

    /// True when the next point is due.
    bool is_due(TimePoint now) const noexcept;

    /// The next point of one series: to be set in each of them before `advance`.
    void set_next(Series& series, float value) const noexcept { series[next_] = value; }

    /// All series have their next point.
    void advance(TimePoint now) noexcept;

    TimePoint last() const noexcept { return last_; }

    /// What is drawn of one series.
    struct Line
    {
        Duration spacing{};        ///< Between two of its points; the last one is at `last()`.
        std::vector<float> values; ///< Oldest first.
    };

    /// At most `max` points of a series, each the mean of as many neighbours as it takes.
    Line line(Series const& series, std::size_t max) const;

    /// The spacing of such lines.
    Duration spacing(std::size_t max) const noexcept;

private:
    float at(Series const& series, std::size_t age) const noexcept;
    std::size_t merged(std::size_t max) const noexcept;

    Duration step_;
    std::size_t capacity_;
    std::size_t next_ = 0;
    std::size_t count_ = 0;
    TimePoint last_{};
};

} // namespace webots_cloud::core
