#include "chart.hpp"
#include "experiments.hpp"
#include "queues.hpp"
#include "table.hpp"

#include <fstream>

namespace simulation {

namespace {

constexpr std::array<char const*, 4> policies = {"least_reported", "power_of_two", "random",
                                                 "least_committed"};
constexpr std::array<double, 7> ages = {0, 1, 2, 5, 10, 20, 50};

/// A rule, and what it should reach by a source that does not know our code.
struct Comparison
{
    std::string rule;
    std::string label; ///< The same in few words.
    double simulated = 0;
    double theory = 0;
};

std::vector<Comparison> compare_with_theory()
{
    std::vector<Comparison> all;
    QueueModel model;
    model.arrivals = 10'000'000;
    model.policy = "random";
    all.push_back({"random", "random", mean_time_in_system(model), 10});
    model.policy = "power_of_two";
    all.push_back({"the shorter of two", "the shorter of two", mean_time_in_system(model), 2.614});
    model.custom = best_of(3);
    all.push_back({"the shortest of three", "the shortest of three", mean_time_in_system(model), 2.028});
    model.custom = nullptr;
    model.policy = "least_committed";
    all.push_back({"least_committed against join-the-shortest-queue without our code", "least_committed",
                   mean_time_in_system(model), shortest_queue_time(model)});
    return all;
}

void draw_theory(Output& output, std::vector<Comparison> const& comparisons)
{
    Chart chart;
    chart.title = "The simulator against theory: 100 servers, load 0.9, fresh reports";
    chart.x_label = "rule";
    chart.y_label = "mean time in system";
    Series simulated{"simulated", {}};
    Series theory{"theory", {}};
    for (Comparison const& comparison : comparisons) {
        chart.categories.push_back(comparison.label);
        simulated.values.push_back(comparison.simulated);
        theory.values.push_back(comparison.theory);
    }
    chart.series = {simulated, theory};
    std::ofstream(*output.images / "theory.svg") << to_svg(chart);
}

} // namespace

void theory(Output& output)
{
    output.tables << "\n100 servers, arrivals 0.9 per server and service, fresh information, 10,000,000 "
                     "arrivals, seed 1:\n\n";
    print_heading(output.tables, {"rule", "simulated", "theory", "difference"});
    std::vector<Comparison> const comparisons = compare_with_theory();
    for (auto const& [rule, label, simulated, theory] : comparisons)
        print_row(output.tables, {rule, decimals(simulated, 3), decimals(theory, 3),
                                  decimals(100 * (simulated / theory - 1), 1) + " %"});
    if (output.images)
        draw_theory(output, comparisons);
}

void stale_reports(Output& output)
{
    for (double const rate : {0.5, 0.9, 0.99}) {
        output.tables << "\nMean time in system, arrivals " << rate
                      << " per server, 5,000,000 arrivals, seed 1:\n\n";
        Row heading = {"age of reports"};
        for (double const age : ages)
            heading.push_back(three_digits(age));
        print_heading(output.tables, heading);
        Chart chart;
        chart.title = "Old reports: mean time in system, 100 servers, load " + decimals(rate, 2);
        chart.x_label = "age of reports, in mean service times";
        chart.y_label = "mean time in system";
        chart.bars = false;
        chart.logarithmic = true;
        for (double const age : ages)
            chart.categories.push_back(decimals(age, 0));
        for (char const* const policy : policies) {
            Series series{policy, {}};
            Row row = {policy};
            for (double const age : ages) {
                QueueModel model;
                model.policy = policy;
                model.arrival_rate = rate;
                model.report_age = age;
                model.warm_up = 1'000'000;
                model.arrivals = 5'000'000;
                series.values.push_back(mean_time_in_system(model));
                row.push_back(three_digits(series.values.back()));
            }
            print_row(output.tables, row);
            output.tables.flush();
            chart.series.push_back(series);
        }
        if (output.images && rate == 0.9)
            std::ofstream(*output.images / "stale_reports.svg") << to_svg(chart);
    }
}

} // namespace simulation
