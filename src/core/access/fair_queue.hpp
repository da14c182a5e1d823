// Whose turn it is next where clients ask for more than can be done at once.
#pragma once

#include "quota_levels.hpp"

#include <webots_cloud/time.hpp>

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

namespace webots_cloud::core {

/// The client that has asked for least lately goes first, however many things others have waiting. A client
/// may have four turns a second: of a client that asks for more, each thing waits behind all that is due
/// earlier, as if it had come when its turn is (virtual clocks: L. Zhang, SIGCOMM 1990). It is never more
/// than `max_debt` behind clients that come for the first time. The wider networks of a client
/// (`QuotaLevels`) have turns, too, as many more as their factors say; the latest of all these turns counts.
///
/// Memory: the things that wait, and a time for each client and network that has asked for more, of about
/// 65,536: then all begin anew.
template<class Thing>
class FairQueue
{
public:
    /// `client`: a quota key. `now` never decreases.
    void push(std::string const& client, Thing thing, TimePoint now)
    {
        if (due_.size() >= next_sweep_)
            forget(now);
        auto when = now;
        for (auto const& level : QuotaLevels(client)) {
            auto& due = due_.try_emplace(std::string(level.key), now).first->second;
            when = std::max(when, due);
            due = std::min(std::max(due, now) + turn / static_cast<Duration::rep>(level.factor),
                           now + max_debt);
        }
        waiting_.emplace(when, std::move(thing));
    }

    /// The next thing; none: nothing waits.
    std::optional<Thing> pop()
    {
        if (waiting_.empty())
            return {};
        auto const first = waiting_.begin();
        std::optional<Thing> thing(std::move(first->second));
        waiting_.erase(first);
        return thing;
    }

    std::size_t size() const noexcept { return waiting_.size(); }

private:
    static constexpr Duration turn = std::chrono::milliseconds(250);
    static constexpr Duration max_debt = std::chrono::seconds(30);
    static constexpr std::size_t max_clients = 65'536;
    static constexpr std::size_t min_sweep = 1'024;

    void forget(TimePoint now)
    {
        std::erase_if(due_, [now](auto const& client) { return client.second <= now; });
        if (due_.size() >= max_clients)
            due_.clear();
        next_sweep_ = std::min(max_clients, std::max(min_sweep, 2 * due_.size()));
    }

    std::multimap<TimePoint, Thing> waiting_;        // of equal ones the first that came
    std::unordered_map<std::string, TimePoint> due_; // the next turn of each client
    std::size_t next_sweep_ = min_sweep;
};

} // namespace webots_cloud::core
