// An event that a coroutine waits for and another one on the same executor signals.
#pragma once

#include <webots_cloud/error.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/experimental/channel.hpp>
#include <boost/asio/this_coro.hpp>

namespace webots_cloud::async {

/// `notify()` completes one `wait()`: the one that is waiting, or else the next. Several notifications before
/// a `wait()` count as one.
class Wakeup
{
public:
    explicit Wakeup(boost::asio::any_io_executor const& executor) : channel_(executor, 1) {}

    void notify() { channel_.try_send(boost::system::error_code()); }

    /// Cancellation: terminal; then `operation_aborted`.
    boost::asio::awaitable<result<>> wait()
    {
        auto const [error] = co_await channel_.async_receive(boost::asio::as_tuple(boost::asio::deferred));
        if (error)
            co_return Failure(boost::asio::error::operation_aborted);
        co_return result<>();
    }

private:
    boost::asio::experimental::channel<void(boost::system::error_code)> channel_;
};

/// Waits until its caller is cancelled, and fails then.
inline boost::asio::awaitable<result<>> until_cancelled()
{
    Wakeup never(co_await boost::asio::this_coro::executor);
    auto const ended = co_await never.wait();
    co_return ended;
}

} // namespace webots_cloud::async
