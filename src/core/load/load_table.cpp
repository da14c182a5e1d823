#include "load_table.hpp"

#include <utility>

namespace webots_cloud::core {

LoadTransition classify(ServerLoad const& before, result<LoadReport> const& outcome,
                        double threshold) noexcept
{
    bool const was_down = before.state == ServerState::down;
    if (!outcome) {
        if (was_down)
            return LoadTransition::none;
        return outcome.error() == errc::timed_out ? LoadTransition::too_slow : LoadTransition::not_responding;
    }
    if (was_down)
        return LoadTransition::working_again;
    double const old_load = before.state == ServerState::up ? before.report.load : 0;
    bool const was_full = old_load >= threshold;
    bool const is_full = outcome->load >= threshold;
    if (is_full && !was_full)
        return LoadTransition::reached_maximum;
    if (was_full && !is_full)
        return LoadTransition::available_again;
    return LoadTransition::none;
}

void LoadTable::set_servers(std::vector<std::string> const& addresses)
{
    std::vector<ServerLoad> servers;
    servers.reserve(addresses.size());
    std::unordered_map<std::string, std::size_t> positions;
    for (auto const& address : addresses) {
        if (!positions.emplace(address, servers.size()).second)
            continue;
        auto const known = positions_.find(address);
        servers.push_back(known == positions_.end() ? ServerLoad(address)
                                                    : std::move(servers_[known->second]));
    }
    servers_ = std::move(servers);
    positions_ = std::move(positions);
}

LoadEvent LoadTable::record(std::string const& address, result<LoadReport> const& outcome, double threshold,
                            TimePoint now)
{
    auto& known = servers_[positions_.at(address)];
    LoadEvent event;
    event.transition = classify(known, outcome, threshold);
    if (outcome) {
        known.state = ServerState::up;
        known.report = *outcome;
        known.reported = now;
        known.problem.clear();
    } else {
        auto problem = outcome.error().message();
        event.is_late = outcome.error() == errc::timed_out;
        event.is_repeated = known.state == ServerState::down && known.problem == problem;
        known.state = ServerState::down;
        known.problem = std::move(problem);
    }
    event.server = known;
    return event;
}

LoadTotals LoadTable::totals() const noexcept
{
    LoadTotals totals;
    for (auto const& server : servers_) {
        totals.up += server.state == ServerState::up ? 1 : 0;
        totals.down += server.state == ServerState::down ? 1 : 0;
        totals.unknown += server.state == ServerState::unknown ? 1 : 0;
        totals.load += server.state == ServerState::up ? server.report.load : 0;
    }
    return totals;
}

} // namespace webots_cloud::core
