// What a site costs that adds and removes machines by itself, and how long its users wait.
#include "experiments.hpp"
#include "fleet.hpp"
#include "table.hpp"

#include <ostream>
#include <string>
#include <utility>

namespace simulation {

void fleet(Output& output)
{
    auto& out = output.tables;
    auto const heading = [&out](std::string const& text) {
        out << '\n' << text << ":\n\n";
        print_heading(out, {"site", "waited %", "mean wait s", "99.9 % of all s", "longest s", "refused %",
                            "crammed %", "most machines", "most sessions", "machine hours", "of perfect"});
    };
    auto const row = [&out](std::string const& name, Fleet const& fleet) {
        auto const figures = simulate_fleet(fleet, 1);
        print_row(out, {name, decimals(figures.waited, 2), decimals(figures.mean_wait, 1),
                        decimals(figures.late_wait, 0), decimals(figures.longest_wait, 0),
                        decimals(figures.refused, 2), decimals(figures.crammed, 2),
                        std::to_string(figures.most_machines), std::to_string(figures.most_sessions),
                        decimals(figures.machine_hours, 0),
                        decimals(figures.machine_hours / figures.perfect_machine_hours, 2)});
        out.flush();
    };
    auto const rows = [&row](Fleet const& autoscaled) {
        row("autoscaled: 15 % free, 90 s to boot", autoscaled);
        auto fixed = autoscaled;
        fixed.is_fixed = true;
        row("all machines all day", fixed);
        auto planned = autoscaled;
        planned.knows_timetable = true;
        row("autoscaled, knows the timetable", planned);
    };
    Fleet small;
    small.max_machines = 1000;
    small.min_machines = 10;
    small.browsers = 100'000;
    small.line = 1000;
    heading("A weekday with 100,000 browsers, at most 1,000 machines with 8 seats, three session servers");
    rows(small);
    auto variant = small;
    variant.reserve = 0.05;
    row("5 % free", variant);
    variant.reserve = 0.3;
    row("30 % free", variant);
    variant = small;
    variant.boot = 300;
    row("300 s to boot", variant);
    variant = small;
    variant.removal = Removal::newest;
    row("the newest machine goes first", variant);
    variant = small;
    variant.in_lessons = 0;
    row("nobody comes in classes", variant);
    heading("The same with 1,000,000 browsers and at most 10,000 machines");
    rows(Fleet());
}

} // namespace simulation
