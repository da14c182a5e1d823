// A notifier that can be replaced, because the mail server may change while the session server runs.
#pragma once

#include <webots_cloud/transport/notifier.hpp>

#include <memory>
#include <utility>

namespace webots_cloud::app {

/// Delivers through another notifier. A new one takes effect with the next attempt.
class CurrentNotifier final : public Notifier
{
public:
    void use(std::shared_ptr<Notifier> next) { current_ = std::move(next); }

    boost::asio::awaitable<result<>> deliver(Notice notice) override
    {
        auto const notifier = current_; // keeps it alive for this attempt, even when it is replaced meanwhile
        if (!notifier)
            co_return Failure(errc::unavailable, "no mail server is configured");
        co_return co_await notifier->deliver(std::move(notice));
    }

private:
    std::shared_ptr<Notifier> current_;
};

} // namespace webots_cloud::app
