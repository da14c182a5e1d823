#include "options.hpp"

#include "core/placement/decisions_table.hpp"

#include <algorithm>

namespace webots_cloud::app {

Program session_server_program()
{
    Program program;
    program.name = "webots-session-server";
    program.kind = "session";
    program.summary = "Tells browsers whether a machine is free, and sends each to the best one.";
    program.default_config = "config/session/local.json";
    program.commands = {
        {"drain", "ADDRESS",
         "ask the running server to send nobody to this simulation server, named as in \"simulationServers\"",
         "POST", "/api/drain?machine="},
        {"resume", "ADDRESS", "after --drain: ask the running server to send browsers there again", "POST",
         "/api/drain?off&machine="},
        {"decisions", "show the last 100 placements of the running server, and why", "GET", "/api/decisions"},
    };
    program.commands.back().table = core::decisions_table;
    return program;
}

Program simulation_server_program()
{
    Program program;
    program.name = "webots-simulation-server";
    program.kind = "simulation";
    program.summary = "Runs one simulation per browser on this machine, and cleans up after it.";
    program.default_config = "config/simulation/local.json";
    program.commands = {
        {"drain", "ask the running server to take no new simulations", "POST", "/api/drain"},
        {"drain-and-exit", "the same, and to end after the last simulation", "POST", "/api/drain?exit"},
        {"resume", "after --drain: ask the running server to take new simulations again", "POST",
         "/api/drain?off"},
        {"end", "NUMBER",
         "ask the running server to end the simulation with this number, which its monitor page shows",
         "POST", "/api/end?simulation="},
    };
    return program;
}

namespace {

ProgramOption option(std::string name, std::string summary, std::string value = {})
{
    ProgramOption made;
    made.name = std::move(name);
    made.summary = std::move(summary);
    made.value = std::move(value);
    return made;
}

} // namespace

std::vector<ProgramOption> options_of(Program const& program)
{
    bool const has_tables = std::ranges::any_of(
        program.commands, [](OperatorCommand const& command) { return command.table != nullptr; });
    std::vector<ProgramOption> all{
        option("check-config", "read the configuration, say what is wrong with it, and stop"),
        option("doctor", "look at everything that can be wrong with the server and this machine, say what to "
                         "do, and stop"),
        option("help", "show this text, or what a key of the configuration does, as in --help port"),
        option("json",
               has_tables ? "with --doctor or --decisions: say it in JSON" : "with --doctor: say it in JSON"),
        option("log-format", "how lines of the log are written, whatever the configuration says",
               "text|json"),
        option("move-ports",
               program.kind == "session"
                   ? "add this to the ports of the configuration: the server's own, and those of simulation "
                     "servers on this machine"
                   : "add this to the server's ports of the configuration",
               "NUMBER"),
        option("schema", "show the JSON Schema of the configuration, for editors"),
        option("version", "show the version"),
    };
    for (auto& each : all) {
        if (each.name == "help")
            each.letter = 'h';
        if (each.name == "log-format")
            each.choices = {"text", "json"};
    }
    for (auto const& command : program.commands)
        all.push_back(option(command.option, command.summary, command.value));
    std::ranges::sort(all, {}, &ProgramOption::name);
    return all;
}

std::vector<Meaning> signals_of(Program const& program)
{
    std::vector<Meaning> signals{
        {"SIGHUP", "read the configuration again; what needs a restart is logged"},
        {"SIGTERM, SIGINT",
         program.kind == "simulation" ? "end cleanly, after all simulations" : "end cleanly"},
    };
    if (program.kind == "simulation")
        signals.emplace_back("SIGUSR1", "take no new simulations, as --drain");
    return signals;
}

std::vector<Meaning> exit_statuses()
{
    return {
        {"0", "it was ended by a signal, or has done what was asked"},
        {"1", "it could not go on; or, of --doctor, there are warnings"},
        {"2", "arguments or configuration are unusable; or, of --doctor, there are faults"},
        {"3", "a port is in use, or something is missing that may come: try again later"},
    };
}

} // namespace webots_cloud::app
