// A session server that relays, and asks machines before it places.
#pragma once

#include "randomness.hpp"

#include <webots_cloud/scheduler.hpp>

#include <chrono>
#include <string_view>

namespace simulation {

/// How browsers reach their machines, and what the session server does before.
enum class Way
{
    direct,  ///< They travel there by themselves, for a second.
    relayed, ///< The session server connects to the machine at once.
    asked    ///< The same, and it asks the best machines for a report before it chooses one.
};

inline constexpr double shortest_round_trip = 0.001; // s, between a session server and a machine
inline constexpr double longest_round_trip = 0.010;
inline constexpr double current_report = 0.1; // s: how old a report may be that counts as one of this moment
inline constexpr int rounds = 2;              // of questions

/// When who is placed now arrives: after the handshakes of TCP and of the WebSocket.
inline double relayed_at(double now, Randomness& random)
{
    return now + 2 * random.uniform(shortest_round_trip, longest_round_trip);
}

/// Asks the machines that are worth it; `answer(machine, asked_at, heard_at)` has the scheduler hear their
/// reports. Returns the moment of the placement, for which `request` is prepared.
template<class Answer>
double ask_machines(webots_cloud::Scheduler& scheduler, webots_cloud::PlacementRequest& request, double now,
                    Randomness& random, webots_cloud::TimePoint (*at)(double), Answer const& answer)
{
    request.current_since = at(now - current_report);
    for (int round = 0; round != rounds; ++round) {
        auto const machines = scheduler.worth_asking(request, at(now));
        if (machines.empty())
            break;
        double const round_trip = random.uniform(shortest_round_trip, longest_round_trip);
        for (std::string_view const machine : machines)
            answer(machine, now + round_trip / 2, now + round_trip);
        now += round_trip;
    }
    return now;
}

} // namespace simulation
