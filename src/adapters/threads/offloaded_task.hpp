// A task for another thread whose result comes back to the event loop.
#pragma once

#include "completion_queue.hpp"
#include "worker_threads.hpp"

#include <boost/asio/any_io_executor.hpp>

#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

namespace webots_cloud::adapters {

/// Made and destroyed on the event loop, so that no thread need free what another allocated.
template<class Work, class Done>
class OffloadedTask final : public WorkerThreads::Job, public CompletionQueue::Completion
{
public:
    OffloadedTask(CompletionQueue& queue, Work work, Done done)
        : queue_(queue), work_(std::move(work)), done_(std::move(done))
    {}

    void run(std::unique_ptr<Job> self) override
    {
        outcome_.emplace(work_());
        (void)self.release();
        queue_.deliver(std::unique_ptr<Completion>(this));
    }

    void complete() override { done_(std::move(*outcome_)); }

private:
    CompletionQueue& queue_;
    Work work_;
    Done done_;
    std::optional<std::invoke_result_t<Work&>> outcome_;
};

/// Runs `work` on one of the threads, and then calls `done` with its result on the event loop of
/// `home`, which does not run out of work before. Neither may throw.   Thread: that of the event loop.
template<class Work, class Done>
void offload(WorkerThreads& threads, boost::asio::any_io_executor const& home, Work work, Done done)
{
    auto& queue = CompletionQueue::of(home);
    auto task = std::make_unique<OffloadedTask<Work, Done>>(queue, std::move(work), std::move(done));
    queue.expect();
    threads.post(std::move(task));
}

} // namespace webots_cloud::adapters
