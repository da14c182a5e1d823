// Remembers facts about git servers between fetches.
#pragma once

#include "git_client.hpp"

#include <webots_cloud/transport/clock.hpp>

#include <chrono>
#include <cstddef>
#include <mutex>
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
        constexpr std::size_t most = 10'000; // anybody can ask for names that do not exist
        std::lock_guard const lock(mutex_);
        if (missing_.size() >= most)
            missing_.clear();
        missing_[url] = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    }

    /// The capabilities of a forge: all of them, until a request has failed. That is forgotten after an hour.
    GitCapabilities capabilities(std::string const& forge)
    {
        std::lock_guard const lock(mutex_);
        auto const found = known_.find(forge);
        return is_valid(found) ? found->second.capabilities : GitCapabilities();
    }

    void set_capabilities(std::string const& forge, GitCapabilities capabilities)
    {
        std::lock_guard const lock(mutex_);
        known_[forge] = {capabilities, std::chrono::steady_clock::now() + std::chrono::hours(1)};
    }

    bool knows(std::string const& forge)
    {
        std::lock_guard const lock(mutex_);
        return is_valid(known_.find(forge));
    }

private:
    struct Known
    {
        GitCapabilities capabilities;
        TimePoint until;
    };
    using KnownByForge = std::unordered_map<std::string, Known>;

    bool is_valid(KnownByForge::const_iterator found) const
    {
        return found != known_.end() && std::chrono::steady_clock::now() < found->second.until;
    }

    std::mutex mutex_;
    std::unordered_map<std::string, TimePoint> missing_;
    KnownByForge known_;
};

} // namespace webots_cloud::adapters
