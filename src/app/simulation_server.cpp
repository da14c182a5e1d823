#include "../core/client_protocol.hpp"
#include "../core/docker_leftovers.hpp"
#include "../core/docker_project.hpp"
#include "../core/monitor_sample.hpp"
#include "../core/simulator_choice.hpp"
#include "../core/text.hpp"
#include "log_summaries.hpp"
#include "metrics.hpp"
#include "network.hpp"
#include "operator_requests.hpp"
#include "signals.hpp"

#include <webots_cloud/access_control.hpp>
#include <webots_cloud/adapters.hpp>
#include <webots_cloud/daemon.hpp>
#include <webots_cloud/docker_mode.hpp>
#include <webots_cloud/instance_root.hpp>
#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/registration.hpp>
#include <webots_cloud/servers.hpp>
#include <webots_cloud/service_report.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/simulation_service.hpp>

#include <boost/asio/experimental/awaitable_operators.hpp>

#include <unistd.h>

#include <cstdlib>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using core::concat;

constexpr std::size_t descriptors_per_simulation = 8; // pipes, the guard, and what fetching a project needs

std::string environment(char const* name)
{
    char const* const value = std::getenv(name);
    return value ? value : "";
}

fs::path cache_folder(SimulationConfig const& config)
{
    auto base = fs::path(environment("XDG_CACHE_HOME"));
    if (base.empty() && !environment("HOME").empty())
        base = fs::path(environment("HOME")) / ".cache";
    if (base.empty())
        base = fs::temp_directory_path();
    return base / "webots_cloud" / std::to_string(config.port);
}

fs::path instances_folder(SimulationConfig const& config)
{
    auto const ours = concat("webots-", std::to_string(::getuid()));
    return fs::temp_directory_path() / ours / std::to_string(config.port) / "instances";
}

bool is_program(fs::path const& path)
{
    return ::access(path.c_str(), X_OK) == 0 && !fs::is_directory(path);
}

/// Where a program is, of those that the environment's PATH leads to; empty: nowhere.
fs::path find_program(std::string_view name)
{
    auto const path = environment("PATH");
    for (fs::path const folder : core::split(path, ':'))
        if (folder.is_absolute() && is_program(folder / name))
            return folder / name;
    return {};
}

std::string host_name()
{
    char name[256] = "";
    (void)::gethostname(name, sizeof name - 1);
    return name;
}

/// What starts at the folder that we run in; simulators run in others.
fs::path from_here(fs::path const& path)
{
    std::error_code failed;
    auto const found = path.empty() ? path : fs::absolute(path, failed);
    return failed ? path : found;
}

/// Containers bring their own Webots.
result<core::SimulatorChoice> choose_simulator(SimulationConfig const& config, fs::path const& programs)
{
    if (!config.docker)
        return core::choose_simulator(from_here(config.webots_home), from_here(environment("WEBOTS_HOME")),
                                      programs, is_program);
    core::SimulatorChoice choice;
    choice.program = core::webots_in_container;
    return choice;
}

/// The sources of all forges. Git servers share one, and with it its cache.
struct Sources
{
    Sources(asio::any_io_executor const& executor, SimulationConfig const& config, Logger const& log)
    {
        for (auto const& forge : config.forges) {
            if (!forge.directory.empty()) {
                owned.push_back(make_directory_source(executor, forge.directory));
                forges.emplace_back(forge.url, *owned.back());
                continue;
            }
            if (!git) {
                GitSourceParams params;
                params.cache = cache_folder(config);
                params.cache_bytes = config.cache_bytes;
                params.instances = instances_folder(config);
                git = make_git_source(executor, params, log);
            }
            forges.emplace_back(forge.url, *git);
        }
    }

    std::unique_ptr<ProjectSource> git;
    std::vector<std::unique_ptr<ProjectSource>> owned;
    std::vector<Forge> forges;
};

WebsiteSourceParams website_params(SimulationConfig const& config, fs::path const& simulator)
{
    WebsiteSourceParams params;
    params.keys = config.key_dir;
    params.projects = config.projects_dir;
    if (params.projects.empty())
        params.projects = simulator.parent_path() / "projects" / "samples" / "robotbenchmark";
    return params;
}

/// The screen that Webots draws on; empty: nobody has named one.
std::string display_of(SimulationConfig const& config)
{
    return config.display.empty() ? environment("DISPLAY") : config.display;
}

SimulationLauncherParams launcher_params(SimulationConfig const& config, fs::path simulator)
{
    SimulationLauncherParams params;
    params.webots = std::move(simulator);
    params.first_port = static_cast<std::uint16_t>(config.port + 1);
    params.most_simulations = config.max_connections;
    params.timeout = config.timeout;
    params.start_timeout = config.start_timeout;
    params.old_webots_tls = !config.network.ssl_certificate.empty() && !config.port_rewrite;
    params.old_webots_multimedia_server = config.multimedia_server;
    params.old_webots_multimedia_stream = config.multimedia_stream;
    params.environment = current_environment();
    for (auto& [name, value] : params.environment)
        if (name == "WEBOTS_HOME")
            value = from_here(value);
    if (auto const display = display_of(config); !display.empty())
        params.display = display;
    return params;
}

DockerModeParams docker_params(SimulationConfig const& config)
{
    DockerModeParams params;
    params.docker = find_program("docker");
    params.docker_compose = find_program("docker-compose");
    std::error_code failed;
    params.templates = fs::weakly_canonical(config.containers.directory, failed);
    params.images = config.containers.images;
    params.project_dockerfiles = config.containers.project_dockerfiles;
    params.persistent_images = config.containers.persistent_images;
    params.identity = core::docker_identity(host_name(), config.port, instances_folder(config));
    params.run = make_token().substr(0, 8);
    params.environment = current_environment();
    if (fs::exists("/dev/dri", failed))
        params.graphics_device = "/dev/dri";
    if (auto const display = display_of(config); !display.empty()) {
        params.display = display;
        if (environment("SSH_CONNECTION").empty()) // a screen of somebody else's is not ours to open
            params.xhost = find_program("xhost");
    }
    return params;
}

SimulationServiceParams service_params(SimulationConfig const& config, std::string notice)
{
    SimulationServiceParams params;
    params.server = config.server;
    params.port = config.port;
    params.ssl = config.ssl;
    params.port_rewrite = config.port_rewrite;
    params.allowed_repositories = config.allowed_repositories;
    params.blocked_repositories = config.blocked_repositories;
    params.share_idle_time = config.share_idle_time;
    params.simulations_per_address = static_cast<std::size_t>(config.simulations_per_address);
    params.notify = config.notify;
    params.docker = config.docker;
    params.strict_load = config.strict_load;
    params.title = config.title;
    params.description = config.description;
    params.reconnect_grace = config.reconnect_grace;
    params.new_token = make_token;
    params.notice = std::move(notice);
    return params;
}

RegistrationParams registration_params(SimulationConfig const& config)
{
    core::PublicAddress address;
    address.host = config.server;
    address.ssl = config.ssl;
    address.port_rewrite = config.port_rewrite;
    RegistrationParams params;
    params.registries = config.notify;
    params.url = core::public_http_url(address, config.port);
    params.share_idle_time = config.share_idle_time;
    params.allowed_repositories = config.allowed_repositories;
    return params;
}

SimulationLogsParams logs_params(SimulationConfig const& config)
{
    SimulationLogsParams params;
    params.folder = config.log_dir / "simulation" / "simulations";
    params.keep = config.simulation_log_keep;
    return params;
}

/// Without docker mode there is nothing to do until the end.
asio::awaitable<result<>> run(DockerMode* docker, Clock& clock)
{
    if (docker)
        co_return co_await docker->run();
    for (;;) {
        auto const waited = co_await clock.wait_until(clock.now() + std::chrono::hours(24));
        if (!waited)
            co_return waited;
    }
}

} // namespace

asio::awaitable<result<>> serve_simulations(asio::any_io_executor executor, SimulationConfig config,
                                            Reread<SimulationConfig> reread, fs::path programs, Logger log)
{
    using namespace asio::experimental::awaitable_operators;
    programs = from_here(programs);
    auto const choice = choose_simulator(config, programs);
    if (!choice)
        co_return choice.error();
    if (!choice->notice.empty())
        log.warning(choice->notice);
    auto const instances = instances_folder(config);
    auto const root = InstanceRoot::open(instances);
    if (!root)
        co_return root.error().within(concat("no simulation server on port ", std::to_string(config.port)));
    if (auto const removed = root->left_overs().removed; removed > 0)
        log.info(concat("Removed ", std::to_string(removed), " left-over instance directories"));
    if (auto const kept = root->left_overs().kept; kept > 0)
        log.warning(concat(std::to_string(kept), " left-over instance directories can't be removed: remove ",
                           instances.string(), "/left-over-* by hand."));

    auto const clock = make_steady_clock(executor);
    auto const processes = make_process_host(executor, programs / "webots-process-guard");
    auto const metrics = make_host_metrics();
    Sources sources(executor, config, log);
    ProjectFetcherParams fetching;
    fetching.instances = instances;
    std::unique_ptr<ProjectSource> websites; // whose pages know nothing of containers
    if (!config.docker)
        websites = make_website_source(executor, website_params(config, choice->program), log);
    ProjectFetcher fetcher(fetching, sources.forges, log, websites.get());
    std::unique_ptr<TextFiles> files;
    std::unique_ptr<DockerMode> docker;
    if (config.docker) {
        files = make_text_files();
        docker = std::make_unique<DockerMode>(docker_params(config), *processes, *files, *clock, log);
        auto const opened = co_await docker->open();
        if (!opened)
            co_return opened.error();
    }
    SimulationLauncher launcher(launcher_params(config, choice->program), *processes, *clock, log,
                                docker.get());
    auto service_settings = service_params(config, choice->notice);
    if (config.monitor_log)
        service_settings.monitor_log = make_line_file(executor, config.log_dir / "simulation" / "monitor.csv",
                                                      core::monitor_csv_header(), log);
    HttpServer const* network_server = nullptr;
    service_settings.more_metrics = [&network_server] {
        return app::network_metrics(network_server->statistics());
    };
    std::shared_ptr<SimulationLogs> const logs =
        make_simulation_logs(executor, logs_params(config), *clock, log);
    if (config.simulation_log_keep > Duration::zero())
        service_settings.simulation_logs = logs;
    SimulationService service(std::move(service_settings), fetcher, launcher, *metrics, *clock, log);

    auto network = app::server_params(config.port, config.network);
    network.spare_descriptors +=
        descriptors_per_simulation * static_cast<std::size_t>(config.max_connections);
    auto const allowed = app::access_params(config.server, config.access);
    if (!allowed)
        co_return allowed.error();
    AccessControl access(*allowed, service, log);
    auto const server = make_http_server(executor, std::move(network), access, log);
    network_server = server.get();
    if (auto const listening = server->listen(); !listening)
        co_return listening.error();
    log.info(concat("Running simulation server on port ", std::to_string(config.port)));
    auto const socket_path = app::operator_socket("simulation", config.port, config.access);
    auto const operators = make_operator_socket(executor, socket_path, access, log);
    if (auto const listening = operators->listen(); !listening)
        log.warning(concat("No --drain, only SIGUSR1: ", listening.error().message()));
    auto const http = make_http_client(executor);
    Registration registration(registration_params(config), *http, *clock, log);
    std::function<result<>(SimulationConfig const&)> const apply = [&](SimulationConfig const& next) -> result<> {
        auto const next_access = app::access_params(config.server, next.access);
        if (!next_access)
            return next_access.error();
        access.set_params(*next_access);
        service.set_policy(service_params(next, choice->notice));
        registration.update(registration_params(next));
        return result<>();
    };
    std::function<void()> const drain = [&service] { service.drain(false); };
    auto const manager = make_service_manager();
    auto const ended =
        co_await (server->run() || operators->run() || report_to(*manager, *clock) || service.run() ||
                  registration.run() || run(docker.get(), *clock) || app::obey_sigusr1(executor, drain) ||
                  app::sum_up_log(log, *clock) ||
                  app::obey_sighup(executor, std::move(reread), config, apply, log) || logs->run());
    co_return std::visit([](result<> const& outcome) { return outcome; }, ended);
}

} // namespace webots_cloud
