// A site whose seats are all taken, in virtual time: who comes, who waits in the real WaitingRoom, who is
// served when.
#pragma once

#include "core/waiting/waiting_room.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace simulation {

/// Browsers behind one address.
struct Crowd
{
    std::string group;
    std::size_t browsers = 1;
    double begins = 0; ///< When the first comes; seconds, as all times here.
    double within = 0; ///< How long it takes until all have come.
    /// Whoever's session has ended, or who was refused, comes again after so long; 0: never.
    double again_after = 0;
};

struct Site
{
    std::size_t seats = 50;
    double session = 600;        ///< Mean length, exponential.
    double singles = 0.9 / 12.0; ///< So many a second come alone, each from an address of its own; Poisson.
    std::vector<Crowd> crowds;
    double warm_up = 3600;
    double lasts = 3 * 3600; ///< After the warm-up.
    webots_cloud::core::WaitingRoomParams room;
    std::uint64_t seed = 1;
};

struct Visit
{
    std::string group;    ///< Empty: a single.
    std::size_t seat = 1; ///< It is the first, second ... that its group has or waits for.
    double arrived = 0;
    double rank = 0;
    double served = 0;
};

/// What happened after the warm-up.
struct Day
{
    std::vector<Visit> visits; ///< Those that were served, in the order in which they were.
    std::size_t refused = 0;   ///< Singles, since the room was full.
    std::size_t crowd_refused = 0;
    std::map<std::string, double> seat_time; ///< Of each crowd.
};

Day simulate(Site const& site);

/// The waits of a group; empty: of singles.
std::vector<double> waits(Day const& day, std::string const& group);

/// By how much later somebody came than somebody whom he overtook, at most.
double longest_lead(Day const& day);

/// (sum x)² / (n · sum x²): 1 when all have the same, 1 / n when one has everything (Jain, Chiu, Hawe 1984).
double jain_index(std::vector<double> const& shares);

double quantile(std::vector<double> values, double share);

} // namespace simulation
