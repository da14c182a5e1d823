// An operation with a deadline on a Clock, so that it also expires in virtual time.
#pragma once

#include "cancellation.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/clock.hpp>

#include <boost/asio/experimental/awaitable_operators.hpp>

#include <utility>

namespace webots_cloud::async {

/// The result of `operation`, or `timed_out` if it has not completed by `when`: then it is cancelled and
/// awaited.
///
/// Cancellation: terminal; `operation_aborted`, also when the caller was cancelled before.
template<class T>
boost::asio::awaitable<result<T>> with_deadline(Clock& clock, TimePoint when,
                                                boost::asio::awaitable<result<T>> operation)
{
    using namespace boost::asio::experimental::awaitable_operators;
    bool const cancelled = co_await is_cancelled();
    if (cancelled)
        co_return Failure(boost::asio::error::operation_aborted);
    auto outcome = co_await (std::move(operation) || clock.wait_until(when));
    if (outcome.index() == 0)
        co_return std::move(std::get<0>(outcome));
    if (!std::get<1>(outcome))
        co_return std::get<1>(outcome).error();
    co_return Failure(errc::timed_out);
}

} // namespace webots_cloud::async
