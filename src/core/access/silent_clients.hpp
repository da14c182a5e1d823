// Clients that have connected, but not sent a request yet.
#pragma once

#include "quota_counts.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// A bounded list: a new client is always accepted, and the one that has been silent longest is dropped for
/// it. To refuse new ones instead would let idle connections lock out all others for as long as they may be
/// idle.
class SilentClients
{
public:
    SilentClients(std::size_t max, std::size_t max_per_client) : max_(max), max_per_client_(max_per_client) {}

    /// Adds `id`, which must be higher than all before. Returns which one must be closed for it, if any: the
    /// first of the same client, or wider network (`QuotaLevels`), if that has too many, else the first of
    /// all. The empty key belongs to no client.
    std::optional<std::uint64_t> enter(std::uint64_t id, std::string const& quota_key)
    {
        std::optional<std::uint64_t> gone;
        if (auto const full = counts_.full_level(quota_key, 1, max_per_client_, max_))
            gone = first_of(full->key);
        else if (clients_.size() >= max_)
            gone = first();
        if (gone)
            (void)leave(*gone);
        clients_.emplace(id, quota_key);
        counts_.add(quota_key);
        return gone;
    }

    /// Returns its quota key; empty where it is not there any more.
    std::string leave(std::uint64_t id)
    {
        auto const client = clients_.extract(id);
        if (client.empty())
            return {};
        counts_.remove(client.mapped());
        return client.mapped();
    }

    /// The one that has been silent longest.
    std::optional<std::uint64_t> first() const
    {
        return clients_.empty() ? std::nullopt : std::optional(clients_.begin()->first);
    }

    std::size_t size() const noexcept { return clients_.size(); }

private:
    /// The one of a client or wider network that has been silent longest.
    std::optional<std::uint64_t> first_of(std::string_view level) const
    {
        auto const found = std::find_if(clients_.begin(), clients_.end(), [level](auto const& client) {
            QuotaLevels const levels(client.second);
            return std::any_of(levels.begin(), levels.end(),
                               [level](QuotaLevel const& each) { return each.key == level; });
        });
        return found == clients_.end() ? std::nullopt : std::optional(found->first);
    }

    std::size_t max_;
    std::size_t max_per_client_;
    std::map<std::uint64_t, std::string> clients_; // some hundreds: to look at all of them costs some µs
    QuotaCounts counts_;
};

} // namespace webots_cloud::core
