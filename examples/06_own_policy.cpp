// A scheduling policy of your own, and the reasons of a decision.
#include <webots_cloud/scheduler.hpp>

#include <iostream>

using namespace webots_cloud;

// [policy]
/// Fills one machine after the other, so that empty ones can be switched off: of those that have room, the
/// fullest.
std::size_t fill_up(PlacementSnapshot const& machines, RandomSource&)
{
    std::size_t fullest = 0;
    for (std::size_t position = 1; position != machines.size(); ++position)
        if (machines[position].committed > machines[fullest].committed)
            fullest = position;
    return fullest;
}
// [policy]

int main()
{
    SchedulerParams params;
    params.policy = "fill_up";
    params.custom = fill_up;
    auto scheduler = Scheduler::make(params).value();
    scheduler.set_servers({ServerSpec("sim1:2000"), ServerSpec("sim2:2000")});

    TimePoint const now = std::chrono::steady_clock::now();
    scheduler.report("sim1:2000", LoadReport(40), now);
    scheduler.report("sim2:2000", LoadReport(10), now);
    for (int browser = 1; browser <= 6; ++browser)
        if (auto const placement = scheduler.place(now); placement.has_error())
            std::cout << placement.error().detail() << '\n';

    for (Decision const& decision : scheduler.decisions()) {
        std::cout << "decision " << decision.id << ": " << decision.chosen << " because";
        for (Decision::Entry const& entry : decision.machines)
            std::cout << ' ' << entry.address << " is at " << entry.machine.committed << " % ("
                      << to_string(entry.machine.refusal) << ')';
        std::cout << "; decided again: " << scheduler.replay(decision).value() << '\n';
    }
}
