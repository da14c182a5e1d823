// Composition of the simulation server, in the order of its life: what needs all rights is made first
// (simulation_machine), then the server confines itself, and what handles projects and requests is made,
// connected and run until one part ends. Functions above `serve_simulations` make single parts.
#include "adapters/logs/line_file.hpp"
#include "async/first_of.hpp"
#include "challenges.hpp"
#include "controllers.hpp"
#include "core/config/config_rules.hpp"
#include "core/machine_labels.hpp"
#include "core/pages/monitor_sample.hpp"
#include "core/projects/outside_projects.hpp"
#include "core/public_place.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/text.hpp"
#include "doctor/doctor_endpoint.hpp"
#include "doctor/doctors.hpp"
#include "environment.hpp"
#include "https_redirect.hpp"
#include "launch_backends.hpp"
#include "log_summaries.hpp"
#include "metrics.hpp"
#include "operator_requests.hpp"
#include "own_confinement.hpp"
#include "own_limits.hpp"
#include "project_sources.hpp"
#include "signals.hpp"
#include "simulation_folders.hpp"
#include "simulation_machine.hpp"
#include "tickets.hpp"

#include <webots_cloud/access_control.hpp>
#include <webots_cloud/adapters/files.hpp>
#include <webots_cloud/adapters/host.hpp>
#include <webots_cloud/adapters/http_client.hpp>
#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/adapters/logs.hpp>
#include <webots_cloud/adapters/projects.hpp>
#include <webots_cloud/adapters/secrets.hpp>
#include <webots_cloud/announcing.hpp>
#include <webots_cloud/registration.hpp>
#include <webots_cloud/servers.hpp>
#include <webots_cloud/service_report.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/simulation_service.hpp>

#include <fstream>

#include <sys/stat.h>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using app::absolute_path;
using core::concat;

/// What this machine can run, for session servers. Webots is beside `program`, with its version in a file.
std::vector<std::string> labels_of(SimulationConfig const& config, fs::path const& program)
{
    std::string version(64, '\0');
    std::ifstream file(program.parent_path() / "resources" / "version.txt");
    file.read(version.data(), static_cast<std::streamsize>(version.size()));
    version.resize(static_cast<std::size_t>(file.gcount()));
    return core::machine_labels(config.labels, config.docker, version);
}

/// From here on the server opens only its own files; what mounts for it does so on a thread of its own, which
/// ends with what is returned. Null: the server does not confine itself.
std::shared_ptr<MountThread> confine(SimulationConfig const& config, app::SimulationMachine const& machine,
                                     fs::path config_file, Logger const& log)
{
    if (config_file.empty() || !config.confine_server)
        return nullptr;
    auto mounts = make_mount_thread();
    core::SimulationFilesContext own;
    own.config_file = std::move(config_file);
    own.instances = machine.instances();
    own.caches = machine.cache.parent_path();
    own.templates = app::website_templates(config, machine.simulator.program);
    own.groups = machine.group_folders;
    auto const confined = app::confine_simulation_server(config, std::move(own));
    log.info(confined ? "What handles requests and projects can open only the files that it needs (Landlock)."
                      : concat("This server is not confined to the files that it needs: ",
                               confined.error().message(), "."));
    return mounts;
}

/// Tells the operator whether projects of strangers are accepted, and what that depends on.
void tell_outside_projects(SimulationConfig const& config, SimulationWalls const& walls, Logger const& log)
{
    if (config.service.repositories.share_idle_time > 0)
        log.info(core::judge_outside_projects(walls, !config.service.repositories.allowed.empty()).remark);
}

SimulationServiceFacts service_facts(SimulationConfig const& config, app::SimulationMachine const& machine)
{
    auto const& trial = machine.trial;
    SimulationServiceFacts facts;
    facts.address = config.address;
    facts.walls = trial.walls;
    facts.notice = machine.simulator.notice;
    facts.isolation_warning = app::walls_warning(trial);
    facts.limits_warning = trial.unkept_limits;
    facts.sandbox = app::describe_confinement(trial);
    facts.display = trial.display.description;
    facts.labels = labels_of(config, machine.simulator.program);
    return facts;
}

std::unique_ptr<HttpServer> http_server(asio::any_io_executor const& executor, SimulationConfig const& config,
                                        app::MachineTrial const& trial, Logger const& log)
{
    HttpServerParams params(config.network, config.address.port);
    params.spare_descriptors +=
        app::descriptors_of_redirect(config.network) +
        app::descriptors_of_controllers(config.service.controller_port) +
        app::descriptors_per_simulation * static_cast<std::size_t>(config.launching.max_simulations);
    params.keeps_watches = !app::shared_user_risk(trial.user, trial.sandbox.params.user).empty();
    return make_http_server(executor, std::move(params), log);
}

/// Empty without "sessionSecret". Errors: as `make_ticket_mac`.
result<std::function<std::string(std::string_view)>> ticket_mac(SimulationConfig const& config)
{
    if (config.access.session_secret.empty())
        return std::function<std::string(std::string_view)>();
    return make_ticket_mac(config.access.session_secret);
}

/// Errors: as `app::ticket_check`.
result<SimulationServiceHooks> service_hooks(asio::any_io_executor const& executor,
                                             SimulationConfig const& config, Clock& clock, Logger const& log)
{
    auto tickets = app::ticket_check(config, clock, log);
    if (!tickets)
        return tickets.error();
    SimulationServiceHooks hooks;
    hooks.new_token = make_token;
    hooks.new_address_token = make_address_token;
    hooks.refuse_ticket = std::move(*tickets);
    if (config.monitor_log)
        hooks.monitor_log = adapters::make_line_file(executor, "Monitor log file",
                                                     config.log_dir / "simulation" / "monitor.csv",
                                                     core::monitor_csv_header(), log);
    return hooks;
}

/// What a SimulationService looks at simulations and projects with.
struct Instruments
{
    Instruments(asio::any_io_executor const& executor, SimulationConfig const& config, Logger const& log)
        : folder_meter(make_folder_meter()), world_finder(make_world_finder(config.forges, log)),
          picture_taker(make_picture_taker(executor, log)), simulator_talk(make_simulator_talk(executor, log))
    {}

    void offer_to(SimulationServiceHooks& hooks, app::ProjectSources& sources) const
    {
        hooks.program_files = &sources.program_files();
        hooks.folder_meter = sources.users() ? sources.users().get() : folder_meter.get();
        hooks.world_finder = world_finder.get();
        hooks.picture_taker = picture_taker.get();
        hooks.simulator_talk = simulator_talk.get();
    }

    std::unique_ptr<FolderMeter> const folder_meter;
    std::unique_ptr<WorldFinder> const world_finder;
    std::unique_ptr<PictureTaker> const picture_taker;
    std::unique_ptr<SimulatorTalk> const simulator_talk;
};

GuardedServer guarded(SimulationConfig const& config)
{
    return GuardedServer(config.address.host, app::machine_names());
}

/// Applies what `AccessControl` was made with, and the repositories and limits of the service.
/// Errors: as `app::operator_token_check`; then nothing has changed.
result<> obey(SimulationConfig const& next, SimulationWalls const& walls, AccessControl& access,
              SimulationService& service, Registration& registration, Logger const& log)
{
    auto const token_check = app::operator_token_check(next.access);
    if (!token_check)
        return token_check.error();
    access.apply(next.access, guarded(next), *token_check);
    tell_outside_projects(next, walls, log);
    service.apply(next.service);
    registration.apply(next.service);
    return {};
}

/// 0 as well where simulators have ports of their own.
std::uint16_t controller_port(SimulationConfig const& config)
{
    return config.launching.gateway ? config.service.controller_port : 0;
}

/// What does not change while the server runs, for its doctor.
core::Findings walls_of(SimulationConfig const& config, app::SimulationMachine const& machine)
{
    auto findings = app::simulator_findings(config, machine.simulator);
    findings.insert(findings.end(), machine.trial.findings.begin(), machine.trial.findings.end());
    return findings;
}

} // namespace

asio::awaitable<result<>> serve_simulations(asio::any_io_executor executor, SimulationConfig config,
                                            Reload<SimulationConfig> reload, fs::path programs, Logger log,
                                            fs::path config_file)
{
    // Other users search what we make for simulations, whatever the operator's shell takes from new folders.
    // Our private folders say so themselves, and that of the logs exists by now.
    (void)::umask(S_IWGRP | S_IWOTH);
    if (auto const known = core::complete_choices(config); !known)
        co_return known.error();
    programs = absolute_path(programs);
    auto const clock = make_steady_clock(executor);
    auto const prepared = co_await app::prepare_machine(executor, config, programs, *clock, log);
    if (!prepared)
        co_return prepared.error();
    auto& machine = **prepared;
    auto const mounts = confine(config, machine, std::move(config_file), log);

    app::ProjectSources sources(executor, config, machine, log);
    auto backends = co_await app::open_backends(config, machine, *clock, log);
    if (!backends)
        co_return backends.error();
    SimulationLauncher launcher(config.launching, app::launcher_facts(config, machine, log),
                                *machine.processes, *clock, log, backends->docker.get(),
                                backends->slurm.get());
    tell_outside_projects(config, machine.trial.walls, log);

    auto hooks = service_hooks(executor, config, *clock, log);
    if (!hooks)
        co_return hooks.error();
    auto const server = http_server(executor, config, machine.trial, log);
    hooks->more_metrics = [&server] { return app::http_server_metrics(server->statistics()); };
    auto const logs = make_simulation_logs(executor, config.log_dir / "simulation" / "simulations",
                                           config.simulation_log_keep, *clock, log);
    if (config.simulation_log_keep > Duration::zero())
        hooks->simulation_logs = logs.get();
    Instruments const instruments(executor, config, log);
    instruments.offer_to(*hooks, sources);
    SimulationService service(config.service, service_facts(config, machine), sources.fetcher(), launcher,
                              backends->partitions ? *backends->partitions : *machine.metrics, *clock, log,
                              std::move(*hooks));

    auto const token_check = app::operator_token_check(config.access);
    if (!token_check)
        co_return token_check.error();
    app::DoctorEndpoint doctor(executor, service, *clock);
    AccessControl access(config.access, guarded(config), doctor, *clock, log, *token_check);
    app::Challenges challenges(config.network.challenge_folder, access);
    app::HttpsRedirect redirect(executor, config.address, config.network, config.access, log);
    app::Controllers controllers(executor, controller_port(config), config.network, service, log);
    if (auto const listening = app::listen(*server, redirect, controllers); !listening)
        co_return listening.error();
    log.info(concat("Running simulation server on port ", std::to_string(config.address.port)));
    auto const operators = app::open_operator_socket(executor, "simulation", config.address.port,
                                                     config.access, "--drain, only SIGUSR1", log);
    auto const http = make_http_client(executor, config.http_client, log);
    Registration registration(config.service, core::public_http_url(config.address), *http, *clock, log);
    auto session_mac = ticket_mac(config);
    if (!session_mac)
        co_return session_mac.error();
    Announcing announcing(config.session_servers, core::public_place(config.address), *http, *clock, log,
                          std::move(*session_mac));

    auto examined = config;
    app::DoctorEndpoint::Look const look = [&, walls = walls_of(config, machine)] {
        return app::examine_simulation_server(examined, programs, walls,
                                              app::view_from_inside(doctor.instance()), executor);
    };
    app::Apply<SimulationConfig> const apply = [&](SimulationConfig const& next,
                                                   SimulationConfig const& file) -> result<> {
        auto obeyed = obey(next, machine.trial.walls, access, service, registration, log);
        if (obeyed)
            examined = file;
        return obeyed;
    };
    std::function<void()> const drain = [&service] { service.drain(false); };
    auto const manager = make_service_manager();
    auto parts = async::first_of(
        server->run(challenges), redirect.run(), controllers.run(), operators->run(access),
        report_to(*manager, *clock), service.run(), registration.run(), announcing.run(), app::run(*backends),
        doctor.run(look), app::obey_sigusr1(executor, drain), app::sum_up_log(log, *clock),
        app::obey_sighup(executor, std::move(reload), config, apply, log), logs->run());
    co_return co_await std::move(parts);
}

} // namespace webots_cloud
