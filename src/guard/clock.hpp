// The time since the machine was started.
#pragma once

#include <ctime>

namespace webots_cloud::guard {

inline long now_ms()
{
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * 1000 + time.tv_nsec / 1'000'000;
}

} // namespace webots_cloud::guard
