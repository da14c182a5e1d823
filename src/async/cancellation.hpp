// Whether the running coroutine has been cancelled, and parts of it that are cancelled differently.
//
// Whether a coroutine can be cancelled, and whether it throws then, is a state that it shares with every
// coroutine that it awaits: one that changes it changes it for its caller, for good.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <utility>

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

/// Awaits `work` with a cancellation state of its own: it is cancelled with its caller, and whatever it makes
/// of that state ends with it.
template<class T>
boost::asio::awaitable<T> isolated(boost::asio::awaitable<T> work)
{
    auto const executor = co_await boost::asio::this_coro::executor;
    co_return co_await boost::asio::co_spawn(executor, std::move(work), boost::asio::use_awaitable);
}

namespace detail {

template<class T>
boost::asio::awaitable<T> without_cancellation(boost::asio::awaitable<T> work)
{
    co_await boost::asio::this_coro::reset_cancellation_state(boost::asio::disable_cancellation());
    co_return co_await std::move(work);
}

} // namespace detail

/// Awaits `work` to its end, though the caller be cancelled meanwhile; the caller finds itself cancelled
/// then.
template<class T>
boost::asio::awaitable<T> uncancellable(boost::asio::awaitable<T> work)
{
    return isolated(detail::without_cancellation(std::move(work)));
}

} // namespace webots_cloud::async
