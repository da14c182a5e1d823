// Concurrent coroutines that end with their owner.
#pragma once

#include "cancellation.hpp"
#include "wakeup.hpp"

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>

#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>

#include <exception>
#include <list>
#include <memory>
#include <utility>

namespace webots_cloud::async {

/// Starts tasks, cancels them, and waits for the last one.
///
/// Lifetime: must outlive its tasks, so its owner awaits `join()` before it goes.   Thread-safety: one
/// executor.
class TaskGroup
{
public:
    struct Running
    {
        boost::asio::cancellation_signal signal;
        bool has_begun = false;
        bool has_ended = false;
        bool is_cancelled = false;
    };

    using Task = std::shared_ptr<Running>;

    explicit TaskGroup(boost::asio::any_io_executor executor)
        : executor_(std::move(executor)), ended_(executor_)
    {}

    /// Starts a task at the executor's next turn. It begins even if it is cancelled before: bodies may have
    /// to tidy up what was prepared for them. An exception that escapes from it is a bug, and ends the
    /// program.
    Task spawn(boost::asio::awaitable<void> body)
    {
        auto const task = std::make_shared<Running>();
        auto const place = tasks_.insert(tasks_.end(), task);
        auto finished = [this, place](std::exception_ptr failure) {
            (*place)->has_ended = true;
            tasks_.erase(place);
            ended_.notify();
            if (failure)
                std::rethrow_exception(failure);
        };
        boost::asio::co_spawn(executor_, begin(task, std::move(body)),
                              boost::asio::bind_cancellation_slot(task->signal.slot(), std::move(finished)));
        return task;
    }

    /// Cancels one task.
    static void cancel(Task const& task)
    {
        task->is_cancelled = true;
        if (task->has_begun && !task->has_ended)
            task->signal.emit(boost::asio::cancellation_type::terminal);
    }

    void cancel_all()
    {
        for (auto place = tasks_.begin(); place != tasks_.end();) {
            auto const task = *place++; // it may end, and erase itself, while it is being cancelled
            cancel(task);
        }
    }

    boost::asio::any_io_executor const& executor() const noexcept { return executor_; }

    std::size_t size() const noexcept { return tasks_.size(); }

    /// Waits until no task is left. Not cancellable: cancel the tasks instead.
    boost::asio::awaitable<void> join()
    {
        while (!tasks_.empty())
            (void)co_await ended_.wait();
    }

    /// Cancels all tasks, and waits for them, though the caller be cancelled too.
    boost::asio::awaitable<void> end()
    {
        cancel_all();
        return uncancellable(join());
    }

private:
    /// Boost 1.83 and newer would never begin what was cancelled before, and fail instead.
    static boost::asio::awaitable<void> begin(Task task, boost::asio::awaitable<void> body)
    {
        task->has_begun = true;
        if (task->is_cancelled) {
            auto const executor = co_await boost::asio::this_coro::executor;
            boost::asio::post(executor, [task] { cancel(task); }); // when it waits for the first time
        }
        co_await std::move(body);
    }

    boost::asio::any_io_executor executor_;
    std::list<Task> tasks_;
    Wakeup ended_;
};

} // namespace webots_cloud::async
