#include "mailbox.hpp"

#include <boost/asio/buffer.hpp>

#include <sys/eventfd.h>

#include <cerrno>
#include <system_error>

namespace webots_cloud::adapters {

namespace asio = boost::asio;

Mailbox& Mailbox::of(asio::any_io_executor const& executor)
{
    auto& mailbox = asio::use_service<Mailbox>(asio::query(executor, asio::execution::context));
    if (!mailbox.ear_)
        mailbox.ear_.emplace(executor, mailbox.bell_.get());
    return mailbox;
}

Mailbox::Mailbox(asio::execution_context& context)
    : service(context), bell_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK))
{
    if (!bell_)
        throw std::system_error(errno, std::generic_category(), "eventfd");
}

Mailbox::~Mailbox()
{
    collect(); // what came after shutdown()
}

void Mailbox::shutdown()
{
    collect();
    collected_.clear();
    // While Asio's services still work. The bell stays: threads may still ring it.
    if (ear_)
        (void)ear_->release();
    ear_.reset();
}

void Mailbox::expect()
{
    ++expected_;
    if (!waiting_)
        wait();
}

void Mailbox::deliver(std::unique_ptr<Letter> letter) noexcept
{
    auto* const added = letter.release();
    auto* older = newest_.load(std::memory_order_relaxed);
    do
        added->older_ = older;
    while (
        !newest_.compare_exchange_weak(older, added, std::memory_order_release, std::memory_order_relaxed));
    // From here on it may have been opened. Who finds others there can rely on the first of them to ring.
    if (!older)
        ring();
}

void Mailbox::ring() noexcept
{
    (void)::eventfd_write(bell_.get(), 1);
}

void Mailbox::wait()
{
    waiting_ = true;
    ear_->async_read_some(asio::buffer(&rung_, sizeof rung_),
                          [this](boost::system::error_code error, std::size_t) {
                              waiting_ = false;
                              if (!error)
                                  open_oldest();
                          });
}

/// In the order in which they were delivered.
void Mailbox::collect()
{
    auto const collected = static_cast<std::ptrdiff_t>(collected_.size());
    for (auto* letter = newest_.exchange(nullptr, std::memory_order_acquire); letter; letter = letter->older_)
        collected_.emplace(collected_.begin() + collected, letter);
}

/// One at a time: all else that the event loop has to do need not wait for many, and none is lost when one
/// throws.
void Mailbox::open_oldest()
{
    collect();
    std::unique_ptr<Letter> letter;
    if (!collected_.empty()) { // else this is the ring of a letter that was found earlier
        letter = std::move(collected_.front());
        collected_.pop_front();
        --expected_;
    }
    if (expected_ > 0)
        wait();
    if (!collected_.empty())
        ring();
    if (letter)
        letter->open();
}

} // namespace webots_cloud::adapters
