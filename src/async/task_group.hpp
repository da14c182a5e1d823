// Concurrent coroutines that end with their owner.
#pragma once

#include "cancellation.hpp"
#include "wakeup.hpp"

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>

#include <exception>
#include <list>
#include <utility>

namespace webots_cloud::async {

/// Starts tasks, cancels them, and waits for the last one.
///
/// Lifetime: must outlive its tasks, so its owner awaits `join()` before it goes.   Thread-safety: one
/// executor.
class TaskGroup
{
public:
    using Task = std::list<boost::asio::cancellation_signal>::iterator;

    explicit TaskGroup(boost::asio::any_io_executor executor)
        : executor_(std::move(executor)), ended_(executor_)
    {}

    /// Starts a task at the executor's next turn. An exception that escapes from it is a bug, and ends the
    /// program.
    Task spawn(boost::asio::awaitable<void> body)
    {
        auto const task = signals_.emplace(signals_.end());
        auto finished = [this, task](std::exception_ptr failure) {
            signals_.erase(task);
            ended_.notify();
            if (failure)
                std::rethrow_exception(failure);
        };
        boost::asio::co_spawn(executor_, std::move(body),
                              boost::asio::bind_cancellation_slot(task->slot(), std::move(finished)));
        return task;
    }

    /// Cancels one task; it must not have ended.
    static void cancel(Task task) { task->emit(boost::asio::cancellation_type::terminal); }

    void cancel_all()
    {
        for (auto task = signals_.begin(); task != signals_.end();)
            cancel(task++); // a task may end, and erase itself, while it is being cancelled
    }

    boost::asio::any_io_executor const& executor() const noexcept { return executor_; }

    std::size_t size() const noexcept { return signals_.size(); }

    /// Waits until no task is left. Not cancellable: cancel the tasks instead.
    boost::asio::awaitable<void> join()
    {
        while (!signals_.empty())
            (void)co_await ended_.wait();
    }

    /// Cancels all tasks, and waits for them, though the caller be cancelled too.
    boost::asio::awaitable<void> end()
    {
        cancel_all();
        return uncancellable(join());
    }

private:
    boost::asio::any_io_executor executor_;
    std::list<boost::asio::cancellation_signal> signals_;
    Wakeup ended_;
};

} // namespace webots_cloud::async
