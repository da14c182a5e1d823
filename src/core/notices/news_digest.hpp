// Which news the administrator gets at once, and which wait for a digest: a server that flaps must not fill a
// mailbox.
//
// The rule. Of one server, the first two news go out at once: that it fell, and that it is back. Of all
// servers together, no more than ten go out at once. What comes beyond either is collected, and goes out as
// one digest ten minutes after the first of it. A server has its two again after ten minutes without news of
// it, and all servers have their ten again after ten minutes without news of any: what never calms down is
// heard of once in ten minutes.
#pragma once

#include "notification.hpp"

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

struct DigestRule
{
    DigestRule() = default;

    Duration interval = std::chrono::minutes(10); ///< From the first news that was collected to the digest.
    int server_at_once = 2; ///< News of one server that go out at once, until it was calm for an interval.
    int total_at_once = 10; ///< News of all servers that go out at once, until all were calm for an interval.
    std::size_t longest = 500; ///< News in one digest; beyond, the oldest are counted but not listed.
};

/// What was collected.
struct Digest
{
    Digest() = default;

    std::vector<News> news;   ///< In the order in which it came.
    std::size_t left_out = 0; ///< Older ones, beyond the longest digest.
};

/// Applies the rule. Its memory is bounded by the number of servers with news in one interval, and by the
/// longest digest.
class NewsDigest
{
public:
    explicit NewsDigest(DigestRule rule = {}) : rule_(rule) {}

    /// News of a server: true when it goes out at once, false when the digest has taken a copy.
    bool at_once(std::string_view server, News const& news, TimePoint now);

    /// When `take` has something to give.
    std::optional<TimePoint> due() const noexcept { return due_; }

    /// Whatever was collected, whether it is due or not; afterwards nothing is.
    Digest take();

private:
    /// How much went out at once, and when there was news last.
    struct Account
    {
        int spent = 0;
        TimePoint last;
    };

    void forget_calm_ones(TimePoint now);

    DigestRule rule_;
    int total_spent_ = 0;
    std::map<std::string, Account, std::less<>> servers_;
    Digest collected_;
    std::optional<TimePoint> due_;
};

} // namespace webots_cloud::core
