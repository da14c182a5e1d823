// Coroutines that run beside each other and end by themselves.
#pragma once

#include "wakeup.hpp"

#include <boost/asio/co_spawn.hpp>

#include <cstddef>
#include <exception>
#include <utility>

namespace webots_cloud::async {

/// Starts tasks and waits for the last one. As TaskGroup, but none can be cancelled: a connection of a server
/// is ended by closing it, and 10,000 of them are 3 MB smaller without.
///
/// Lifetime: must outlive its tasks, so its owner awaits `join()` before it goes.   Thread-safety: one
/// executor.
class TaskCount
{
public:
    explicit TaskCount(boost::asio::any_io_executor executor)
        : executor_(std::move(executor)), ended_(executor_)
    {}

    /// Starts a task. An exception that leaves it ends the program: it is a bug.
    void spawn(boost::asio::awaitable<void> body)
    {
        ++running_;
        auto finished = [this](std::exception_ptr failure) {
            --running_;
            ended_.notify();
            if (failure)
                std::rethrow_exception(failure);
        };
        boost::asio::co_spawn(executor_, std::move(body), std::move(finished));
    }

    /// Waits until no task is left. Not cancellable: end the tasks instead.
    boost::asio::awaitable<void> join()
    {
        while (running_ > 0)
            (void)co_await ended_.wait();
    }

private:
    boost::asio::any_io_executor executor_;
    Wakeup ended_;
    std::size_t running_ = 0;
};

} // namespace webots_cloud::async
