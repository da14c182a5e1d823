// The textbook model of load balancing: Poisson arrivals, exponential service, a queue at every server.
#pragma once

#include <webots_cloud/scheduler.hpp>

#include <cstdint>
#include <string>

namespace simulation {

struct QueueModel
{
    QueueModel() = default;

    std::size_t servers = 100;
    double arrival_rate = 0.9; ///< Per server; the mean service time is the unit of time.
    double report_age = 0;     ///< Every so long all queue lengths are reported at once; 0: always known.
    std::string policy = "least_committed";
    webots_cloud::SchedulingPolicy custom;
    std::uint64_t warm_up = 200'000; ///< Arrivals not measured.
    std::uint64_t arrivals = 2'000'000;
    std::uint64_t seed = 1;
};

/// The mean time from arrival to the end of service, in mean service times.
double mean_time_in_system(QueueModel const& model);

/// The same where every job joins the shortest queue, without the Scheduler: the optimum for fresh
/// information (Winston 1977). Only the number of servers and arrivals, the rate and the seed count.
double shortest_queue_time(QueueModel const& model);

/// The best of `choices` machines drawn without replacement, by what they reported.
webots_cloud::SchedulingPolicy best_of(std::size_t choices);

} // namespace simulation
