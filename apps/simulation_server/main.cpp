// webots-simulation-server: fetches projects and runs one simulator per browser on this machine.

#include <webots_cloud/daemon.hpp>
#include <webots_cloud/servers.hpp>

int main(int argc, char** argv)
{
    using namespace webots_cloud;
    Program program;
    program.name = "webots-simulation-server";
    program.kind = "simulation";
    program.summary = "Runs one simulation per browser on this machine, and cleans up after it.";
    program.default_config = "config/simulation/local.json";
    program.commands = {
        {"drain", "ask the running server to take no new simulations", "POST", "/api/drain"},
        {"drain-and-exit", "the same, and to end with the last simulation", "POST", "/api/drain?exit"},
        {"resume", "ask it to take new simulations again", "POST", "/api/drain?off"},
        {"end", "NUMBER", "ask it to end the simulation of this number on its monitor page", "POST",
         "/api/end?simulation="},
    };

    auto const [arguments, usage] = parse_arguments(argc, argv, program);
    if (!arguments)
        return usage;
    if (arguments->doctor)
        return diagnose_simulation_server(*arguments, program_folder());
    auto const [config, status] = load_config(program, *arguments, parse_simulation_config);
    if (!config)
        return status;
    if (arguments->command)
        return ask_running_server(program, *arguments->command, config->address.port, config->access);
    auto const log =
        open_log(program, config->log_dir / "simulation" / "output.log", config->debug, config->json_log);
    if (!log)
        return exit_usage;
    auto const reload = [&given = *arguments] { return read_config(given, parse_simulation_config); };
    return run_daemon(program.name, [&settings = *config, &given = *arguments, &reload,
                                     &log](boost::asio::any_io_executor executor) {
        return serve_simulations(executor, settings, reload, program_folder(), *log, given.config);
    });
}
