// webots-manual: writes the manual page or a completion of one of our programs, while we are built.
//
//     webots-manual man|bash|zsh|fish PROGRAM

#include "manual.hpp"

#include "app/options.hpp"
#include "demo_simulator/options.hpp"
#include "guard/options.hpp"

#include <webots_cloud/daemon.hpp>
#include <webots_cloud/version.hpp>

#include <cstring>
#include <iostream>
#include <string>

using namespace webots_cloud;

namespace {

constexpr auto guard_name = "webots-process-guard";
constexpr auto demo_name = "webots-demo-simulator";

manual::Manual manual_of(Program const& program, std::string const& other)
{
    manual::Manual made;
    made.name = program.name;
    made.version = version();
    made.summary = program.summary.substr(0, program.summary.size() - 1);
    made.takes_configuration = true;
    made.forms = {"[OPTION...] [CONFIG.json]"};
    made.description = {program.summary, "It runs in the foreground, as service managers expect, and tells "
                                         "systemd when it is ready. Without CONFIG.json it reads " +
                                             program.default_config.string() +
                                             " of the working folder, or else /etc/webots-cloud/" +
                                             program.kind +
                                             ".json, or else the first of these beside the program."};
    for (auto const& option : app::options_of(program))
        made.options.push_back({option.name, option.letter, option.value, option.choices, option.summary});
    made.signals = app::signals_of(program);
    made.exit_statuses = app::exit_statuses();
    made.files = {
        {"/etc/webots-cloud/" + program.kind + ".json", "the configuration that the unit of systemd names"},
        {"share/webots_cloud/config", "examples of configurations, below the installation"}};
    made.see_also = {other, guard_name};
    return made;
}

manual::Manual manual_of_guard()
{
    manual::Manual made;
    made.name = guard_name;
    made.version = version();
    made.summary = "runs one program and ends all that it has started";
    made.forms.assign(std::begin(guard::forms), std::end(guard::forms));
    made.description = {
        "webots-simulation-server starts one guard for each simulation. People need it for one thing: "
        "webots-process-guard --probe says how well this machine can keep simulations apart. The other "
        "options are the server's, and change with it.",
        "Standard input is the control socket. A byte asks the program to end: it gets SIGTERM, and the "
        "whole "
        "tree of processes SIGKILL after GRACE_MS milliseconds. End of file kills the tree at once. The "
        "guard "
        "ends when no process of the tree is left."};
    for (auto const& option : guard::options)
        made.options.push_back({option.name, 0, option.value, {}, option.summary});
    made.signals = {{"SIGTERM, SIGINT, SIGHUP", "ask the program to end, as a byte does"}};
    made.exit_statuses = {{"0 to 255", "that of the program"},
                          {"127", "the program could not be started; standard output says why"}};
    made.see_also = {"webots-simulation-server"};
    return made;
}

manual::Manual manual_of_demo_simulator()
{
    manual::Manual made;
    made.name = demo_name;
    made.section = 1;
    made.version = version();
    made.summary = "moves a few robots about in an arena, where Webots is not installed";
    made.forms = {"[OPTION]... WORLD.wbt"};
    made.description = {
        "It is not Webots: it takes Webots' command line and speaks Webots' streaming protocol, so that "
        "webots-simulation-server can show something on a machine without Webots."};
    for (auto const& option : demo::program_options)
        made.options.push_back({option.name + 2, 0, option.value, {}, option.summary});
    for (auto const& option : demo::ignored_options)
        made.options.push_back({option.name + 2, 0, option.value, {}, "accepted and ignored"});
    made.signals = {{"SIGTERM", "end at once"}};
    made.exit_statuses = {
        {"0", "it has done what was asked"},
        {"1", "the arguments, the world or the port can't be used; standard error says why"}};
    made.see_also = {"webots-simulation-server"};
    return made;
}

} // namespace

int main(int argc, char** argv)
{
    if (argc != 3)
        return 2;
    std::string const kind = argv[1];
    std::string const name = argv[2];
    auto const session = session_server_program();
    auto const simulation = simulation_server_program();
    auto const text = name == session.name      ? manual_of(session, simulation.name)
                      : name == simulation.name ? manual_of(simulation, session.name)
                      : name == demo_name       ? manual_of_demo_simulator()
                                                : manual_of_guard();
    std::cout << (kind == "man"    ? manual::man_page(text)
                  : kind == "bash" ? manual::bash_completion(text)
                  : kind == "zsh"  ? manual::zsh_completion(text)
                                   : manual::fish_completion(text));
    return std::cout.flush() ? 0 : 1;
}
