// Outcomes of other threads, brought to the thread of an event loop.
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

/// What asio::post is for, without a lock. Asio wakes an event loop while it holds the lock of its
/// io_context; the kernel then often runs the event loop in place of the thread that woke it, and the event
/// loop waits for that lock until the other thread is given a core again: up to 22 ms while projects are
/// unpacked on two cores.
///
/// There is one for each io_context, which may be run by one thread only, and must outlive the threads that
/// deliver.
class Mailbox final : public boost::asio::execution_context::service
{
public:
    /// What is brought, and what is done with it.
    class Letter
    {
    public:
        Letter() = default;
        Letter(Letter const&) = delete;
        Letter& operator=(Letter const&) = delete;
        virtual ~Letter() = default;

        /// On the thread of the event loop.
        virtual void open() = 0;

    private:
        friend class Mailbox;
        Letter* older_ = nullptr;
    };

    /// That of the executor's io_context.   Thread: that of the event loop.
    static Mailbox& of(boost::asio::any_io_executor const& executor);

    explicit Mailbox(boost::asio::execution_context& context); ///< For Asio: see of().
    ~Mailbox() override;

    /// A letter will come: the event loop does not run dry before.   Thread: that of the event loop.
    void expect();

    /// Has an expected letter opened.   Thread: any.
    void deliver(std::unique_ptr<Letter> letter) noexcept;

    inline static boost::asio::execution_context::id id; ///< What Asio knows this kind of service by.

private:
    void shutdown() override;
    void wait();
    void ring() noexcept;
    void collect();
    void open_oldest();

    FileDescriptor bell_;
    std::optional<boost::asio::posix::stream_descriptor> ear_; ///< Hears the bell until shutdown().
    std::uint64_t rung_ = 0;
    bool waiting_ = false;
    std::size_t expected_ = 0;
    std::deque<std::unique_ptr<Letter>> collected_;
    std::atomic<Letter*> newest_ =
        nullptr; ///< Of those that were delivered, each of which knows the one before.
};

} // namespace webots_cloud::adapters
