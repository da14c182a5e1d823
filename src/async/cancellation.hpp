// Whether the running coroutine was asked to end.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/this_coro.hpp>

namespace webots_cloud::async {

/// True once the coroutine was cancelled.
///
/// A cancellation that comes while an operation has completed already but its coroutine has not run yet stops
/// nothing. So every loop whose coroutine does not throw on cancellation asks before it waits again.
inline boost::asio::awaitable<bool> is_cancelled()
{
    auto const state = co_await boost::asio::this_coro::cancellation_state;
    co_return state.cancelled() != boost::asio::cancellation_type::none;
}

} // namespace webots_cloud::async
