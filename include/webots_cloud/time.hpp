// Moments and durations, as the whole library counts them.
#pragma once

#include <webots_cloud/export.hpp>

#include <chrono>

namespace WEBOTS_CLOUD_API webots_cloud {

/// A moment that never jumps; only differences mean anything.
using TimePoint = std::chrono::steady_clock::time_point;
using Duration = TimePoint::duration;

/// A moment of the calendar, for logs, mails and pages.
using WallTime = std::chrono::system_clock::time_point;

} // namespace webots_cloud
