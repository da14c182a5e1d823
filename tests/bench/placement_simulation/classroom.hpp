// A class of students that clicks within a minute.
#pragma once

#include "asking.hpp"

#include <webots_cloud/scheduler.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace simulation {

struct Classroom
{
    Classroom() = default;

    std::size_t machines = 10;
    int seats = 8;
    int students = 60;
    double minute = 60;        ///< s in which they click, at random.
    double session_load = 12;  ///< Percent.
    double max_base_load = 10; ///< Percent; each machine has its own, from 0.
    Way way = Way::direct;
    double travel = 1;               ///< s from our answer to the browser's arrival at the machine.
    double visible_after = 20;       ///< s from our answer until the load shows the session.
    double report_every = 5;         ///< s, each machine with its own phase.
    int samples = 5;                 ///< A report is the mean of so many, one a second.
    double noise = 2;                ///< Percent, of one sample, either way.
    double threshold = 95;           ///< Percent.
    bool counted = true;             ///< Machines report `sessions` and `starting`, not only a number.
    bool arrivals = false;           ///< Machines that do count arrivals, too.
    int capacity = 0;                ///< What machines that do report as theirs; 0: nothing.
    int staged = 0;                  ///< Each machine has so many of the class's world ready.
    int unclaimed = 0;               ///< Requests in the minute before, of which nobody comes.
    std::size_t session_servers = 1; ///< That share the machines without talking to each other.
    std::string policy = "least_committed";
    webots_cloud::SchedulingPolicy custom;
    double assumed_cost = 12; ///< Percent: SchedulerParams::session_cost.
};

/// How the students sat when all had clicked.
struct Seating
{
    std::vector<int> per_machine;
    int refused = 0; ///< Students who were told that no server is available.
    int ready = 0;   ///< Students whose simulation was ready before they asked.
};
Seating seat(Classroom const& room, std::uint64_t seed);

/// Means over seeds 1 to `seeds`.
struct ClassroomFigures
{
    double worst = 0;   ///< Sessions on the fullest machine.
    double crammed = 0; ///< Students on a machine with more sessions than seats.
    double refused = 0;
    double ready = 0;
};
ClassroomFigures average_classroom(Classroom const& room, std::uint64_t seeds);

} // namespace simulation
