// The last day of several figures, in bounded memory: what the monitor pages show beside the last ten
// minutes.
#pragma once

#include "load_history.hpp"

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// A point a minute: of what was added during a minute, the mean. It is lost when the server ends.
class DayHistory
{
public:
    static constexpr Duration step = std::chrono::minutes(1);
    static constexpr Duration span = std::chrono::hours(24);
    /// More can't be told apart on a screen.
    static constexpr std::size_t max_points = 480;

    /// Lifetime: the names must outlive it.
    explicit DayHistory(std::span<std::string_view const> names);

    /// Whether the minute is over, so that `advance` makes a point.
    bool is_due(TimePoint now) const noexcept { return history_.is_due(now); }

    /// One value for each name, in the order of the names; NaN: unknown.
    void add(std::span<float const> values) noexcept;

    /// Makes the next point when it is due. Without a value since the last one it is unknown.
    bool advance(TimePoint now) noexcept;

    /// `"day":{"last":<s ago>,"spacing":<s>,"series":[{"name":"load","history":[...]}...]}`, as a member.
    void append_to(std::string& text, TimePoint now) const;

    /// `"dayPoint":[...]`, the last point, as a member.
    void append_point_to(std::string& text) const;

private:
    struct Figure
    {
        std::string_view name;
        LoadHistory::Series series;
        double sum = 0;
        int added = 0;
        float last = 0;
    };

    LoadHistory history_{step, span};
    std::vector<Figure> figures_;
};

} // namespace webots_cloud::core
