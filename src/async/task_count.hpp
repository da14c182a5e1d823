// Concurrent coroutines that end by themselves.
#pragma once

#include "wakeup.hpp"

#include <boost/asio/co_spawn.hpp>

#include <cstddef>
#include <exception>
#include <utility>

namespace webots_cloud::async {

/// Starts tasks and waits for the last one. Like TaskGroup, but tasks can't be cancelled: closing a
/// connection ends its task, and 10,000 connections take 3 MB less without cancellation.
///
/// Lifetime: must outlive its tasks, so its owner awaits `join()` before it goes.   Thread-safety: one
/// executor.
class TaskCount
{
public:
    explicit TaskCount(boost::asio::any_io_executor executor)
        : executor_(std::move(executor)), ended_(executor_)
    {}

    /// Starts a task. An exception that escapes from it is a bug, and ends the program.
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
