// A scheduler of a few idle machines, for the tests of its rules.
#pragma once

#include "unit_test.hpp"

#include <webots_cloud/scheduler.hpp>

#include <map>
#include <string>
#include <vector>

namespace webots_cloud::placement_test {

inline TimePoint const start = TimePoint(std::chrono::hours(1));

inline LoadReport counted(double load, int sessions, int starting = 0)
{
    LoadReport report(load);
    report.sessions = sessions;
    report.starting = starting;
    return report;
}

inline std::vector<ServerSpec> named(std::initializer_list<char const*> names)
{
    std::vector<ServerSpec> specs;
    for (char const* const name : names)
        specs.emplace_back(name);
    return specs;
}

/// A scheduler of the machines a, b and c, or fewer, all idle.
struct Fixture
{
    explicit Fixture(SchedulerParams params = {}, std::initializer_list<char const*> names = {"a", "b", "c"})
        : scheduler(Scheduler::make(std::move(params)).value())
    {
        scheduler.set_servers(named(names));
        for (char const* const name : names)
            scheduler.report(name, counted(0, 0), start);
    }

    Candidate machine(std::string_view name, TimePoint now = start)
    {
        for (Candidate const& candidate : scheduler.machines(now))
            if (candidate.address == name)
                return candidate;
        BOOST_FAIL("no machine " << name);
        return {};
    }
    std::map<std::string, int> place(int sessions, TimePoint now = start)
    {
        std::map<std::string, int> placed;
        for (int session = 0; session != sessions; ++session)
            ++placed[std::string(scheduler.place(now).value().address)];
        return placed;
    }

    Scheduler scheduler;
};

struct OneMachine : Fixture
{
    explicit OneMachine(SchedulerParams params = {}) : Fixture(std::move(params), {"a"}) {}

    /// A minute without sessions, and one with four that cost 12 % each. Returns the time of the last report
    /// of that.
    TimePoint teach_cost()
    {
        TimePoint now = start;
        for (int const sessions : {0, 4})
            for (int seen = 0; seen != 12; ++seen)
                scheduler.report("a", counted(12 * sessions, sessions), now += std::chrono::seconds(5));
        return now;
    }
};

} // namespace webots_cloud::placement_test
