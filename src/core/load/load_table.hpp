// What is known of the simulation servers by their polls (protocol section 3), and what one poll changes.
#pragma once

#include <webots_cloud/server_load.hpp>

#include <list>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

namespace webots_cloud::core {

/// What changed with this poll, given what was known before.
///
/// A server that was never polled successfully counts as neither up nor down: its first failure is news, its
/// first answer is not.
LoadTransition classify(ServerLoad const& before, result<LoadReport> const& outcome,
                        double threshold) noexcept;

/// The line of the log about what an event has changed.
std::string line_of(LoadEvent const& event);

/// The one place where the outcomes of polls are kept: pages, totals and logs look at it.
///
/// The Scheduler keeps the last report of each server, too: it compares the next one with it, when this table
/// has been overwritten already, and it can be used without polls.
class LoadTable
{
public:
    /// A server of the list: a new one is added, and nothing is known of it. It stands in front of the one
    /// `before`, or at the end where that is not in the list. By default new ones come to the end, and known
    /// ones stay where they are. Returns whether it is new.
    bool put(std::string_view address, std::optional<std::string_view> before = std::nullopt);

    /// It is forgotten. Those that are not listed are ignored.
    void remove(std::string_view address);

    /// Takes in a poll's outcome.
    /// Precondition: the server is in the list.
    LoadEvent record(std::string_view address, result<LoadReport> const& outcome, double threshold,
                     TimePoint now);

    /// Each is where it is until it is removed.
    std::list<ServerLoad> const& servers() const noexcept { return servers_; }

    /// Null: it is not in the list.
    ServerLoad const* find(std::string_view address) const;

    LoadTotals totals() const noexcept;

private:
    std::list<ServerLoad> servers_;
    /// Views into `servers_`.
    std::unordered_map<std::string_view, std::list<ServerLoad>::iterator> by_address_;
};

} // namespace webots_cloud::core
