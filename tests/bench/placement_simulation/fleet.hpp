// A weekday of a site that adds and removes machines by itself: lessons, self-study and a quiet night,
// several session servers, and a line for those who find no seat.
#pragma once

#include <cstddef>
#include <cstdint>

namespace simulation {

/// Which machine goes when there are too many. It takes nobody any more, and goes when its last session ends.
enum class Removal
{
    emptiest, ///< With the fewest sessions.
    newest    ///< As a Deployment of Kubernetes does, as a rule.
};

struct Fleet
{
    Fleet() = default;

    std::size_t max_machines = 10'000;
    std::size_t min_machines = 100;
    bool is_fixed = false;       ///< Always `max_machines`.
    int seats = 8;               ///< Of each machine.
    double seat_load = 10;       ///< Percent of a machine that an average session takes.
    double cost_spread = 0.5;    ///< Log-normal sigma of what sessions take.
    double browsers = 1'000'000; ///< In the day.
    double duration = 1200;      ///< s, exponential mean.
    double in_lessons =
        0.5; ///< The part of browsers that comes in classes of 30, within 2 min after the hour.
    std::size_t session_servers = 3;
    double report_every = 10;     ///< s.
    std::size_t line = 10'000;    ///< Places, at each session server.
    double reserve = 0.15;        ///< Free seats that are kept, as a part of those taken.
    double decide_every = 15;     ///< s between two decisions to add or to remove.
    double boot = 90;             ///< s from that decision to the first report.
    double discovery = 15;        ///< s until session servers know a new machine: the TTL of its name.
    double calm = 300;            ///< s without any want of machines before one is removed.
    bool knows_timetable = false; ///< Seats for lessons are free 5 min before the hour.
    Removal removal = Removal::emptiest;
};

struct FleetFigures
{
    double browsers = 0;
    double waited = 0;       ///< Percent of browsers: had to wait.
    double mean_wait = 0;    ///< s, of those.
    double late_wait = 0;    ///< s, of all browsers: the 99.9th percentile.
    double longest_wait = 0; ///< s.
    double refused = 0;      ///< Percent of browsers: the line was full.
    double crammed = 0; ///< Percent of users' time: on a machine whose sessions want more than all of it.
    double machine_hours = 0;
    /// Of somebody who knows the future: as many machines as their sessions fill, at each moment.
    double perfect_machine_hours = 0;
    std::size_t most_machines = 0;
    std::size_t most_sessions = 0;
};
FleetFigures simulate_fleet(Fleet const& fleet, std::uint64_t seed);

} // namespace simulation
