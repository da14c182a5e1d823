#include "completion_queue.hpp"

#include <boost/asio/buffer.hpp>

#include <sys/eventfd.h>

#include <cerrno>
#include <system_error>

namespace webots_cloud::adapters {

namespace asio = boost::asio;

CompletionQueue& CompletionQueue::of(asio::any_io_executor const& executor)
{
    auto& queue = asio::use_service<CompletionQueue>(asio::query(executor, asio::execution::context));
    if (!queue.wake_up_reader_)
        queue.wake_up_reader_.emplace(executor, queue.wake_up_.get());
    return queue;
}

CompletionQueue::CompletionQueue(asio::execution_context& context)
    : service(context), wake_up_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK))
{
    if (!wake_up_)
        throw std::system_error(errno, std::generic_category(), "eventfd");
}

CompletionQueue::~CompletionQueue()
{
    collect(); // what came after shutdown()
}

void CompletionQueue::shutdown()
{
    collect();
    taken_.clear();
    // While Asio's services still work. The eventfd stays: threads may still write to it.
    if (wake_up_reader_)
        (void)wake_up_reader_->release();
    wake_up_reader_.reset();
}

void CompletionQueue::expect()
{
    ++expected_;
    if (!waiting_)
        wait();
}

void CompletionQueue::deliver(std::unique_ptr<Completion> completion) noexcept
{
    auto* const added = completion.release();
    auto* older = newest_.load(std::memory_order_relaxed);
    do
        added->older_ = older;
    while (
        !newest_.compare_exchange_weak(older, added, std::memory_order_release, std::memory_order_relaxed));
    // From here on it may be complete already. Where others are in the queue, the first of them wakes the
    // loop.
    if (!older)
        wake();
}

void CompletionQueue::wake() noexcept
{
    (void)::eventfd_write(wake_up_.get(), 1);
}

void CompletionQueue::wait()
{
    waiting_ = true;
    wake_up_reader_->async_read_some(asio::buffer(&wake_ups_, sizeof wake_ups_),
                                     [this](boost::system::error_code error, std::size_t) {
                                         waiting_ = false;
                                         if (!error)
                                             complete_oldest();
                                     });
}

/// In the order in which they were delivered.
void CompletionQueue::collect()
{
    auto const collected = static_cast<std::ptrdiff_t>(taken_.size());
    for (auto* completion = newest_.exchange(nullptr, std::memory_order_acquire); completion;
         completion = completion->older_)
        taken_.emplace(taken_.begin() + collected, completion);
}

/// One at a time: all else that the event loop has to do need not wait for many, and none is lost when one
/// throws.
void CompletionQueue::complete_oldest()
{
    collect();
    std::unique_ptr<Completion> completion;
    if (!taken_.empty()) { // else what woke us was taken by an earlier call
        completion = std::move(taken_.front());
        taken_.pop_front();
        --expected_;
    }
    if (expected_ > 0)
        wait();
    if (!taken_.empty())
        wake();
    if (completion)
        completion->complete();
}

} // namespace webots_cloud::adapters
