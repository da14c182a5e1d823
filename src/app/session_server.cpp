// Composition of the session server: makes the parts from the configuration, connects them and runs them
// until one ends. At SIGHUP each part that has an `apply` gets its share of the configuration anew.
#include "adapters/logs/kept_file.hpp"
#include "adapters/operator/secret_file.hpp"
#include "async/first_of.hpp"
#include "challenges.hpp"
#include "controllers.hpp"
#include "core/base64.hpp"
#include "core/text.hpp"
#include "current_notifier.hpp"
#include "doctor/doctor_endpoint.hpp"
#include "doctor/doctors.hpp"
#include "https_redirect.hpp"
#include "kept_costs.hpp"
#include "log_summaries.hpp"
#include "metrics.hpp"
#include "operator_requests.hpp"
#include "signals.hpp"
#include "tickets.hpp"

#include <webots_cloud/access_control.hpp>
#include <webots_cloud/adapters/host.hpp>
#include <webots_cloud/adapters/http_client.hpp>
#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/adapters/mail.hpp>
#include <webots_cloud/adapters/names.hpp>
#include <webots_cloud/adapters/secrets.hpp>
#include <webots_cloud/fleet.hpp>
#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/machine_discovery.hpp>
#include <webots_cloud/operator_mail.hpp>
#include <webots_cloud/scheduler.hpp>
#include <webots_cloud/servers.hpp>
#include <webots_cloud/service_report.hpp>
#include <webots_cloud/session_service.hpp>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <random>
#include <unordered_set>

#include <sys/resource.h>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;

/// Machines are asked as browsers are sent to them.
LoadMonitorParams polls(SessionConfig const& config)
{
    auto params = config.polls;
    params.tls = config.address.ssl;
    return params;
}

SchedulerParams placement(SessionConfig const& config)
{
    auto params = config.placement;
    params.threshold = config.polls.threshold;
    params.report_lifetime = 2 * config.polls.interval + config.polls.timeout;
    params.seed = std::random_device()();
    return params;
}

/// Mails to the operator, if an address is configured at the moment.
struct AdministratorMail
{
    AdministratorMail(SessionConfig const& config, Clock& clock, Logger const& log)
        : mail(config.mail.administrator, config.address, notifier, clock, log)
    {}

    /// Errors: `invalid_argument`, `invalid_config`: no libcurl, which does not come by waiting for it; then
    /// everything stays as it was.
    result<> obey(SessionConfig const& config)
    {
        std::shared_ptr<Notifier> next;
        if (!config.mail.administrator.empty()) {
            auto made = make_smtp_notifier(config.mail, config.address.host);
            if (!made && made.error() == errc::unavailable)
                return Failure(errc::invalid_config, made.error().message());
            if (!made)
                return made.error();
            next = std::move(*made);
        }
        notifier.use(std::move(next));
        mail.apply(config.mail.administrator, config.address);
        return {};
    }

    app::CurrentNotifier notifier;
    OperatorMail mail;
};

/// The teachers' password is that of its file. Without that there are no classes: `check_files` has warned of
/// it. Errors: as `read_password`.
result<SessionConfig> with_password(SessionConfig config)
{
    std::error_code ignored;
    if (auto const& file = config.service.teacher_password_file; std::filesystem::exists(file, ignored)) {
        auto password = adapters::read_password(file);
        if (!password)
            return password.error();
        config.service.teacher_password = std::move(*password);
    }
    return config;
}

/// With `sessionSecret` several session servers take each other's tickets, and name machines alike. Otherwise
/// a secret is made when the first browser waits, or the first machine is to be named. Errors: as
/// `make_ticket_mac`.
result<std::function<std::string(std::string_view)>> waiting_mac(SessionConfig const& config,
                                                                 Logger const& log)
{
    using Mac = std::function<std::string(std::string_view)>;
    if (!config.access.session_secret.empty())
        return make_ticket_mac(config.access.session_secret);
    return Mac(
        [file = config.log_dir / ".waiting-room-secret", log, mac = Mac()](std::string_view message) mutable {
            if (!mac)
                mac = make_own_mac(file, log);
            return mac(message);
        });
}

GuardedServer guarded(SessionConfig const& config)
{
    return GuardedServer(config.address.host, app::machine_names(), config.service.relay);
}

/// That may announce themselves: polls of each take a descriptor, and most are for browsers.
std::size_t affordable_machines()
{
    rlimit limit{};
    auto const most = MachineDiscoveryHooks().max_announced;
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0)
        return most;
    return static_cast<std::size_t>(std::min<rlim_t>(most, limit.rlim_cur / 4));
}

/// Among those that the monitor polls.
std::unordered_set<std::string> unreachable_machines(LoadMonitor const& monitor)
{
    std::unordered_set<std::string> unreachable;
    for (auto const& server : monitor.servers())
        if (server.state == ServerState::down)
            unreachable.insert(server.address);
    return unreachable;
}

/// Errors: as `make_ticket_mac`.
result<MachineDiscoveryHooks> discovery_hooks(SessionConfig const& config, LoadMonitor const& monitor,
                                              Fleet& fleet)
{
    MachineDiscoveryHooks hooks;
    hooks.changed = [&fleet](std::vector<ServerChange> const& changes) { fleet.change(changes); };
    hooks.unreachable = [&monitor] { return unreachable_machines(monitor); };
    if (config.announcements) {
        auto mac = make_ticket_mac(config.access.session_secret);
        if (!mac)
            return mac.error();
        hooks.mac = std::move(*mac);
        hooks.max_announced = affordable_machines();
        hooks.receiver = core::base64url(random_bytes(16));
    }
    return hooks;
}

std::unique_ptr<HttpServer> http_server(asio::any_io_executor const& executor, SessionConfig const& config,
                                        Logger const& log)
{
    HttpServerParams params(config.network, config.address.port);
    params.tls_authorities = config.http_client.authorities;
    params.spare_descriptors += app::descriptors_of_redirect(config.network) +
                                app::descriptors_of_controllers(config.service.controller_port) +
                                (config.announcements ? affordable_machines() : 0);
    return make_http_server(executor, std::move(params), log);
}

/// Those that need nothing of the service.   Errors: as `app::ticket_maker`.
result<SessionServiceHooks> service_hooks(SessionConfig const& config, MachineDiscovery& discovery,
                                          AdministratorMail& administrator, Clock& clock)
{
    auto tickets = app::ticket_maker(config, clock);
    if (!tickets)
        return tickets.error();
    SessionServiceHooks hooks;
    if (config.announcements)
        hooks.take_announcement = [&discovery](IncomingRequest const& request) {
            return discovery.take_announcement(request);
        };
    hooks.make_ticket = std::move(*tickets);
    hooks.random_bytes = random_bytes;
    hooks.shared_addresses = shared_ipv4_addresses;
    hooks.tell_operator = [&administrator](LoadEvent const& event) { return administrator.mail.note(event); };
    return hooks;
}

/// The parts that take another configuration while the server runs.
struct Site
{
    /// Errors: those of the parts; some may have taken it by then.
    result<> obey(SessionConfig const& next) const
    {
        // What reads files comes first: it is the likeliest to fail, and nothing has changed by then.
        auto const token_check = app::operator_token_check(next.access);
        if (!token_check)
            return token_check.error();
        auto with_secrets = with_password(next);
        if (!with_secrets)
            return with_secrets.error();
        if (auto const usable = administrator.obey(next); !usable)
            return usable;
        if (auto const usable = monitor.apply(polls(next)); !usable)
            return usable;
        if (auto const usable = scheduler.apply(placement(next)); !usable)
            return usable;
        discovery.apply(next.simulation_servers, next.discover_loopback);
        // The discovery tells what changes later; what it lists now is taken whole.
        fleet.set(discovery.servers());
        service.apply(std::move(*with_secrets));
        access.apply(next.access, guarded(next), *token_check);
        return {};
    }

    AdministratorMail& administrator;
    LoadMonitor& monitor;
    Scheduler& scheduler;
    MachineDiscovery& discovery;
    Fleet& fleet;
    SessionService& service;
    AccessControl& access;
};

} // namespace

/// In this order: those that follow the list of machines are made before it gets its first ones
/// (`fleet.set`), and the port is opened when all that answers there is made.
asio::awaitable<result<>> serve_sessions(asio::any_io_executor executor, SessionConfig config,
                                         Reload<SessionConfig> reload, Logger log)
{
    auto const clock = make_steady_clock(executor);
    auto const http = make_http_client(executor, config.http_client, log);
    auto const websockets = make_websocket_client(executor, config.http_client, log);
    auto const sign = waiting_mac(config, log);
    if (!sign)
        co_return sign.error();
    Fleet fleet(*sign);
    auto made_monitor = LoadMonitor::make(polls(config), *http, *clock);
    if (!made_monitor)
        co_return made_monitor.error();
    auto& monitor = *made_monitor;
    auto made_scheduler = Scheduler::make(placement(config));
    if (!made_scheduler)
        co_return made_scheduler.error();
    auto& scheduler = *made_scheduler;
    auto const costs =
        adapters::make_kept_file(config.log_dir / "session" / "world_costs.txt", app::max_kept_costs);
    app::load_costs(scheduler, *costs, *clock, log);
    AdministratorMail administrator(config, *clock, log);
    if (auto const usable = administrator.obey(config); !usable)
        co_return usable;
    auto const server = http_server(executor, config, log);
    auto const names = make_name_service(executor, config.name_servers);
    auto discovery_calls = discovery_hooks(config, monitor, fleet);
    if (!discovery_calls)
        co_return discovery_calls.error();
    MachineDiscovery discovery(config.simulation_servers, config.discover_loopback, *names, *clock, log,
                               std::move(*discovery_calls));
    auto hooks = service_hooks(config, discovery, administrator, *clock);
    if (!hooks)
        co_return hooks.error();
    hooks->websockets = websockets.get();
    hooks->http = http.get();
    hooks->sign_waiting_ticket = *sign;
    hooks->more_metrics = [&server, &administrator] {
        return app::http_server_metrics(server->statistics()) +
               app::mail_metrics(administrator.mail.statistics());
    };
    auto with_secrets = with_password(config);
    if (!with_secrets)
        co_return with_secrets.error();
    SessionService service(std::move(*with_secrets), fleet, monitor, scheduler, *clock, log,
                           std::move(*hooks));

    auto token_check = app::operator_token_check(config.access);
    if (!token_check)
        co_return token_check.error();
    app::DoctorEndpoint doctor(executor, service, *clock);
    AccessControl access(config.access, guarded(config), doctor, *clock, log, *token_check);
    access.follow(fleet);
    fleet.set(discovery.servers());
    app::Challenges challenges(config.network.challenge_folder, access);
    app::HttpsRedirect redirect(executor, config.address, config.network, config.access, log);
    app::Controllers controllers(executor, config.service.controller_port, config.network, service, log);
    if (auto const listening = app::listen(*server, redirect, controllers); !listening)
        co_return listening.error();
    log.info(core::concat("Session server running on port ", std::to_string(config.address.port)));
    auto const operators = app::open_operator_socket(executor, "session", config.address.port, config.access,
                                                     "--decisions", log);
    Site const site{administrator, monitor, scheduler, discovery, fleet, service, access};
    auto examined = config;
    app::DoctorEndpoint::Look const look = [&examined, &doctor, &executor] {
        return app::examine_session_server(examined, app::view_from_inside(doctor.instance()), executor);
    };
    app::Apply<SessionConfig> const apply = [&](SessionConfig const& next,
                                                SessionConfig const& file) -> result<> {
        auto obeyed = site.obey(next);
        if (obeyed)
            examined = file;
        return obeyed;
    };
    auto const manager = make_service_manager();
    auto parts = async::first_of(
        server->run(challenges), redirect.run(), controllers.run(), operators->run(access),
        report_to(*manager, *clock), service.run(), monitor.run(), discovery.run(), administrator.mail.run(),
        doctor.run(look), app::sum_up_log(log, *clock), app::keep_costs(scheduler, *costs, *clock, log),
        app::obey_sighup(executor, std::move(reload), config, apply, log));
    co_return co_await std::move(parts);
}

} // namespace webots_cloud
