// Threads for work that blocks: files and libraries that wait.
#pragma once

#include "offloaded_task.hpp"

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <type_traits>
#include <utility>

namespace webots_cloud::adapters {

/// Runs functions on threads of its own and comes back to the caller's executor. The event loop waits for
/// none of the threads.
///
/// The destructor waits for what runs.   Thread-safety: one executor.
class BlockingPool
{
public:
    using Priority = WorkerThreads::Priority;

    explicit BlockingPool(std::size_t threads, Priority priority = Priority::normal)
        : threads_(threads, priority)
    {}

    /// Completes with what `work` returns. Not cancellable: `work` must end by itself. It must not throw.
    template<class Work>
    boost::asio::awaitable<std::invoke_result_t<Work&>> run(Work work)
    {
        auto const executor = co_await boost::asio::this_coro::executor;
        Initiation<Work> initiation(threads_, executor, std::move(work));
        co_return co_await boost::asio::async_initiate<boost::asio::use_awaitable_t<> const,
                                                       void(std::invoke_result_t<Work&>)>(
            std::move(initiation), boost::asio::use_awaitable);
    }

    /// As `run`, for work that checks a flag: it becomes true when the caller is cancelled, and the work
    /// should end soon then.
    template<class Work>
    boost::asio::awaitable<std::invoke_result_t<Work&, std::atomic<bool> const&>> run_abortable(Work work)
    {
        auto const state = co_await boost::asio::this_coro::cancellation_state;
        auto const aborted =
            std::make_shared<std::atomic<bool>>(state.cancelled() != boost::asio::cancellation_type::none);
        // The job itself is not cancellable, so the slot is free for the flag that makes it end early.
        SetFlag on_cancel{aborted};
        auto slot = state.slot();
        if (slot.is_connected())
            slot.assign(std::move(on_cancel));
        auto job = [aborted, work = std::move(work)]() mutable { return work(*aborted); };
        auto outcome = co_await run(std::move(job));
        if (slot.is_connected())
            slot.clear();
        co_return outcome;
    }

    /// For work on one of the pool's threads: does `work` there and, at the same time, on each of `helpers`
    /// other threads that becomes free before it is done. Returns when no thread works on it any more.
    /// Precondition: `work` divides itself among its callers.
    template<class Work>
    void share(std::size_t helpers, Work const& work)
    {
        auto const shared = std::make_shared<Shared>();
        for (std::size_t i = 0; i < helpers; ++i)
            threads_.post([shared, &work] {
                if (!shared->enter())
                    return; // too late: `work` may be gone
                work();
                shared->leave();
            });
        work();
        shared->close();
    }

private:
    /// The threads that help with shared work.
    class Shared
    {
    public:
        bool enter()
        {
            std::lock_guard const lock(mutex_);
            helping_ += closed_ ? 0 : 1;
            return !closed_;
        }

        void leave()
        {
            std::lock_guard const lock(mutex_);
            --helping_;
            left_.notify_all();
        }

        void close()
        {
            std::unique_lock lock(mutex_);
            closed_ = true;
            left_.wait(lock, [this] { return helping_ == 0; });
        }

    private:
        std::mutex mutex_;
        std::condition_variable left_;
        std::size_t helping_ = 0;
        bool closed_ = false;
    };

    struct SetFlag
    {
        void operator()(boost::asio::cancellation_type) const { *flag = true; }

        std::shared_ptr<std::atomic<bool>> flag;
    };

    // A class instead of a lambda with captures: those near a co_await are destroyed twice by g++ 12.
    template<class Work>
    class Initiation
    {
    public:
        Initiation(WorkerThreads& threads, boost::asio::any_io_executor home, Work work)
            : threads_(threads), home_(std::move(home)), work_(std::move(work))
        {}

        template<class Handler>
        void operator()(Handler handler)
        {
            using Outcome = std::invoke_result_t<Work&>;
            auto done = [home = home_, handler = std::move(handler)](Outcome outcome) mutable {
                boost::asio::dispatch(home,
                                      [handler = std::move(handler), outcome = std::move(outcome)]() mutable {
                                          std::move(handler)(std::move(outcome));
                                      });
            };
            offload(threads_, home_, std::move(work_), std::move(done));
        }

    private:
        WorkerThreads& threads_;
        boost::asio::any_io_executor home_;
        Work work_;
    };

    WorkerThreads threads_;
};

} // namespace webots_cloud::adapters
