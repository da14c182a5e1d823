// An operation with a deadline on a Clock, so that it also expires in virtual time.
#pragma once

#include "cancellation.hpp"
#include "first_of.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/clock.hpp>

#include <optional>
#include <utility>

namespace webots_cloud::async {

/// Fails with `timed_out` at `when`, or when it is cancelled.   Lifetime: as of `clock`.
Part expire(Clock& clock, TimePoint when);

/// Succeeds when the operation ends, and leaves what it has returned in `outcome`, which outlives this.
template<class T>
Part keep_outcome(boost::asio::awaitable<result<T>> operation, std::optional<result<T>>& outcome)
{
    auto ended = co_await std::move(operation);
    outcome.emplace(std::move(ended));
    co_return result<>();
}

/// The result of `operation`, or `timed_out` if it has not completed by `when`: then it is cancelled and
/// awaited.
///
/// Cancellation: terminal; `operation_aborted`, also when the caller was cancelled before.
template<class T>
boost::asio::awaitable<result<T>> with_deadline(Clock& clock, TimePoint when,
                                                boost::asio::awaitable<result<T>> operation)
{
    bool const cancelled = co_await is_cancelled();
    if (cancelled)
        co_return Failure(boost::asio::error::operation_aborted);
    std::optional<result<T>> outcome; // beside the group, whose code is the same for every T
    auto parts = first_of(keep_outcome(std::move(operation), outcome), expire(clock, when));
    auto const ended = co_await std::move(parts);
    if (!ended)
        co_return ended.error();
    co_return std::move(*outcome);
}

} // namespace webots_cloud::async
