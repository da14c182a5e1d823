// Limits how many lines of a build a browser is shown.
#pragma once

#include <webots_cloud/time.hpp>

#include <algorithm>

namespace webots_cloud::core {

/// 200 at once and 50 a second: more than anybody can read, and too few to fill a slow browser's queue.
class LineBudget
{
public:
    /// Whether one more may be shown.
    bool take(TimePoint now)
    {
        auto const passed = std::chrono::duration<double>(now - last_).count();
        left_ = std::min(max_lines, left_ + std::max(0.0, passed) * lines_per_second);
        last_ = now;
        if (left_ < 1)
            return false;
        --left_;
        return true;
    }

private:
    static constexpr double max_lines = 200;
    static constexpr double lines_per_second = 50;

    double left_ = max_lines;
    TimePoint last_;
};

} // namespace webots_cloud::core
