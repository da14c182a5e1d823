#include "load_table.hpp"

#include "core/text.hpp"

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

std::string line_of(LoadEvent const& event)
{
    auto const& server = event.server;
    auto const load = concat(python_float(server.report.load), "%");
    switch (event.transition) {
    case LoadTransition::not_responding:
        return concat(server.address,
                      " simulation server is not responding (assuming 100% load): ", server.problem);
    case LoadTransition::too_slow:
        return concat(server.address,
                      " simulation server is taking too long to respond (assuming 100% load)");
    case LoadTransition::working_again:
        return concat(server.address, " simulation server is up and running again (load = ", load, ")");
    case LoadTransition::reached_maximum:
        return concat(server.address, " simulation server has reached maximum load (", load, ")");
    case LoadTransition::available_again:
        return concat(server.address, " simulation server is available again (load = ", load, ")");
    case LoadTransition::none:
        break;
    }
    return {};
}

bool LoadTable::put(std::string_view address, std::optional<std::string_view> before)
{
    auto const next = before ? by_address_.find(*before) : by_address_.end();
    auto const place = next == by_address_.end() ? servers_.end() : next->second;
    if (auto const known = by_address_.find(address); known != by_address_.end()) {
        if (before)
            servers_.splice(place, servers_, known->second);
        return false;
    }
    auto const added = servers_.emplace(place, std::string(address));
    by_address_.emplace(added->address, added);
    return true;
}

void LoadTable::remove(std::string_view address)
{
    auto const found = by_address_.find(address);
    if (found == by_address_.end())
        return;
    auto const server = found->second;
    by_address_.erase(found);
    servers_.erase(server);
}

ServerLoad const* LoadTable::find(std::string_view address) const
{
    auto const found = by_address_.find(address);
    return found == by_address_.end() ? nullptr : &*found->second;
}

LoadEvent LoadTable::record(std::string_view address, result<LoadReport> const& outcome, double threshold,
                            TimePoint now)
{
    auto& known = *by_address_.at(address);
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
