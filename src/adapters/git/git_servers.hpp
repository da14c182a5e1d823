// Remembers facts about git servers between fetches.
#pragma once

#include "core/git/git_fetch_plan.hpp"

#include <webots_cloud/transport/clock.hpp>

#include <chrono>
#include <cstddef>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

namespace webots_cloud::adapters {

/// Thread-safety: any thread.
class GitServers
{
public:
    /// True when the repository did not exist less than a minute ago.
    bool is_missing(std::string const& url)
    {
        std::lock_guard const lock(mutex_);
        auto const found = missing_.find(url);
        return found != missing_.end() && std::chrono::steady_clock::now() < found->second;
    }

    void set_missing(std::string const& url)
    {
        constexpr std::size_t max = 10'000; // anybody can ask for names that do not exist
        std::lock_guard const lock(mutex_);
        if (missing_.size() >= max)
            missing_.clear();
        missing_[url] = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    }

    /// The capabilities of a forge. They are asked for after a request has failed, and forgotten after an
    /// hour.
    std::optional<core::GitCapabilities> capabilities(std::string const& forge)
    {
        std::lock_guard const lock(mutex_);
        auto const found = known_.find(forge);
        if (found == known_.end() || std::chrono::steady_clock::now() >= found->second.until)
            return std::nullopt;
        return found->second.capabilities;
    }

    void set_capabilities(std::string const& forge, core::GitCapabilities capabilities)
    {
        std::lock_guard const lock(mutex_);
        known_[forge] = {capabilities, std::chrono::steady_clock::now() + std::chrono::hours(1)};
    }

private:
    struct Known
    {
        core::GitCapabilities capabilities;
        TimePoint until;
    };

    std::mutex mutex_;
    std::unordered_map<std::string, TimePoint> missing_;
    std::unordered_map<std::string, Known> known_; ///< By forge.
};

} // namespace webots_cloud::adapters
