// A notifier that records what it delivers, and fails on demand.
#pragma once

#include <webots_cloud/testing/fuse.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/notifier.hpp>

#include <optional>
#include <utility>
#include <vector>

namespace webots_cloud::testing {

/// Every attempt takes `delay` and then succeeds, unless `failure` is set or the fuse blows.
///
/// Lifetime: `clock` must outlive it.
class RecordingNotifier final : public Notifier
{
public:
    explicit RecordingNotifier(Clock& clock) : clock_(clock) {}

    boost::asio::awaitable<result<>> deliver(Notice notice) override
    {
        attempts.push_back(clock_.now());
        auto const end = hangs ? TimePoint::max() : clock_.now() + delay;
        auto const waited = co_await clock_.wait_until(end);
        if (!waited)
            co_return waited;
        if (auto const blown = fuse.strike())
            co_return *blown;
        if (failure)
            co_return *failure;
        delivered.push_back(std::move(notice));
        co_return result<>();
    }

    Duration delay{};
    bool hangs = false;             ///< Attempts never end, until they are cancelled.
    std::optional<Failure> failure; ///< Of every attempt, while it is set.
    Fuse fuse;
    std::vector<TimePoint> attempts; ///< When each began.
    std::vector<Notice> delivered;

private:
    Clock& clock_;
};

} // namespace webots_cloud::testing
