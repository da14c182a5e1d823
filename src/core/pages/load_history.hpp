// The last ten minutes of several figures, in bounded memory: what the charts of the monitor pages show.
#pragma once

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace webots_cloud::core {

/// A ring of points for each of several named series. Every series has a point at each time; an unknown one
/// is NaN.
class LoadHistory
{
public:
    static constexpr Duration default_span = std::chrono::minutes(10);

    /// Points are `step` apart, at least a second; those older than `span` are forgotten.
    explicit LoadHistory(Duration step, Duration span = default_span);

    /// The series from now on. Those that stay keep their points; a new one has unknown ones.
    void set_series(std::vector<std::string> const& names);

    /// True when the next point is due.
    bool is_due(TimePoint now) const noexcept;

    /// Adds a point: a value for each series, in their order.
    void add(std::vector<float> const& values, TimePoint now);

    std::size_t points() const noexcept { return count_; }
    std::size_t series() const noexcept { return series_.size(); }
    TimePoint last() const noexcept { return last_; }

    /// What is drawn of one series.
    struct Line
    {
        Duration spacing{};        ///< Between two of its points; the last one is at `last()`.
        std::vector<float> values; ///< Oldest first.
    };

    /// At most `max` points of a series, each the mean of as many neighbours as it takes.
    Line line(std::size_t series, std::size_t max) const;

private:
    struct Series
    {
        std::string name;
        std::vector<float> ring;
    };

    float at(Series const& series, std::size_t age) const noexcept;

    Duration step_;
    std::size_t capacity_;
    std::vector<Series> series_;
    std::size_t next_ = 0;
    std::size_t count_ = 0;
    TimePoint last_{};
};

} // namespace webots_cloud::core
