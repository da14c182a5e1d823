// Time as a seam: services wait on a Clock, so that their tests run in virtual time.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>

#include <boost/asio/awaitable.hpp>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Tells the time and waits for it.
///
/// Contract: `now()` never goes back. `wait_until` completes no earlier than its moment, in order of due time
/// and, for equal times, of the calls; at once (but never from inside the call) when the moment has passed.
/// Cancellation: terminal; `wait_until` then reports `operation_aborted`.
/// Thread-safety: one executor.
class Clock
{
public:
    virtual ~Clock() = default;

    virtual TimePoint now() const noexcept = 0;
    virtual WallTime wall() const noexcept = 0;
    virtual boost::asio::awaitable<result<>> wait_until(TimePoint when) = 0;
};

} // namespace webots_cloud
