// The notifier of the day: the mail server may change while the session server runs.
#pragma once

#include <webots_cloud/transport/notifier.hpp>

#include <memory>
#include <utility>

namespace webots_cloud::app {

/// Delivers through another notifier, from its next attempt on through the one that was given last.
class CurrentNotifier final : public Notifier
{
public:
    void use(std::shared_ptr<Notifier> next) { current_ = std::move(next); }

    boost::asio::awaitable<result<>> deliver(Notice notice) override
    {
        auto const notifier = current_; // until this attempt has ended, whatever is used meanwhile
        if (!notifier)
            co_return Failure(errc::unavailable, "no mail server is configured");
        co_return co_await notifier->deliver(std::move(notice));
    }

private:
    std::shared_ptr<Notifier> current_;
};

} // namespace webots_cloud::app
