// How often one client may do something.
#pragma once

#include <webots_cloud/time.hpp>

#include <algorithm>

namespace webots_cloud::core {

/// A token bucket: `burst` at once, and one per `interval` in the long run.
class Pace
{
public:
    bool has_token(TimePoint now, Duration interval, int burst) const noexcept
    {
        return next(now, interval) - now <= interval * burst;
    }

    bool take(TimePoint now, Duration interval, int burst) noexcept
    {
        if (!has_token(now, interval, burst))
            return false;
        full_at_ = next(now, interval);
        return true;
    }

private:
    TimePoint next(TimePoint now, Duration interval) const noexcept
    {
        return std::max(full_at_, now) + interval;
    }

    TimePoint full_at_ = TimePoint::min();
};

} // namespace webots_cloud::core
