// Moments and durations as text: every format that the servers write, for logs, mails, pages and headers.
#pragma once

#include <webots_cloud/time.hpp>

#include <string>

namespace webots_cloud::core {

/// `2026-01-31T23:59:58.678Z` (RFC 3339, UTC), for programs.
std::string iso_time(WallTime when);

/// `2026-01-31 23:59:58 UTC`, for people in other time zones.
std::string utc_time(WallTime when);

/// `Thu, 01 Jan 2026 13:00:00 +0000` (RFC 5322), the `Date` of a mail.
std::string mail_date(WallTime when);

/// `Thu, 01 Jan 2026 13:00:00 GMT` (RFC 9110), the `Date` of an HTTP response.
std::string http_date(WallTime when);

/// `2026-01-31 23:59:58` in the time zone of this machine, as the server's log has it.
std::string local_time(WallTime when);

/// `Saturday, January 31, 2026 at 23:59:58` in the time zone of this machine.
std::string long_local_time(WallTime when);

/// Whole seconds since 1970.
std::string unix_seconds(WallTime when);

/// `12 s`, `5 min`, `3 h`: how long ago something was.
std::string age_text(Duration since);

/// Seconds with their fractions.
inline double as_seconds(Duration duration)
{
    return std::chrono::duration<double>(duration).count();
}

/// Whole seconds, without a unit; fractions are cut off.
std::string seconds_text(Duration duration);

/// Whole seconds, without a unit, never fewer than the duration has: how long somebody has to wait.
std::string seconds_rounded_up(Duration duration);

} // namespace webots_cloud::core
