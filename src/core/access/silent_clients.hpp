// Clients that have connected, but not sent a request yet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <string>

namespace webots_cloud::core {

/// A bounded list: a new client is always accepted, and the one that has been silent longest is dropped for
/// it. To refuse new ones instead would let idle connections lock out all others for as long as they may be
/// idle.
class SilentClients
{
public:
    SilentClients(std::size_t max, std::size_t max_per_client) : max_(max), max_per_client_(max_per_client) {}

    /// Adds `id`, which must be higher than all before. Returns which one must be closed for it, if any: the
    /// first of the same client if that has too many, else the first of all. The empty key belongs to no
    /// client.
    std::optional<std::uint64_t> enter(std::uint64_t id, std::string const& quota_key)
    {
        std::size_t own = 1;
        auto victim = clients_.begin();
        for (auto one = clients_.rbegin(); one != clients_.rend() && !quota_key.empty(); ++one) {
            own += one->second == quota_key ? 1 : 0;
            if (own > max_per_client_) {
                victim = std::prev(one.base());
                break;
            }
        }
        bool const is_full = own > max_per_client_ || clients_.size() >= max_;
        std::optional<std::uint64_t> gone;
        if (is_full && victim != clients_.end()) {
            gone = victim->first;
            clients_.erase(victim);
        }
        clients_.emplace(id, quota_key);
        return gone;
    }

    /// Returns its quota key; empty where it is not there any more.
    std::string leave(std::uint64_t id)
    {
        auto const client = clients_.extract(id);
        return client.empty() ? std::string() : client.mapped();
    }

    /// The one that has been silent longest.
    std::optional<std::uint64_t> first() const
    {
        return clients_.empty() ? std::nullopt : std::optional(clients_.begin()->first);
    }

    std::size_t size() const noexcept { return clients_.size(); }

private:
    std::size_t max_;
    std::size_t max_per_client_;
    std::map<std::uint64_t, std::string>
        clients_; // some hundreds: to look at all of them costs a microsecond
};

} // namespace webots_cloud::core
