// A day of everything at once: unequal machines, unequal worlds, classes, no-shows, deaths, several session
// servers.
#pragma once

#include "asking.hpp"

#include <webots_cloud/scheduler.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace simulation {

/// What a machine says of itself.
enum class Peers
{
    bare,    ///< A number.
    counted, ///< A number, `sessions` and `starting`.
    seated,  ///< These and `capacity`.
    exact,   ///< Those without `capacity`, and the counters since they came up.
    worlds   ///< These, and what the sessions of each world use.
};

/// Who places: the real Scheduler, or somebody who knows what no scheduler can.
enum class Knowledge
{
    reports,     ///< The Scheduler.
    every_queue, ///< Every machine's load as it will be, at once; of the new session only the average cost.
    everything   ///< That, and the cost of the new session: the oracle.
};

struct Campus
{
    Campus() = default;

    std::vector<int> seats = {4, 4, 4, 4, 8, 8, 8, 8, 16, 16, 16, 16, 32, 32, 32, 32, 64, 64, 64, 64};
    double seat_load =
        12; ///< Percent of an 8-seat machine that an average session takes; others in proportion.
    double cost_spread = 0.998; ///< Log-normal sigma: 95 of 100 sessions lie within a factor of 50.
    int worlds = 300;           ///< Worlds differ; those of one repository are alike.
    int worlds_per_repository = 5;
    double same_world = 0.2;  ///< Log-normal sigma of the sessions of one world; a part of `cost_spread`.
    bool new_worlds = false;  ///< No session's world has been seen before.
    double duration = 600;    ///< s, exponential mean.
    double utilisation = 0.7; ///< Of all seats, on average.
    double in_classes = 0.5;  ///< The part of users that comes in classes.
    int class_size = 30;      ///< Who click within 30 s.
    double no_show = 0;       ///< The part of placements that never arrive.
    double mean_life = 0;     ///< s until a machine dies; 0: none does. It is back, empty, after `repair`.
    double repair = 300;      ///< s.
    std::size_t session_servers = 1;
    Way way = Way::direct;
    bool waiting_room = false;       ///< Who finds no free machine waits in line, instead of being refused.
    double wait_for_room = 90;       ///< s, at most, of sessions that would fill a machine; in the line.
    bool others_known = false;       ///< Schedulers have seen others place sessions before.
    std::size_t cached_projects = 0; ///< How many a machine's cache holds, those used last; 0: not looked at.
    bool reports_projects = false;   ///< Peers::worlds tell which.
    std::size_t staged_worlds = 0;   ///< Of the worlds started most often each machine has some ready:
    int staged_of_each = 2;          ///< so many.
    bool staged_show_late = false;   ///< What was ready shows in the load as late as what is started.
    Peers peers = Peers::counted;
    Knowledge knowledge = Knowledge::reports;
    std::string policy = "least_committed";
    webots_cloud::SchedulingPolicy custom;
    webots_cloud::SchedulerParams params; ///< `policy`, `custom` and `seed` are set from this struct.
    double warm_up = 1800;                ///< s, not measured.
    double length = 7200;                 ///< s, measured.
};

/// Percentages of users, and of users' time.
struct CampusFigures
{
    double crammed = 0;  ///< Of users' time: on a machine whose sessions want more than all of it.
    double slowdown = 0; ///< Mean over users' time: how much more than all of it they want; 1 is none.
    double refused = 0;  ///< Of users: told that no server is available.
    double waited = 0;   ///< Of users: placed only after a wait,
    double wait = 0;     ///< and for how long, in seconds, mean,
    double longest_wait = 0;
    double stranded = 0;   ///< Of users: sent to a machine that was dead already.
    double warm = 0;       ///< Of users placed: where their project was in the cache.
    double ready = 0;      ///< Of users placed: whose simulation was ready before.
    double unevenness = 0; ///< Percent: standard deviation of the load over machines, mean over time.
};
CampusFigures simulate_campus(Campus const& campus, std::uint64_t seed);
CampusFigures average_campus(Campus const& campus, std::uint64_t seeds);

} // namespace simulation
