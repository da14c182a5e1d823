#include <webots_cloud/testing/loopback_channel.hpp>

#include "async/wakeup.hpp"

#include <algorithm>
#include <deque>

namespace webots_cloud::testing {

struct LoopbackChannel::Inbox
{
    explicit Inbox(boost::asio::any_io_executor const& executor) : happened(executor) {}

    std::deque<std::string> messages;
    bool closed = false;
    bool lost = false;
    std::uint16_t farewell = 0;
    async::Wakeup happened;
};

LoopbackChannel::LoopbackChannel(boost::asio::any_io_executor executor)
    : inbox_(std::make_unique<Inbox>(executor))
{}

LoopbackChannel::~LoopbackChannel() = default;

void LoopbackChannel::browser_says(std::string text)
{
    inbox_->messages.push_back(std::move(text));
    inbox_->happened.notify();
}

void LoopbackChannel::browser_leaves(std::uint16_t code)
{
    if (!inbox_->closed)
        inbox_->farewell = code;
    inbox_->closed = true;
    inbox_->happened.notify();
}

void LoopbackChannel::browser_is_lost()
{
    inbox_->lost = true;
    browser_leaves();
}

result<> LoopbackChannel::send(std::string text)
{
    if (inbox_->closed)
        return Failure(errc::closed);
    sent.push_back(std::move(text));
    return {};
}

boost::asio::awaitable<result<std::string>> LoopbackChannel::receive()
{
    while (inbox_->messages.empty()) {
        if (inbox_->closed)
            co_return Failure(inbox_->lost ? errc::unreachable : errc::closed);
        auto const woken = co_await inbox_->happened.wait();
        if (!woken)
            co_return woken.error();
    }
    auto message = std::move(inbox_->messages.front());
    inbox_->messages.pop_front();
    co_return message;
}

void LoopbackChannel::close(std::uint16_t code, std::string)
{
    if (!close_code)
        close_code = code;
    browser_leaves();
}

std::uint16_t LoopbackChannel::farewell() const noexcept
{
    return inbox_->farewell;
}

bool LoopbackChannel::was_told(std::string_view text) const
{
    return std::any_of(sent.begin(), sent.end(),
                       [&](std::string const& message) { return message.starts_with(text); });
}

} // namespace webots_cloud::testing
