// webots-simulation-server: fetches projects and runs one simulator per browser on this machine.

#include "app/daemon.hpp"

#include <webots_cloud/servers.hpp>

int main(int argc, char** argv)
{
    using namespace webots_cloud;
    using namespace webots_cloud::app;
    auto const program = simulation_server_program();
    auto const [arguments, usage] = parse_arguments(argc, argv, program);
    if (!arguments)
        return usage;
    if (arguments->doctor)
        report_findings(*arguments,
                        diagnose_simulation_server(*arguments, program_folder(), shown_progress()));
    auto const [configured, status] = load_config(program, *arguments, parse_simulation_config);
    if (!configured)
        return status;
    auto const& config = configured->config;
    if (arguments->command)
        return ask_running_server(program, *arguments, config.address.port, config.access);
    auto const log = open_log(program, config.log_dir / "simulation" / "output.log", config.debug,
                              config.json_log, configured->warnings);
    if (!log)
        return exit_usage;
    auto const reload = [&given = *arguments] { return read_config(given, parse_simulation_config); };
    return run_daemon(
        program.name,
        [&settings = config, &given = *arguments, &reload, &log](boost::asio::any_io_executor executor) {
            return serve_simulations(executor, settings, reload, program_folder(), *log, given.config);
        },
        *log);
}
