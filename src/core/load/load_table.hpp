// What is known of the simulation servers by their polls (protocol section 3), and what one poll changes.
#pragma once

#include <webots_cloud/server_load.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

namespace webots_cloud::core {

/// What changed with this poll, given what was known before.
///
/// A server that was never polled successfully counts as neither up nor down: its first failure is news, its
/// first answer is not.
LoadTransition classify(ServerLoad const& before, result<LoadReport> const& outcome,
                        double threshold) noexcept;

/// The one place where the outcomes of polls are kept: pages, totals and logs look at it.
///
/// The Scheduler keeps the last report of each server, too: it compares the next one with it, when this table
/// has been overwritten already, and it can be used without polls.
class LoadTable
{
public:
    /// The servers from now on, in this order: what is known of those that stay is kept. Of equal addresses
    /// the first counts.
    void set_servers(std::vector<std::string> const& addresses);

    /// Takes in a poll's outcome.
    /// Precondition: the server is in the list.
    LoadEvent record(std::string const& address, result<LoadReport> const& outcome, double threshold,
                     TimePoint now);

    /// Valid until the next `set_servers`.
    std::span<ServerLoad const> servers() const noexcept { return servers_; }

    LoadTotals totals() const noexcept;

private:
    std::vector<ServerLoad> servers_;
    std::unordered_map<std::string, std::size_t> positions_; ///< In `servers_`.
};

} // namespace webots_cloud::core
