// Composition of the simulation server: first finds out what this machine can do (user, sandbox, display,
// limits), which needs rights that are given up afterwards, then makes the parts from the configuration,
// connects them and runs them until one ends. Functions above `serve_simulations` translate: configuration
// into parameters, findings into lines for the operator.
#include "async/first_of.hpp"
#include "core/config/state_folder.hpp"
#include "core/docker/docker_leftovers.hpp"
#include "core/docker/docker_project.hpp"
#include "core/machine_labels.hpp"
#include "core/pages/monitor_sample.hpp"
#include "core/projects/outside_projects.hpp"
#include "core/sandbox/limits.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/simulation/isolation.hpp"
#include "core/simulation/simulator_choice.hpp"
#include "core/simulation/simulator_environment.hpp"
#include "core/slurm/job_command.hpp"
#include "core/text.hpp"
#include "display.hpp"
#include "doctor/doctor_endpoint.hpp"
#include "doctor/doctors.hpp"
#include "environment.hpp"
#include "https_redirect.hpp"
#include "log_summaries.hpp"
#include "metrics.hpp"
#include "operator_requests.hpp"
#include "own_confinement.hpp"
#include "sandbox.hpp"
#include "signals.hpp"
#include "simulation_folders.hpp"
#include "simulation_user.hpp"
#include "tickets.hpp"

#include <webots_cloud/access_control.hpp>
#include <webots_cloud/adapters/files.hpp>
#include <webots_cloud/adapters/host.hpp>
#include <webots_cloud/adapters/http_client.hpp>
#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/adapters/logs.hpp>
#include <webots_cloud/adapters/operator.hpp>
#include <webots_cloud/adapters/processes.hpp>
#include <webots_cloud/adapters/projects.hpp>
#include <webots_cloud/adapters/secrets.hpp>
#include <webots_cloud/announcing.hpp>
#include <webots_cloud/daemon.hpp>
#include <webots_cloud/docker_mode.hpp>
#include <webots_cloud/instance_root.hpp>
#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/registration.hpp>
#include <webots_cloud/servers.hpp>
#include <webots_cloud/service_report.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/simulation_service.hpp>
#include <webots_cloud/slurm_mode.hpp>

#include <fstream>

#include <sys/stat.h>
#include <unistd.h>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using app::absolute_path;
using app::cache_folder;
using app::environment;
using app::find_program;
using app::is_program;
using core::concat;

constexpr std::size_t descriptors_per_simulation = 8; // pipes, the guard, and what fetching a project needs

std::string host_name()
{
    char name[256] = "";
    (void)::gethostname(name, sizeof name - 1);
    return name;
}

result<InstanceRoot> open_instances(core::StateFolder const& folder, std::string const& name)
{
    return InstanceRoot::open(folder.path, name,
                              folder.may_be_link ? InstanceRoot::State::may_be_link
                                                 : InstanceRoot::State::no_link);
}

bool is_in_use(Failure const& failure)
{
    return failure.code() == boost::system::errc::resource_unavailable_try_again;
}

/// The folder for the projects of running simulations, in the first state folder that works.
result<InstanceRoot> open_instances(SimulationConfig const& config, Logger const& log)
{
    auto const name = std::to_string(config.address.port);
    auto const folders = app::state_folders(config);
    auto root = open_instances(folders.front(), name);
    for (std::size_t i = 1; i < folders.size() && !root && !is_in_use(root.error()); ++i) {
        log.warning(concat(root.error().message(), ". Trying ", folders[i].path.string(), " instead."));
        root = open_instances(folders[i], name);
    }
    if (!root)
        return root.error().within(concat("no simulation server on port ", name));
    for (auto const& notice : root->notices())
        log.warning(notice);
    if (auto const removed = root->left_overs().removed; removed > 0)
        log.info(concat("Removed ", std::to_string(removed), " left-over instance directories"));
    return root;
}

/// Folders that simulations must not change: the cache, which later simulations are made of, and their logs.
std::vector<fs::path> read_only_folders(SimulationConfig const& config)
{
    std::vector<fs::path> folders;
    std::error_code failed;
    // All of them, not this port's alone: a server that finds its own in use takes the next one.
    auto const caches = cache_folder(config).parent_path();
    for (auto const& folder : {absolute_path(caches), absolute_path(config.log_dir / "simulation")}) {
        fs::create_directories(
            folder, failed); // a folder that is made later would be writable for simulations that run already
        if (fs::is_directory(folder, failed))
            folders.push_back(folder);
    }
    return folders;
}

/// Asks the guard which isolation it can provide here, and tells the operator what is missing. Containers are
/// isolated by Docker.
asio::awaitable<std::string> check_isolation(SimulationConfig const& config, fs::path guard,
                                             std::vector<fs::path> read_only, bool runs_as_root, Clock& clock,
                                             Logger log)
{
    if (config.docker)
        co_return std::string();
    auto const answer = co_await probe_guard(std::move(guard), std::move(read_only), clock);
    auto const parsed = answer ? core::parse_isolation(*answer) : result<core::Isolation>(answer.error());
    core::Isolation isolation;
    if (parsed)
        isolation = *parsed;
    else
        isolation.reason = parsed.error().message();
    auto warning = core::isolation_warning(isolation);
    if (!warning.empty())
        log.warning(warning);
    for (auto const& remark : core::isolation_remarks(isolation, runs_as_root))
        log.warning(remark);
    co_return warning;
}

/// Containers have their own Webots.
result<core::SimulatorChoice> choose_simulator(SimulationConfig const& config, fs::path const& programs)
{
    if (!config.docker)
        return core::choose_simulator(absolute_path(config.webots_home),
                                      absolute_path(environment("WEBOTS_HOME")), programs, is_program);
    core::SimulatorChoice choice;
    choice.program = core::webots_in_container;
    return choice;
}

/// What this machine can run, for session servers. Webots is beside `program`, with its version in a file.
std::vector<std::string> labels_of(SimulationConfig const& config, fs::path const& program)
{
    std::string version(64, '\0');
    std::ifstream file(program.parent_path() / "resources" / "version.txt");
    file.read(version.data(), static_cast<std::streamsize>(version.size()));
    version.resize(static_cast<std::size_t>(file.gcount()));
    return core::machine_labels(config.labels, config.docker, version);
}

/// What a source needs where simulations run as users of `/etc/subuid`.
struct HandOver
{
    ProjectSource& operator()(ProjectSource& source, std::vector<std::unique_ptr<ProjectSource>>& owned) const
    {
        if (!users)
            return source;
        owned.push_back(for_subordinate_users(source, users, instances));
        return *owned.back();
    }

    std::shared_ptr<SubordinateUsers> users; ///< Null: they don't.
    fs::path instances;
};

/// The sources of all forges. All git servers share one source and its cache.
struct Sources
{
    Sources(asio::any_io_executor const& executor, SimulationConfig const& config, fs::path const& instances,
            std::shared_ptr<FetchBudget> const& budget, Logger const& log, HandOver const& for_users)
    {
        for (auto const& forge : config.forges) {
            if (!forge.directory.empty()) {
                owned.push_back(make_directory_source(forge.directory));
                forges.emplace_back(forge.url, for_users(*owned.back(), owned));
                continue;
            }
            if (!git) {
                GitSourceParams params;
                params.cache = cache_folder(config);
                params.cache_bytes = config.cache_bytes;
                params.instances = instances;
                params.authorities = config.ca_file;
                git = make_git_source(executor, params, log, budget);
            }
            forges.emplace_back(forge.url, for_users(*git, owned));
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
    params.authorities = config.ca_file;
    params.projects = config.projects_dir;
    if (params.projects.empty())
        params.projects = simulator.parent_path() / "projects" / "samples" / "robotbenchmark";
    return params;
}

/// Containers have groups of their own.
ControlGroupsParams control_groups_params(SimulationConfig const& config, ProcessLimits const& limits)
{
    ControlGroupsParams params;
    params.enabled = !config.docker && !config.slurm && limits.any();
    params.may_use_root = ::geteuid() == 0;
    return params;
}

/// Tells the operator which limits simulations have, and which are not kept well. In containers Docker keeps
/// them.
/// Returns: the latter, as `core::unkept_limits` says.
std::string tell_limits(SimulationConfig const& config, ProcessLimits const& limits,
                        LimitSupport const& support, bool has_sandbox, Logger const& log)
{
    if (config.docker || config.slurm)
        return {};
    log.info(core::limits_text(limits, support));
    auto unkept = core::unkept_limits(limits, support, has_sandbox);
    if (!unkept.empty())
        log.warning(unkept);
    return unkept;
}

/// Where the sockets are by which simulations with a network of their own are reached. Empty: nowhere.
fs::path broker_folder(SimulationConfig const& config, InstanceRoot const& root, Logger const& log)
{
    constexpr std::size_t longest = 100; // names of sockets have 107 bytes, and ports five digits
    if (config.slurm)                    // jobs are on other machines
        return {};
    if (!config.gateway || root.brokers().native().size() <= longest)
        return config.gateway ? root.brokers() : fs::path();
    log.warning(concat("Simulations with a network of their own have open ports on this machine, although "
                       "\"gateway\" is true: the name of ",
                       root.brokers().native(), " is too long for sockets. Choose a shorter \"stateDir\"."));
    return {};
}

SimulationLauncherParams launcher_params(SimulationConfig const& config, fs::path simulator,
                                         SandboxParams sandbox, app::ChosenDisplay const& display,
                                         ProcessLimits const& limits, fs::path brokers)
{
    SimulationLauncherParams params;
    params.gateway = config.gateway;
    params.brokers = std::move(brokers);
    params.display = display.name;
    params.private_display = display.own;
    params.limits = limits;
    if (config.docker) { // which keeps those of its processes
        params.limits = ProcessLimits();
        params.limits.disk = limits.disk;
    }
    if (config.slurm) { // which gives jobs processors and memory
        params.limits.memory = 0;
        params.limits.processors = 0;
    }
    params.sandbox = std::move(sandbox);
    params.webots = std::move(simulator);
    params.first_port = static_cast<std::uint16_t>(config.address.port + 1);
    params.max_simulations = config.max_connections;
    params.timeout = config.timeout;
    params.extendable = config.extendable;
    params.start_timeout = config.start_timeout;
    params.old_webots_tls = !config.network.ssl_certificate.empty() && !config.address.port_rewrite;
    params.old_webots_multimedia_server = config.multimedia_server;
    params.old_webots_multimedia_stream = config.multimedia_stream;
    params.environment = current_environment();
    for (auto& [name, value] : params.environment)
        if (name == "WEBOTS_HOME")
            value = absolute_path(value);
    params.simulator_environment = config.simulator_environment;
    return params;
}

/// Tells the operator which variables of this server's environment simulators do not get. Simulators in
/// containers get the environment of their image.
void tell_environment(SimulationLauncherParams const& params, Logger const& log)
{
    auto const remarks = core::environment_remarks(params.environment, params.simulator_environment);
    for (auto const& notice : remarks.notices)
        log.info(notice);
    for (auto const& warning : remarks.warnings)
        log.warning(warning);
}

DockerModeParams docker_params(SimulationConfig const& config, fs::path const& instances,
                               app::ContainerNetwork const& network, ProcessLimits const& limits)
{
    DockerModeParams params;
    params.limits = limits;
    params.docker = find_program("docker");
    params.docker_compose = find_program("docker-compose");
    std::error_code failed;
    params.templates = fs::weakly_canonical(config.containers.directory, failed);
    params.images = config.containers.images;
    params.project_dockerfiles = config.containers.project_dockerfiles;
    params.build_network = config.containers.build_network;
    params.persistent_images = config.containers.persistent_images;
    params.identity = core::docker_identity(host_name(), config.address.port, instances);
    params.environment = current_environment();
    params.simulator_environment = config.simulator_environment;
    if (fs::exists("/dev/dri", failed))
        params.graphics_device = "/dev/dri";
    params.network = network.network;
    params.name_server = network.name_server;
    params.gateway = config.gateway;
    params.own_displays = config.display == "private";
    if (params.own_displays || config.display == "none") {
        params.display.clear();
    } else if (auto const display = app::wanted_display(config); !display.name.empty()) {
        params.display = display.name;
        if (display.may_be_opened)
            params.xhost = find_program("xhost");
    }
    return params;
}

/// Where simulations are jobs, which are started with the rights of this server's user.
SlurmModeParams slurm_params(SimulationConfig const& config, fs::path guard)
{
    SlurmModeParams params;
    params.srun = find_program("srun");
    params.scancel = find_program("scancel");
    params.squeue = find_program("squeue");
    params.sinfo = find_program("sinfo");
    params.getent = find_program("getent");
    params.tar = find_program("tar");
    params.guard = std::move(guard);
    params.jobs = *config.slurm;
    params.identity = core::job_identity(host_name(), config.address.port);
    params.run = make_token().substr(0, 8);
    params.time_limit = core::job_time_limit(config.timeout, config.extendable, config.start_timeout);
    params.environment = current_environment();
    return params;
}

/// Tells the operator whether projects of strangers are accepted, and what that depends on.
void tell_outside_projects(SimulationConfig const& config, SimulationWalls const& walls, Logger const& log)
{
    if (config.service.repositories.share_idle_time > 0)
        log.info(core::judge_outside_projects(walls, !config.service.repositories.allowed.empty()).remark);
}

SimulationServiceParams service_params(SimulationConfig const& config, SimulationWalls const& walls,
                                       std::string notice)
{
    SimulationServiceParams params;
    params.address = config.address;
    params.config = config.service;
    params.walls = walls;
    params.notice = std::move(notice);
    return params;
}

AnnouncingParams announcing_params(SimulationConfig const& config)
{
    AnnouncingParams params;
    params.session_servers = config.session_servers;
    params.address = concat(config.address.host, config.address.port_rewrite ? "/" : ":",
                            std::to_string(config.address.port));
    return params;
}

/// Empty without "sessionSecret". Errors: as `make_ticket_mac`.
result<std::function<std::string(std::string_view)>> ticket_mac(SimulationConfig const& config)
{
    if (config.access.session_secret.empty())
        return std::function<std::string(std::string_view)>();
    return make_ticket_mac(config.access.session_secret);
}

RegistrationParams registration_params(SimulationConfig const& config)
{
    RegistrationParams params;
    params.registries = config.service.notify;
    params.url = core::public_http_url(config.address);
    params.repositories = config.service.repositories;
    return params;
}

SimulationLogsParams logs_params(SimulationConfig const& config)
{
    SimulationLogsParams params;
    params.folder = config.log_dir / "simulation" / "simulations";
    params.keep = config.simulation_log_keep;
    return params;
}

/// Tells the operator whether this server keeps to its own files.
void tell_confinement(result<> const& confined, Logger const& log)
{
    log.info(confined ? "What handles requests and projects can open only the files that it needs (Landlock)."
                      : concat("This server is not confined to the files that it needs: ",
                               confined.error().message(), "."));
}

/// Without containers and jobs there is nothing to do until the end.
asio::awaitable<result<>> run(DockerMode* docker, SlurmMode* slurm, Clock& clock)
{
    if (slurm)
        co_return co_await slurm->run();
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
                                            Reload<SimulationConfig> reload, fs::path programs, Logger log,
                                            fs::path config_file)
{
    // Other users search what we make for simulations, whatever the operator's shell takes from new folders.
    // Our private folders say so themselves, and that of the logs exists by now.
    (void)::umask(S_IWGRP | S_IWOTH);
    programs = absolute_path(programs);
    auto const choice = choose_simulator(config, programs);
    if (!choice)
        co_return choice.error();
    if (!choice->notice.empty())
        log.warning(choice->notice);
    auto labels = labels_of(config, choice->program);
    auto root = open_instances(config, log);
    if (!root)
        co_return root.error();
    auto const& instances = root->path();

    auto const clock = make_steady_clock(executor);
    auto const metrics = make_host_metrics();
    auto const guard = programs / "webots-process-guard";
    auto read_only = read_only_folders(config);
    auto const host = metrics->description();
    auto const limits = core::simulation_limits(config.limits, host.memory_bytes, host.cores);
    auto const groups = make_control_groups(control_groups_params(config, limits));
    auto const group_folders = control_group_mounts(*groups);
    read_only.insert(read_only.end(), group_folders.begin(), group_folders.end());
    auto const limit_support_here = limit_support(*groups);
    auto const processes = make_process_host(executor, guard, read_only, groups, metrics->graphics_times());
    app::ContainerNetwork container_network;
    if (config.docker)
        container_network = app::choose_container_network(config, instances.parent_path(), log);
    app::SandboxContext sandbox_context;
    sandbox_context.simulator = choice->program;
    sandbox_context.guard = guard;
    sandbox_context.state = instances.parent_path();
    auto const user = co_await app::choose_simulation_user(config, sandbox_context, *processes, *clock, log);
    if (!user)
        co_return user.error();
    sandbox_context.user = user->user;
    co_await app::remove_left_overs(*root, user->subordinate, guard, log);
    auto const sandbox = co_await app::choose_sandbox(config, sandbox_context, *processes, *clock, log);
    if (!sandbox)
        co_return sandbox.error();
    app::tell_user(*user, sandbox->params.user, log);
    auto const unkept_limits =
        tell_limits(config, limits, limit_support_here, !sandbox->walls.sandbox.empty(), log);
    auto const display = co_await app::choose_display(config, sandbox->params, guard, sandbox_context.state,
                                                      *processes, *clock, log);
    if (!display)
        co_return display.error();
    auto isolation_warning = co_await check_isolation(
        config, guard, read_only, ::geteuid() == 0 && !sandbox->params.user.is_other(), *clock, log);

    auto wall_findings = app::wall_findings(config, choice);
    if (!config.docker)
        for (auto& each : app::wall_findings(*user, *sandbox, *display, isolation_warning, unkept_limits))
            wall_findings.push_back(std::move(each));

    // What starts programs, looks at them, or mounts, has been made by now; what handles anything that comes
    // from outside, has not.
    std::shared_ptr<MountThread> mounts;
    if (!config_file.empty() && config.confine_server) {
        mounts = make_mount_thread();
        core::SimulationFilesContext own;
        own.config_file = std::move(config_file);
        own.instances = instances;
        own.caches = cache_folder(config).parent_path();
        own.templates = website_params(config, choice->program).projects;
        own.groups = group_folders;
        tell_confinement(app::confine_simulation_server(config, std::move(own)), log);
    }
    auto const budget = make_fetch_budget(config.fetch_memory, config.fetch_disk);
    HandOver const for_users{sandbox->params.user.user_namespace >= 0 ? user->subordinate : nullptr,
                             instances};
    Sources sources(executor, config, instances, budget, log, for_users);
    ProjectFetcherParams fetching;
    fetching.instances = instances;
    std::unique_ptr<ProjectSource> websites; // the pages of websites know nothing of containers
    if (!config.docker)
        websites = make_website_source(website_params(config, choice->program), log, budget);
    ProjectFetcher fetcher(fetching, sources.forges, log,
                           websites ? &for_users(*websites, sources.owned) : nullptr);
    std::unique_ptr<TextFiles> files;
    std::unique_ptr<DockerMode> docker;
    if (config.docker) {
        files = make_text_files();
        DockerModeHooks hooks;
        hooks.exists = [](fs::path const& path) {
            std::error_code ignored;
            return fs::exists(path, ignored);
        };
        hooks.new_token = make_token;
        docker = std::make_unique<DockerMode>(docker_params(config, instances, container_network, limits),
                                              *processes, *files, *clock, log, hooks);
        auto const opened = co_await docker->open();
        if (!opened)
            co_return opened.error();
    }
    std::unique_ptr<SlurmMode> slurm;
    std::unique_ptr<HostMetrics> partitions;
    if (config.slurm) {
        slurm = std::make_unique<SlurmMode>(slurm_params(config, guard), *processes, *clock, log);
        auto const opened = co_await slurm->open();
        if (!opened)
            co_return opened.error();
        partitions = slurm->metrics(*metrics);
    }
    SimulationLauncher launcher(launcher_params(config, choice->program, sandbox->params, *display, limits,
                                                broker_folder(config, *root, log)),
                                *processes, *clock, log, docker.get(), slurm.get());
    if (!config.docker)
        tell_environment(launcher.params(), log);
    auto walls = sandbox->walls;
    walls.own_displays = display->name.empty();
    // Whether Slurm limits the memory of jobs, only its operators know.
    walls.limits = config.docker || (!config.slurm && core::limits_hold(limits, limit_support_here));
    tell_outside_projects(config, walls, log);
    auto service_settings = service_params(config, walls, choice->notice);
    service_settings.isolation_warning =
        isolation_warning.empty() ? sandbox->warning : std::move(isolation_warning);
    service_settings.limits_warning = unkept_limits;
    service_settings.sandbox = config.docker ? container_network.description : sandbox->description;
    if (!user->is_elsewhere)
        service_settings.sandbox.append(concat("; ", app::describe_user(*user, sandbox->params.user)));
    service_settings.display = display->description;
    service_settings.labels = std::move(labels);
    auto const tickets = app::ticket_check(config, *clock, log);
    if (!tickets)
        co_return tickets.error();
    SimulationServiceHooks hooks;
    hooks.new_token = make_token;
    hooks.refuse_ticket = *tickets;
    hooks.new_address_token = make_address_token;
    if (config.monitor_log)
        hooks.monitor_log =
            make_line_file(executor, "Monitor log file", config.log_dir / "simulation" / "monitor.csv",
                           core::monitor_csv_header(), log);
    auto network = http_server_params(config.address.port, config.network);
    network.spare_descriptors +=
        descriptors_per_simulation * static_cast<std::size_t>(config.max_connections);
    network.keeps_watches = !app::shared_user_risk(*user, sandbox->params.user).empty();
    auto const server = make_http_server(executor, std::move(network), log);
    hooks.more_metrics = [&server] { return app::http_server_metrics(server->statistics()); };
    auto const logs = make_simulation_logs(executor, logs_params(config), *clock, log);
    auto const folder_meter = make_folder_meter();
    hooks.folder_meter = folder_meter.get();
    if (for_users.users)
        hooks.folder_meter = for_users.users.get();
    if (config.simulation_log_keep > Duration::zero())
        hooks.simulation_logs = logs.get();
    SimulationService service(std::move(service_settings), fetcher, launcher,
                              partitions ? *partitions : *metrics, *clock, log, std::move(hooks));

    auto const token_check = app::operator_token_check(config.access);
    if (!token_check)
        co_return token_check.error();
    app::DoctorEndpoint doctor(executor, service, *clock);
    AccessControl access(app::access_params(config.address.host, config.access), doctor, *clock, log,
                         *token_check);
    app::HttpsRedirect redirect(executor, config.address, config.network, config.access, log);
    if (auto const listening = server->listen(); !listening)
        co_return listening.error();
    if (auto const listening = redirect.listen(); !listening)
        co_return listening.error();
    log.info(concat("Running simulation server on port ", std::to_string(config.address.port)));
    auto const socket_path = app::operator_socket("simulation", config.address.port, config.access);
    auto const operators = make_operator_socket(executor, socket_path, log);
    if (auto const listening = operators->listen(); !listening)
        log.warning(concat("No --drain, only SIGUSR1: ", listening.error().message()));
    auto const http = make_http_client(executor, config.ca_file, log);
    Registration registration(registration_params(config), *http, *clock, log);
    auto session_mac = ticket_mac(config);
    if (!session_mac)
        co_return session_mac.error();
    Announcing announcing(announcing_params(config), *http, *clock, log, std::move(*session_mac));
    auto examined = config;
    app::DoctorEndpoint::Look const look = [&examined, &programs, &wall_findings, &doctor, &executor] {
        return app::examine_simulation_server(examined, programs, wall_findings,
                                              app::view_from_inside(doctor.instance()), executor);
    };
    app::Apply<SimulationConfig> const apply = [&](SimulationConfig const& next,
                                                   SimulationConfig const& file) -> result<> {
        auto const next_token_check = app::operator_token_check(next.access);
        if (!next_token_check)
            return next_token_check.error();
        access.apply(app::access_params(next.address.host, next.access), *next_token_check);
        tell_outside_projects(next, walls, log);
        service.apply(next.service);
        registration.apply(registration_params(next));
        examined = file;
        return result<>();
    };
    std::function<void()> const drain = [&service] { service.drain(false); };
    auto const manager = make_service_manager();
    auto parts = async::first_of(
        server->run(access), redirect.run(), operators->run(access), report_to(*manager, *clock),
        service.run(), registration.run(), announcing.run(), run(docker.get(), slurm.get(), *clock),
        doctor.run(look), app::obey_sigusr1(executor, drain), app::sum_up_log(log, *clock),
        app::obey_sighup(executor, std::move(reload), config, apply, log), logs->run());
    co_return co_await std::move(parts);
}

} // namespace webots_cloud
