#include "chart.hpp"
#include "classroom.hpp"
#include "experiments.hpp"
#include "table.hpp"

#include <algorithm>
#include <fstream>

namespace simulation {

namespace {

constexpr std::uint64_t seeds = 400;

void print_figures(Output& output, std::string const& what, Classroom const& room)
{
    ClassroomFigures const figures = average_classroom(room, seeds);
    print_row(output.tables,
              {what, decimals(figures.worst, 2), decimals(figures.crammed, 2), decimals(figures.refused, 2)});
}

/// Sessions on the fullest machine, the second fullest and so on, mean over all seeds.
std::vector<double> by_rank(Classroom const& room)
{
    std::vector<double> mean(room.machines);
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        std::vector<int> machines = seat(room, seed).per_machine;
        std::ranges::sort(machines, std::greater<>());
        for (std::size_t rank = 0; rank != machines.size(); ++rank)
            mean[rank] += static_cast<double>(machines[rank]) / static_cast<double>(seeds);
    }
    return mean;
}

void draw(Output& output)
{
    Chart chart;
    chart.title = "A class of 60 clicks within a minute: where the students sit";
    chart.x_label = "machines, fullest first (mean of 400 classes)";
    chart.y_label = "students";
    for (int rank = 1; rank <= 10; ++rank)
        chart.categories.push_back(std::to_string(rank));
    chart.limit = 8;
    chart.limit_name = "8 seats";
    for (char const* const policy : {"least_reported", "least_committed"}) {
        Classroom room;
        room.policy = policy;
        chart.series.push_back({policy, by_rank(room)});
    }
    std::ranges::reverse(chart.series);
    std::ofstream(*output.images / "classroom.svg") << to_svg(chart);
}

} // namespace

void classroom(Output& output)
{
    Row const heading = {"", "on the worst machine", "on an over-full machine", "refused"};
    for (bool const counted : {true, false}) {
        output.tables << "\nClassroom, machines that report "
                      << (counted ? "`sessions` and `starting`" : "a bare number") << ", seeds 1 to 400:\n\n";
        print_heading(output.tables, heading);
        for (char const* const policy : {"least_reported", "random", "power_of_two", "least_committed"}) {
            Classroom room;
            room.counted = counted;
            room.policy = policy;
            print_figures(output, policy, room);
        }
        for (double const assumed : {3.0, 6.0, 24.0}) {
            Classroom room;
            room.counted = counted;
            room.assumed_cost = assumed;
            print_figures(
                output, "least_committed, session_cost " + decimals(assumed, 0) + " % instead of 12 %", room);
        }
        for (int const capacity : {100, 8}) {
            Classroom room;
            room.capacity = capacity;
            if (counted)
                print_figures(output, "least_committed, a capacity of " + std::to_string(capacity), room);
        }
        for (bool const arrivals : {false, true}) {
            Classroom room;
            room.counted = counted;
            room.arrivals = arrivals;
            if (arrivals && counted)
                print_figures(output, "least_committed, arrivals counted", room);
            room.unclaimed = 330;
            if (!arrivals || counted)
                print_figures(output,
                              std::string("least_committed, ") + (arrivals ? "arrivals counted, " : "") +
                                  "after 330 requests that nobody claimed",
                              room);
        }
        Classroom room;
        room.counted = counted;
        room.session_servers = 5;
        print_figures(output, "least_committed, five session servers", room);
        room.custom = [](webots_cloud::PlacementSnapshot const& machines, webots_cloud::RandomSource&) {
            return machines.least_committed();
        };
        print_figures(output, "the same without spreading over the water level", room);
        room.custom = {};
        room.arrivals = true;
        if (counted)
            print_figures(output, "least_committed, five session servers, arrivals counted", room);
        for (double const interval : {1.0, 0.1}) {
            room.report_every = interval;
            if (counted)
                print_figures(output, "the same, reports every " + decimals(interval, 1) + " s", room);
        }
        room.report_every = Classroom().report_every;
        room.way = Way::relayed;
        print_figures(output, "least_committed, five session servers, relayed", room);
        room.way = Way::asked;
        print_figures(output, "least_committed, five session servers, asked before placing", room);
        room.students = 120;
        room.machines = 20;
        print_figures(output, "the same, 120 students, 20 machines", room);
    }
    if (output.images)
        draw(output);
}

} // namespace simulation
