// webots-session-server: knows the simulation machines and sends each browser to one of them.

#include "app/daemon.hpp"

#include <webots_cloud/servers.hpp>

int main(int argc, char** argv)
{
    using namespace webots_cloud;
    using namespace webots_cloud::app;
    auto const program = session_server_program();
    auto const [arguments, usage] = parse_arguments(argc, argv, program);
    if (!arguments)
        return usage;
    if (arguments->doctor)
        report_findings(*arguments, diagnose_session_server(*arguments, shown_progress()));
    auto const [configured, status] = load_config(program, *arguments, parse_session_config);
    if (!configured)
        return status;
    auto const& config = configured->config;
    if (arguments->command)
        return ask_running_server(program, *arguments, config.address.port, config.access);
    auto const confined = confine_session_server(config, arguments->config); // before there are threads
    auto const log = open_log(program, config.log_dir / "session" / "output.log", config.debug,
                              config.json_log, configured->warnings);
    if (!log)
        return exit_usage;
    log->info(confined ? "This server can open only the files that it needs (Landlock)."
                       : "This server is not confined to the files that it needs: " +
                             confined.error().message() + ".");
    auto const reload = [&given = *arguments] { return read_config(given, parse_session_config); };
    return run_daemon(
        program.name,
        [&settings = config, &reload, &log](boost::asio::any_io_executor executor) {
            return serve_sessions(executor, settings, reload, *log);
        },
        *log);
}
