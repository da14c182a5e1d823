#include "load_table.hpp"

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

void add(LoadTotals& totals, ServerLoad const& server) noexcept
{
    switch (server.state) {
    case ServerState::up:
        ++totals.up;
        totals.load += server.report.load;
        break;
    case ServerState::down:
        ++totals.down;
        break;
    case ServerState::unknown:
        ++totals.unknown;
        break;
    }
}

void apply(ServerLoad& known, result<LoadReport> const& outcome, TimePoint now)
{
    if (outcome) {
        known.state = ServerState::up;
        known.report = *outcome;
        known.reported = now;
        known.problem.clear();
    } else {
        known.state = ServerState::down;
        known.problem = outcome.error().message();
    }
}

} // namespace webots_cloud::core
