// Embeds the scheduler alone: links webots_cloud::core and nothing else.
//
// A Scheduler needs no thread, no network and no clock: tell it what the machines report and what time it is,
// and ask it where the next session goes.
#include <webots_cloud/scheduler.hpp>

#include <iostream>

int main()
{
    using namespace webots_cloud;

    Scheduler scheduler;
    scheduler.set_servers({ServerSpec("sim1.example.org:2000"), ServerSpec("sim2.example.org:2000")});

    TimePoint const now = std::chrono::steady_clock::now();
    scheduler.report("sim1.example.org:2000", LoadReport(40), now); // percent, as GET /load answered
    scheduler.report("sim2.example.org:2000", LoadReport(10), now);

    for (int browser = 1; browser <= 5; ++browser)
        if (auto const placement = scheduler.place(now)) // fails when no machine is offered
            std::cout << "browser " << browser << ": " << placement->address << '\n';
}
