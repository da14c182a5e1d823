// How often somebody may be wrong about a password or a key.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <string>
#include <unordered_map>

namespace website_host {

/// A token bucket for each client: 20 wrong guesses at once, and one a minute from then on.
class GuessLimit
{
public:
    using TimePoint = std::chrono::steady_clock::time_point;

    /// `client`: its `IncomingRequest::quota_key`. The empty one belongs to no client: that of a proxy which
    /// does not say for whom it asks.
    bool may_guess(std::string const& client, TimePoint now) const
    {
        auto const found = forgiven_at_.find(client);
        return client.empty() || found == forgiven_at_.end() ||
               std::max(found->second, now) + interval <= now + burst * interval;
    }

    void was_wrong(std::string const& client, TimePoint now)
    {
        if (client.empty())
            return;
        if (forgiven_at_.size() >= max_clients)
            make_room(now);
        auto& forgiven_at = forgiven_at_[client];
        forgiven_at = std::max(forgiven_at, now) + interval;
    }

    std::size_t size() const noexcept { return forgiven_at_.size(); }

    static constexpr int burst = 20;
    static constexpr std::chrono::seconds interval{60};
    static constexpr std::size_t max_clients = 10'000;

private:
    /// Forgets those that are forgiven, and if there are none, all: more addresses than that guess together.
    void make_room(TimePoint now)
    {
        std::erase_if(forgiven_at_, [now](auto const& client) { return client.second <= now; });
        if (forgiven_at_.size() >= max_clients)
            forgiven_at_.clear();
    }

    std::unordered_map<std::string, TimePoint> forgiven_at_; ///< When all of a client's guesses are.
};

} // namespace website_host
