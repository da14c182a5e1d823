// Work that may block for any time, on a thread of its own.
#pragma once

#include <webots_cloud/error.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

namespace webots_cloud::app {

namespace aside_detail {

template<class T>
struct Shared
{
    std::mutex mutex;                             ///< Guards what follows.
    boost::asio::steady_timer* waiting = nullptr; ///< Null: nobody waits any more.
    std::optional<result<T>> outcome;
};

/// From the end of its life on, the thread leaves us alone.
template<class T>
struct Waiting
{
    Waiting(std::shared_ptr<Shared<T>> with, boost::asio::steady_timer& timer) : shared(std::move(with))
    {
        shared->waiting = &timer;
    }
    Waiting(Waiting const&) = delete;
    ~Waiting()
    {
        std::lock_guard const lock(shared->mutex);
        shared->waiting = nullptr;
    }

    std::shared_ptr<Shared<T>> shared;
};

template<class T>
void work_for(std::shared_ptr<Shared<T>> const& shared, std::function<result<T>()> const& work)
{
    auto outcome = work();
    std::lock_guard const lock(shared->mutex);
    shared->outcome = std::move(outcome);
    if (!shared->waiting)
        return;
    boost::asio::post(shared->waiting->get_executor(), [shared] {
        if (shared->waiting) // it is reset by this very thread
            shared->waiting->cancel();
    });
}

} // namespace aside_detail

/// What `work` returns. It must not throw, nor refer to anything that may end before it: a caller who is
/// cancelled leaves the thread to itself.
///
/// Errors: those of `work`; `unavailable`: no thread could be started; `operation_aborted`.
template<class T>
boost::asio::awaitable<result<T>> aside(std::function<result<T>()> work)
{
    namespace asio = boost::asio;
    using Shared = aside_detail::Shared<T>;
    asio::steady_timer done(co_await asio::this_coro::executor);
    done.expires_at(asio::steady_timer::time_point::max());
    auto const shared = std::make_shared<Shared>();
    aside_detail::Waiting<T> const waiting(shared, done);
    try {
        std::thread([shared, work = std::move(work)] { aside_detail::work_for(shared, work); }).detach();
    } catch (std::system_error const& failure) {
        co_return Failure(errc::unavailable, failure.what());
    }
    (void)co_await done.async_wait(asio::as_tuple(asio::use_awaitable));
    std::lock_guard const lock(shared->mutex);
    if (!shared->outcome)
        co_return Failure(asio::error::operation_aborted);
    co_return std::move(*shared->outcome);
}

} // namespace webots_cloud::app
