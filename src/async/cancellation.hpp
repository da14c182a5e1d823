// Whether the running coroutine has been cancelled.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/this_coro.hpp>

namespace webots_cloud::async {

/// True once the coroutine was cancelled.
///
/// A cancellation ends only what is awaited at that moment. One that arrives after an operation has
/// completed, but before its coroutine has resumed, or during an operation that is not cancellable, is lost.
/// So every loop in a coroutine that does not throw on cancellation checks this before it waits again.
inline boost::asio::awaitable<bool> is_cancelled()
{
    auto const state = co_await boost::asio::this_coro::cancellation_state;
    co_return state.cancelled() != boost::asio::cancellation_type::none;
}

} // namespace webots_cloud::async
