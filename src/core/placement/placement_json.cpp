// Decisions as operators read them at GET /api/decisions.
#include <webots_cloud/scheduler.hpp>

#include <boost/json.hpp>

#include <algorithm>
#include <cmath>

namespace webots_cloud {

namespace json = boost::json;

std::string_view to_string(Refusal reason) noexcept
{
    static constexpr std::array<std::string_view, refusal_count> names = {
        "none",   "unknown", "lost",      "stale",  "draining", "full",
        "memory", "load",    "committed", "labels", "excluded", "room"};
    return names[static_cast<std::size_t>(reason)];
}

namespace {

/// Two decimals are what a reader can use.
double rounded(double number)
{
    return std::round(number * 100) / 100;
}

json::object machine_json(Decision::Entry const& entry)
{
    json::object object;
    object["server"] = entry.address;
    if (entry.machine.refusal != Refusal::none)
        object["refused"] = to_string(entry.machine.refusal);
    if (entry.machine.overcommitted)
        object["overcommitted"] = true;
    if (entry.machine.warm)
        object["warm"] = true;
    object["load"] = rounded(entry.machine.load);
    object["committed"] = rounded(entry.machine.committed);
    object["score"] = rounded(entry.machine.score);
    object["cost"] = rounded(entry.machine.cost);
    object["weight"] = entry.machine.weight;
    object["sessions"] = entry.machine.sessions;
    object["pending"] = entry.machine.pending;
    return object;
}

json::object refused_json(Decision const& decision)
{
    json::object counts;
    for (std::size_t reason = 1; reason != refusal_count; ++reason)
        if (decision.refused[reason] != 0)
            counts[to_string(static_cast<Refusal>(reason))] = decision.refused[reason];
    return counts;
}

json::object decision_json(Decision const& decision, TimePoint now)
{
    json::object object;
    object["decision"] = decision.id;
    object["secondsAgo"] = rounded(std::chrono::duration<double>(now - decision.at).count());
    object["policy"] = decision.policy;
    object["chosen"] = decision.chosen.empty() ? json::value(nullptr) : json::value(decision.chosen);
    // A number of 64 bits does not survive a JSON reader that knows only doubles.
    object["random"] = std::to_string(decision.random);
    object["unseenArrivals"] = rounded(decision.unseen_arrivals);
    object["offered"] = decision.offered;
    object["refused"] = refused_json(decision);
    if (decision.expected_cost)
        object["expectedCost"] = rounded(*decision.expected_cost);
    if (decision.held != 0) {
        object["held"] = decision.held;
        object["freeSeats"] = decision.free_seats;
    }
    object["complete"] = decision.complete;
    json::array machines;
    for (Decision::Entry const& entry : decision.machines)
        machines.push_back(machine_json(entry));
    object["machines"] = std::move(machines);
    return object;
}

} // namespace

std::string decisions_json(Scheduler const& scheduler, TimePoint now)
{
    std::vector<Decision> decisions = scheduler.decisions();
    std::ranges::reverse(decisions);
    json::array list;
    for (Decision const& decision : decisions)
        list.push_back(decision_json(decision, now));
    return json::serialize(json::object{{"decisions", std::move(list)}});
}

} // namespace webots_cloud
