// How many lines of something that repeats itself are shown or logged.
#pragma once

#include <webots_cloud/time.hpp>

#include <algorithm>

namespace webots_cloud::core {

class LineBudget
{
public:
    /// 200 at once and 50 a second of a build: more than anybody reads, and fewer than fill a slow browser's
    /// queue.
    LineBudget() = default;
    LineBudget(double most, double a_second) : most_(most), a_second_(a_second), left_(most) {}

    /// Whether one more may be shown.
    bool take(TimePoint now)
    {
        auto const passed = std::chrono::duration<double>(now - last_).count();
        left_ = std::min(most_, left_ + std::max(0.0, passed) * a_second_);
        last_ = now;
        if (left_ < 1)
            return false;
        --left_;
        return true;
    }

private:
    double most_ = 200;
    double a_second_ = 50;
    double left_ = most_;
    TimePoint last_;
};

} // namespace webots_cloud::core
