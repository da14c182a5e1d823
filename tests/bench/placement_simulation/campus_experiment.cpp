#include "campus.hpp"
#include "chart.hpp"
#include "experiments.hpp"
#include "table.hpp"

#include <fstream>

namespace simulation {

namespace {

struct Scenario
{
    std::string name;
    Campus campus;
};

std::vector<Scenario> scenarios()
{
    std::vector<Scenario> all(4);
    all[0].name = "unequal";
    all[1].name = "no-shows";
    all[1].campus.no_show = 0.3;
    all[2].name = "deaths";
    all[2].campus.mean_life = 3600;
    all[3].name = "five session servers";
    all[3].campus.session_servers = 5;
    return all;
}

double const usual_threshold = webots_cloud::SchedulerParams().threshold;

enum class Line
{
    none,    ///< Who finds no free machine is refused.
    fifo,    ///< They wait.
    for_room ///< So do those for whom no free machine has room, for a while; others pass them.
};

struct Contestant
{
    std::string name;
    Knowledge knowledge = Knowledge::reports;
    std::string policy = "least_committed";
    Peers peers = Peers::counted;
    bool new_worlds = false;
    Way way = Way::direct;
    double threshold = usual_threshold;
    Line line = Line::none;
};

std::vector<Contestant> contestants()
{
    return {
        {"oracle", Knowledge::everything},
        {"oracle, refuses at 101 %", Knowledge::everything, "least_committed", Peers::exact, false,
         Way::direct, 101},
        {"oracle without costs", Knowledge::every_queue},
        {"least_committed, with capacity", Knowledge::reports, "least_committed", Peers::seated},
        {"least_committed, worlds reported", Knowledge::reports, "least_committed", Peers::worlds},
        {"the same, relayed", Knowledge::reports, "least_committed", Peers::worlds, false, Way::relayed},
        {"the same, asked before placing", Knowledge::reports, "least_committed", Peers::worlds, false,
         Way::asked},
        {"relayed, waiting room", Knowledge::reports, "least_committed", Peers::worlds, false, Way::relayed,
         usual_threshold, Line::fifo},
        {"the same, heavy worlds wait", Knowledge::reports, "least_committed", Peers::worlds, false,
         Way::relayed, usual_threshold, Line::for_room},
        {"the same, asked before placing", Knowledge::reports, "least_committed", Peers::worlds, false,
         Way::asked, usual_threshold, Line::for_room},
        {"worlds reported, no world seen before", Knowledge::reports, "least_committed", Peers::worlds, true},
        {"least_committed, arrivals counted", Knowledge::reports, "least_committed", Peers::exact},
        {"least_committed", Knowledge::reports},
        {"least_committed, bare numbers", Knowledge::reports, "least_committed", Peers::bare},
        {"power_of_two", Knowledge::reports, "power_of_two"},
        {"random", Knowledge::reports, "random"},
        {"least_reported", Knowledge::reports, "least_reported"}};
}

/// The contestant's day.
Campus prepare(Scenario const& scenario, Contestant const& contestant)
{
    Campus campus = scenario.campus;
    campus.knowledge = contestant.knowledge;
    campus.policy = contestant.policy;
    campus.peers = contestant.peers;
    campus.new_worlds = contestant.new_worlds;
    campus.way = contestant.way;
    campus.waiting_room = contestant.line != Line::none;
    if (contestant.line != Line::for_room)
        campus.wait_for_room = 0;
    campus.others_known = contestant.way == Way::asked;
    campus.params.threshold = contestant.threshold;
    return campus;
}

} // namespace

void campus(Output& output)
{
    Chart chart;
    chart.title = "Unequal worlds and machines: users' time on an over-full machine";
    chart.y_label = "percent of users' time";
    for (Contestant const& contestant : contestants())
        if (contestant.peers == Peers::counted)
            chart.series.push_back({contestant.name, {}});
    for (Scenario const& scenario : scenarios()) {
        output.tables << "\nCampus, " << scenario.name << ", seeds 1 to " << output.seeds << ":\n\n";
        print_heading(output.tables, {"", "time crammed %", "slowdown", "refused %", "stranded %",
                                      "unevenness %", "waited %", "wait s", "longest s"});
        chart.categories.push_back(scenario.name);
        std::size_t drawn = 0;
        for (Contestant const& contestant : contestants()) {
            CampusFigures const figures = average_campus(prepare(scenario, contestant), output.seeds);
            std::vector<std::string> row = {contestant.name,
                                            decimals(figures.crammed, 1),
                                            decimals(figures.slowdown, 3),
                                            decimals(figures.refused, 1),
                                            decimals(figures.stranded, 1),
                                            decimals(figures.unevenness, 1)};
            if (contestant.line == Line::none)
                row.insert(row.end(), 3, "-");
            else
                row.insert(row.end(), {decimals(figures.waited, 1), decimals(figures.wait, 0),
                                       decimals(figures.longest_wait, 0)});
            print_row(output.tables, row);
            output.tables.flush();
            if (contestant.peers == Peers::counted)
                chart.series[drawn++].values.push_back(figures.crammed);
        }
    }
    if (output.images)
        std::ofstream(*output.images / "campus.svg") << to_svg(chart);
}

void days(Output& output)
{
    print_heading(output.tables, {"seed", "campus", "heavy worlds wait", "time crammed %", "waited %",
                                  "wait s", "longest s"});
    for (std::uint64_t seed = 1; seed <= output.seeds; ++seed)
        for (Scenario const& scenario : scenarios())
            for (Contestant const& contestant : contestants()) {
                if (contestant.line != Line::for_room)
                    continue;
                CampusFigures const figures = simulate_campus(prepare(scenario, contestant), seed);
                print_row(output.tables, {std::to_string(seed), scenario.name,
                                          contestant.way == Way::asked ? "asked before placing" : "relayed",
                                          decimals(figures.crammed, 3), decimals(figures.waited, 3),
                                          decimals(figures.wait, 3), decimals(figures.longest_wait, 3)});
                output.tables.flush();
            }
}

void warm_starts(Output& output)
{
    std::vector<Scenario> all(3);
    all[0].name = "equal machines";
    all[0].campus.seats.assign(20, 16);
    all[1].name = "unequal";
    all[2].name = "five session servers";
    all[2].campus.session_servers = 5;
    output.tables << "\nWhere the project is already there, seeds 1 to " << output.seeds << ":\n\n";
    print_heading(output.tables, {"", "warm %", "time crammed %", "refused %", "unevenness %"});
    for (Scenario& scenario : all) {
        Campus& campus = scenario.campus;
        campus.peers = Peers::worlds;
        campus.worlds = 3000;
        campus.cached_projects = 40;
        for (bool const told : {false, true}) {
            campus.reports_projects = told;
            CampusFigures const figures = average_campus(campus, output.seeds);
            print_row(output.tables, {scenario.name + (told ? ", projects reported" : ", not reported"),
                                      decimals(figures.warm, 1), decimals(figures.crammed, 1),
                                      decimals(figures.refused, 1), decimals(figures.unevenness, 1)});
            output.tables.flush();
        }
    }
}

} // namespace simulation
