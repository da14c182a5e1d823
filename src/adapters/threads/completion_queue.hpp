// Brings what other threads have completed back to the thread of an event loop.
#pragma once

#include "adapters/files/file_descriptor.hpp"

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/execution_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

namespace webots_cloud::adapters {

/// A lock-free replacement for asio::post. Asio wakes an event loop while it holds the lock of its
/// io_context; the kernel then often runs the event loop in place of the thread that woke it, and the event
/// loop waits for that lock until the other thread is given a core again: up to 22 ms while projects are
/// unpacked on two cores.
///
/// There is one for each io_context, which may be run by one thread only, and must outlive the threads that
/// deliver.
class CompletionQueue final : public boost::asio::execution_context::service
{
public:
    /// What a thread has completed.
    class Completion
    {
    public:
        Completion() = default;
        Completion(Completion const&) = delete;
        Completion& operator=(Completion const&) = delete;
        virtual ~Completion() = default;

        /// On the thread of the event loop.
        virtual void complete() = 0;

    private:
        friend class CompletionQueue;
        Completion* older_ = nullptr;
    };

    /// That of the executor's io_context.   Thread: that of the event loop.
    static CompletionQueue& of(boost::asio::any_io_executor const& executor);

    explicit CompletionQueue(boost::asio::execution_context& context); ///< For Asio: see of().
    ~CompletionQueue() override;

    /// Announces a completion: the event loop does not run out of work before it arrives.   Thread: that of
    /// the event loop.
    void expect();

    /// Calls `complete()` of an expected completion on the event loop.   Thread: any.
    void deliver(std::unique_ptr<Completion> completion) noexcept;

    inline static boost::asio::execution_context::id id; ///< What Asio knows this kind of service by.

private:
    void shutdown() override;
    void wait();
    void wake() noexcept;
    void collect();
    void complete_oldest();

    FileDescriptor wake_up_;
    std::optional<boost::asio::posix::stream_descriptor>
        wake_up_reader_; ///< Of `wake_up_`, until shutdown().
    std::uint64_t wake_ups_ = 0;
    bool waiting_ = false;
    std::size_t expected_ = 0;
    std::deque<std::unique_ptr<Completion>> taken_;
    std::atomic<Completion*> newest_ = nullptr; ///< Delivered last; each knows the one before.
};

} // namespace webots_cloud::adapters
