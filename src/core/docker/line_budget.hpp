// Limits how many lines of a build a browser is shown.
#pragma once

#include <webots_cloud/time.hpp>

#include <algorithm>

namespace webots_cloud::core {

/// 200 at once and 50 a second: more than anybody reads, and fewer than fill a slow browser's queue.
class LineBudget
{
public:
    /// Whether one more may be shown.
    bool take(TimePoint now)
    {
        auto const passed = std::chrono::duration<double>(now - last_).count();
        left_ = std::min(max, left_ + std::max(0.0, passed) * a_second);
        last_ = now;
        if (left_ < 1)
            return false;
        --left_;
        return true;
    }

private:
    static constexpr double max = 200;
    static constexpr double a_second = 50;

    double left_ = max;
    TimePoint last_;
};

} // namespace webots_cloud::core
