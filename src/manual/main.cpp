// webots-manual: writes the manual page or a completion of one of our programs, or the manual page of a
// configuration, while we are built.
//
//     webots-manual man|bash|zsh|fish PROGRAM
//     webots-manual man PROGRAM.json

#include "manual.hpp"

#include "app/daemon.hpp"
#include "app/options.hpp"
#include "demo_simulator/options.hpp"
#include "guard/options.hpp"

#include <webots_cloud/version.hpp>

#include <cstring>
#include <iostream>
#include <string>

using namespace webots_cloud;
using app::Program;

namespace {

constexpr auto guard_name = "webots-process-guard";
constexpr auto demo_name = "webots-demo-simulator";

std::string configuration_of(Program const& program)
{
    return program.name + ".json";
}

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
    made.see_also = {{configuration_of(program), 5}, {other}, {guard_name}};
    return made;
}

manual::ConfigurationManual manual_of_configuration(Program const& program,
                                                    std::span<core::ConfigTopic const> topics,
                                                    Program const& other)
{
    manual::ConfigurationManual made;
    made.name = configuration_of(program);
    made.version = version();
    made.summary = "configuration of " + program.name;
    made.file = "/etc/webots-cloud/" + program.kind + ".json";
    made.description = {
        "The file is one JSON object. " + program.name +
            " reads it at its start, and again when it gets SIGHUP.",
        program.name + " --check-config says what is wrong with a file, in which line, and what to write. " +
            program.name + " --help KEY explains one key, and --schema prints a JSON Schema for editors.",
        "Names such as docs/access.md are pages of the documentation. The package webots-cloud-doc has them "
        "in "
        "/usr/share/doc/webots-cloud-doc."};
    made.topics = topics;
    made.see_also = {{program.name}, {configuration_of(other), 5}};
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
    made.see_also = {{"webots-simulation-server"}};
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
    made.see_also = {{"webots-simulation-server"}};
    return made;
}

/// What is written of the program or configuration `name`.
std::string document(std::string const& kind, std::string const& name)
{
    auto const session = app::session_server_program();
    auto const simulation = app::simulation_server_program();
    if (name == configuration_of(session))
        return manual::man_page(manual_of_configuration(session, core::session_topics(), simulation));
    if (name == configuration_of(simulation))
        return manual::man_page(manual_of_configuration(simulation, core::simulation_topics(), session));
    auto const program = name == session.name      ? manual_of(session, simulation.name)
                         : name == simulation.name ? manual_of(simulation, session.name)
                         : name == demo_name       ? manual_of_demo_simulator()
                                                   : manual_of_guard();
    return kind == "man"    ? manual::man_page(program)
           : kind == "bash" ? manual::bash_completion(program)
           : kind == "zsh"  ? manual::zsh_completion(program)
                            : manual::fish_completion(program);
}

} // namespace

int main(int argc, char** argv)
{
    if (argc != 3) {
        std::cerr << "Usage: webots-manual man|bash|zsh|fish PROGRAM\n"
                     "       webots-manual man PROGRAM.json\n";
        return 2;
    }
    std::cout << document(argv[1], argv[2]);
    return std::cout.flush() ? 0 : 1;
}
