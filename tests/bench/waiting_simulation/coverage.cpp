#include "coverage.hpp"

#include "randomness.hpp"
#include "site.hpp"

#include "core/waiting/wait_estimate.hpp"

#include <algorithm>
#include <chrono>
#include <queue>
#include <stdexcept>
#include <vector>

namespace simulation {
namespace {

using webots_cloud::Duration;
using webots_cloud::TimePoint;
using webots_cloud::core::WaitEstimate;
using webots_cloud::core::WaitRange;

TimePoint moment(double seconds)
{
    return TimePoint(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds)));
}

bool is_in(WaitRange const& range, Duration wait)
{
    return range.least <= wait && wait <= range.most;
}

} // namespace

Coverage coverage(Sessions const& sessions)
{
    Randomness random(sessions.seed);
    Coverage counts;
    std::vector<double> ratios;
    for (std::size_t trial = 0; trial != sessions.trials; ++trial) {
        WaitEstimate estimate;
        std::vector<double> begins;
        for (std::size_t seat = 0; seat != sessions.seats; ++seat)
            begins.push_back(random.uniform(0, sessions.begin_within));
        std::sort(begins.begin(), begins.end());
        std::priority_queue<double, std::vector<double>, std::greater<>> ends;
        for (double const begin : begins) {
            estimate.session_began(moment(begin));
            ends.push(begin + sessions.length(random));
        }
        double now = 0;
        auto const next_departure = [&] {
            now = ends.top();
            ends.pop();
            ends.push(now + sessions.length(random));
        };
        auto const see_departure = [&] {
            next_departure();
            estimate.session_ended(moment(now));
            estimate.session_began(moment(now));
        };
        for (std::size_t seen = 0; seen != sessions.departures; ++seen)
            see_departure();
        double const asked = now + random.uniform(0, sessions.asked_within);
        while (ends.top() < asked)
            see_departure();
        auto const range = estimate.expect(sessions.ahead, moment(asked));
        if (!range)
            throw std::runtime_error("nobody is told anything: this measures nothing");
        for (std::size_t gone = 0; gone <= sessions.ahead; ++gone)
            next_departure();
        auto const wait = moment(now) - moment(asked);
        counts.within += is_in(*range, wait) ? 1 : 0;
        counts.shorter += wait < range->least ? 1 : 0;
        counts.longer += wait > range->most ? 1 : 0;
        counts.within_rounded += is_in(webots_cloud::core::rounded(*range), wait) ? 1 : 0;
        ratios.push_back(std::chrono::duration<double>(range->most) /
                         std::chrono::duration<double>(range->least));
    }
    double const percent = 100 / static_cast<double>(sessions.trials);
    return {counts.within * percent, counts.shorter * percent, counts.longer * percent,
            counts.within_rounded * percent, quantile(std::move(ratios), 0.5)};
}

} // namespace simulation
