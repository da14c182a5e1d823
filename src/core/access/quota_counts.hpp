// How much clients have, each also as part of the wider networks that it is in.
#pragma once

#include "quota_levels.hpp"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace webots_cloud::core {

/// Counts by quota keys, on all of their levels. The empty key belongs to no client and is not counted.
class QuotaCounts
{
    struct Count
    {
        std::size_t held = 0;
        bool told = false;
    };
    using Counts = std::unordered_map<std::string, Count, QuotaKeyHash, std::equal_to<>>;

public:
    void add(std::string_view key, std::size_t size = 1)
    {
        if (size == 0)
            return;
        for (auto const& level : QuotaLevels(key)) {
            auto found = counts_.find(level.key);
            if (found == counts_.end())
                found = counts_.try_emplace(std::string(level.key)).first;
            found->second.held += size;
        }
    }

    /// What was added before.
    void remove(std::string_view key, std::size_t size = 1)
    {
        for (auto const& level : QuotaLevels(key)) {
            auto const found = counts_.find(level.key);
            if (found != counts_.end() && (found->second.held -= size) == 0)
                counts_.erase(found);
        }
    }

    /// A level that may have no more.
    struct Full
    {
        std::string key;     ///< Of the client, or the name of a wider network.
        std::size_t allowed; ///< How much it may have.
        bool is_news;        ///< It has not been found full since it had nothing.
    };

    /// The first level that may not have `size` more, where one client may have `of_client` of `all`.
    std::optional<Full> full_level(std::string_view key, std::size_t size, std::size_t of_client,
                                   std::size_t all)
    {
        for (auto const& level : QuotaLevels(key)) {
            auto const allowed = allowance(of_client, level.factor, all);
            auto const found = counts_.find(level.key);
            bool const has_any = found != counts_.end();
            if ((has_any ? found->second.held : 0) + size > allowed)
                return Full{std::string(level.key), allowed,
                            !has_any || !std::exchange(found->second.told, true)};
        }
        return std::nullopt;
    }

    /// How much the client counts for: what it has itself, or its share of what a wider network has, if that
    /// is more.
    std::size_t of(std::string_view key) const
    {
        std::size_t most = 0;
        for (auto const& level : QuotaLevels(key))
            if (auto const found = counts_.find(level.key); found != counts_.end())
                most = std::max(most, found->second.held / level.factor);
        return most;
    }

    bool has_any(std::string_view key) const { return counts_.find(key) != counts_.end(); }

    /// Clients and networks that have something.
    std::size_t size() const noexcept { return counts_.size(); }

private:
    Counts counts_;
};

} // namespace webots_cloud::core
