// The session server from above: its parts and what connects them, and the table of paths (`routes`) with the
// part that answers each, all of them from memory. The machines are those of the Fleet, which LoadMonitor,
// Scheduler, MachinePaths and ClientRelay follow as this does.
// Decisions: core/placement/scheduler, core/load/load_table, core/fleet/drain_order.
#include <webots_cloud/session_service.hpp>

#include "async/first_of.hpp"
#include "class_endpoint.hpp"
#include "class_stager.hpp"
#include "client_relay.hpp"
#include "core/fleet/drain_order.hpp"
#include "core/load/load_table.hpp"
#include "core/pages/http_pages.hpp"
#include "core/pages/metrics_text.hpp"
#include "core/pages/monitor_page.hpp"
#include "core/text.hpp"
#include "gallery.hpp"
#include "machine_gateway.hpp"
#include "machine_metrics.hpp"
#include "monitor_endpoint.hpp"
#include "service/route_table.hpp"
#include "service/tell.hpp"
#include "session_endpoint.hpp"
#include "site_availability.hpp"
#include "site_context.hpp"
#include "site_pages.hpp"

#include <webots_cloud/version.hpp>

#include <algorithm>
#include <array>
#include <functional>
#include <span>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

constexpr auto regular_update = std::chrono::seconds(1);

} // namespace

struct SessionService::Impl final : FleetObserver
{
    Impl(SessionConfig config, Fleet& fleet, LoadMonitor& monitor, Scheduler& scheduler, Clock& clock,
         Logger log, SessionServiceHooks hooks);

    void put(FleetMachine const& machine, FleetMachine const* was,
             std::optional<std::string_view> before) override;
    void remove(FleetMachine const& machine) override;
    void settled() override;

    asio::awaitable<result<>> carry_reports();
    asio::awaitable<result<>> update_regularly();
    void take(LoadEvent const& event);
    void expire_pages();

    static std::span<Route<Impl> const> routes();
    bool relays(IncomingRequest const&) const { return sessions.relays(); }
    bool is_operators(IncomingRequest const& request) const { return request.is_operator; }
    bool may_read_decisions(IncomingRequest const& request) const;
    bool hears_machines(IncomingRequest const&) const { return bool(site.hooks.take_announcement); }

    Answer session(IncomingRequest const& request) { return sessions.answer(request); }
    Answer front(IncomingRequest const& request) { return availability.answer(request, pages.start()); }
    Answer mean_load(IncomingRequest const&) { return core::page(core::mean_load(site.monitor.totals())); }
    Answer monitor_page(IncomingRequest const& request) { return monitor.answer(request); }
    Answer metrics(IncomingRequest const& request);
    Answer liveness(IncomingRequest const&) { return core::page("alive"); }
    Answer readiness(IncomingRequest const& request);
    Answer decisions(IncomingRequest const& request);
    Answer is_operator(IncomingRequest const&) { return core::page("operator"); }
    Answer drain(IncomingRequest const& request);
    Answer announcement(IncomingRequest const& request) { return site.hooks.take_announcement(request); }
    Answer no_folder(IncomingRequest const& request);
    Answer viewer(IncomingRequest const& request) { return pages.viewer(request); }
    Answer client_without_upgrade(IncomingRequest const& request)
    {
        return upgrade_wanted(site.log, request);
    }
    Answer class_page(IncomingRequest const& request) { return pages.class_page(request); }

    SiteContext site;
    Gallery gallery;
    ClassStager class_stager;
    ClassEndpoint classes;
    SiteAvailability availability;
    SessionEndpoint sessions;
    ClientRelay relay;
    MachineGateway gateway;
    MonitorEndpoint monitor;
    MachineMetrics machine_metrics;
    SitePages pages;
    std::uint64_t good_polls = 0;
    std::uint64_t failed_polls = 0;
};

SessionService::Impl::Impl(SessionConfig config, Fleet& fleet, LoadMonitor& load_monitor,
                           Scheduler& scheduler, Clock& clock, Logger log, SessionServiceHooks hooks)
    : site(std::move(config), fleet, load_monitor, scheduler, clock, std::move(log), std::move(hooks)),
      gallery(site), class_stager(site), classes(site, class_stager), availability(site),
      sessions(site, classes, availability), relay(site, classes, sessions, availability), gateway(site),
      monitor(site, relay, availability), machine_metrics(site), pages(site.config.service, gallery)
{
    // The monitor page shows what the LoadMonitor knows of a machine, so it comes after it, and is told first
    // of machines that leave.
    load_monitor.follow(fleet);
    scheduler.follow(fleet);
    fleet.add_observer(site.paths);
    fleet.add_observer(relay);
    fleet.add_observer(*this);
    monitor.update();
}

SessionService::SessionService(SessionConfig config, Fleet& fleet, LoadMonitor& monitor, Scheduler& scheduler,
                               Clock& clock, Logger log, SessionServiceHooks hooks)
    : impl_(std::make_unique<Impl>(std::move(config), fleet, monitor, scheduler, clock, std::move(log),
                                   std::move(hooks)))
{}

SessionService::~SessionService() = default;

void SessionService::apply(SessionConfig config)
{
    auto& site = impl_->site;
    config.address.port = site.config.address.port;
    auto const before = std::exchange(site.config, std::move(config));
    impl_->monitor.apply();
    impl_->classes.apply();
    impl_->relay.apply();
    impl_->sessions.apply(before.service);
    impl_->gallery.refresh();
    impl_->expire_pages();
    impl_->availability.update(site.clock.now());
    impl_->monitor.update();
}

void SessionService::Impl::put(FleetMachine const& machine, FleetMachine const* was,
                               std::optional<std::string_view> before)
{
    monitor.put(machine, was, before);
    gateway.forget_machines();
}

void SessionService::Impl::remove(FleetMachine const& machine)
{
    monitor.remove(machine);
    gateway.forget_machines();
}

void SessionService::Impl::settled()
{
    monitor.expire();
    availability.update(site.clock.now());
}

/// Something has changed that whoever changed it wants to see at once.
void SessionService::Impl::expire_pages()
{
    monitor.expire();
    machine_metrics.expire();
}

asio::awaitable<result<>> SessionService::run()
{
    auto parts =
        async::first_of(impl_->carry_reports(), impl_->update_regularly(), impl_->machine_metrics.run(),
                        impl_->relay.run(), impl_->gallery.run(), impl_->class_stager.run());
    co_return co_await std::move(parts);
}

asio::awaitable<result<>> SessionService::Impl::carry_reports()
{
    for (;;) {
        auto const events = co_await site.monitor.next_events();
        if (!events)
            co_return events.error();
        for (auto const& event : *events)
            take(event);
        relay.update();
        availability.update(site.clock.now());
    }
}

asio::awaitable<result<>> SessionService::Impl::update_regularly()
{
    for (;;) {
        auto const waited = co_await site.clock.wait_until(site.clock.now() + regular_update);
        if (!waited)
            co_return waited;
        classes.update();
        availability.update(site.clock.now());
        monitor.update();
    }
}

void SessionService::Impl::take(LoadEvent const& event)
{
    bool const is_up = event.server.state == ServerState::up;
    ++(is_up ? good_polls : failed_polls);
    site.scheduler.take(event, site.clock.now());
    // One that is slow may be busy; one that is not there may be followed by another at its address.
    if (!event.is_late)
        site.paths.answered(event.server.address, is_up);
    // After the scheduler has the report: those who have waited for it are placed by that.
    relay.heard_from(event.server.address);
    if (!event.is_repeated)
        monitor.change(event.server.address);
    if (event.transition == LoadTransition::none)
        return;
    if (!site.hooks.tell_operator || !site.hooks.tell_operator(event))
        site.log.info(core::line_of(event));
}

/// All that the session server answers; the busiest path is the first one.
std::span<Route<SessionService::Impl> const> SessionService::Impl::routes()
{
    using core::Methods;
    using enum Upgrade;
    static constexpr auto table = std::to_array<Route<Impl>>({
        // clang-format off
        {"/session",       Methods::read_and_options, everybody,                 accepted, &Impl::session, any_origin},
        {"/",              Methods::read,             everybody,                 accepted, &Impl::front},
        {"/request",       Methods::read,             everybody,                 ignored,  &Impl::front},
        {"/load",          Methods::read,             everybody,                 ignored,  &Impl::mean_load},
        {"/monitor",       Methods::read,             everybody,                 accepted, &Impl::monitor_page},
        {"/metrics",       Methods::read,             everybody,                 ignored,  &Impl::metrics},
        {"/livez",         Methods::read,             everybody,                 ignored,  &Impl::liveness},
        {"/livez/",        Methods::read,             everybody,                 ignored,  &Impl::liveness},
        {"/readyz",        Methods::read,             everybody,                 ignored,  &Impl::readiness},
        {"/readyz/",       Methods::read,             everybody,                 ignored,  &Impl::readiness},
        {"/api/decisions", Methods::read,             &Impl::may_read_decisions, ignored,  &Impl::decisions},
        {"/api/operator",  Methods::read,             &Impl::is_operators,       ignored,  &Impl::is_operator},
        {"/api/drain",     Methods::post,             &Impl::is_operators,       ignored,  &Impl::drain},
        {"/api/machines",  Methods::post,             &Impl::hears_machines,     ignored,  &Impl::announcement},
        {"/viewer/worlds/list", Methods::post,        everybody,                 ignored,  &Impl::no_folder},
        {"/viewer*",       Methods::read,             everybody,                 ignored,  &Impl::viewer},
        {"/view/*",        Methods::read,             everybody,                 ignored,  &Impl::viewer, any_origin},
        {"/client",        Methods::get,              &Impl::relays,             accepted, &Impl::client_without_upgrade},
        {"/class",         Methods::read,             everybody,                 accepted, &Impl::class_page},
        {"/class/*",       Methods::read,             everybody,                 ignored,  &Impl::class_page},
        // clang-format on
    });
    return table;
}

bool SessionService::Impl::may_read_decisions(IncomingRequest const& request) const
{
    return site.config.service.decisions_for_all || request.is_operator;
}

/// While all machines are full it is ready as well: else a load balancer would take every session server of a
/// full site out of service, with those who wait in its line and those whose simulations it relays.
Answer SessionService::Impl::readiness(IncomingRequest const&)
{
    auto const& servers = site.monitor.servers();
    auto const is_up = [](auto const& server) { return server.state == ServerState::up; };
    auto const is_willing = [&](auto const& server) {
        return is_up(server) && relay.last_refusal(server.address).empty();
    };
    if (std::ranges::any_of(servers, is_willing))
        return core::page("ready");
    if (std::ranges::any_of(servers, is_up)) // why is for /monitor, which may be the operator's alone
        return core::page("ready, but: every machine refused its last start: see /monitor and the log");
    return HttpResponse(503, std::string(core::html_type), "no simulation server");
}

/// Why browsers were sent where they were sent.
Answer SessionService::Impl::decisions(IncomingRequest const&)
{
    return core::json_page(decisions_json(site.scheduler, site.clock.now()));
}

/// `POST /api/drain?machine=sim1:2000`: no browser is sent there, until `&off`.
Answer SessionService::Impl::drain(IncomingRequest const& request)
{
    auto const order = core::parse_drain_order(request.query);
    if (!order)
        return HttpResponse(400, std::string(core::html_type),
                            "Expected /api/drain?machine=<address> or /api/drain?machine=<address>&off.");
    if (!site.fleet.drain(order->machine, !order->off))
        return HttpResponse(400, std::string(core::html_type),
                            concat("There is no machine ",
                                   core::escape_html(core::printable(order->machine, 200)),
                                   " in \"simulationServers\"."));
    expire_pages();
    if (site.fleet.find(order->machine)->is_draining() == order->off)
        return HttpResponse(
            409, std::string(core::html_type),
            "The configuration drains this machine, with \"drain\" in \"simulationServers\".");
    site.log.warning(concat(core::printable(order->machine), order->off
                                                                 ? " gets new sessions again"
                                                                 : " is drained: it gets no new sessions"));
    return core::page(order->off ? "serving" : "draining");
}

/// A request that has no body; `respond_to_body` answers the others.
Answer SessionService::Impl::no_folder(IncomingRequest const&)
{
    return SitePages::no_worlds(core::Refused::address_without_folder);
}

Answer SessionService::Impl::metrics(IncomingRequest const&)
{
    auto const servers = site.monitor.totals();
    core::MetricsText text;
    text.family(core::metric("build_info")).add(1, {{"version", version()}});
    text.family(core::metric("servers"))
        .add(static_cast<double>(servers.up), {{"state", "up"}})
        .add(static_cast<double>(servers.down), {{"state", "down"}})
        .add(static_cast<double>(servers.unknown), {{"state", "unknown"}});
    text.family(core::metric("servers_drained")).add(static_cast<double>(site.fleet.drained()));
    availability.write_metrics(text);
    sessions.write_metrics(text);
    classes.write_metrics(text);
    if (site.config.service.relay)
        relay.write_metrics(text);
    text.family(core::metric("polls_total"))
        .add(static_cast<double>(good_polls), {{"result", "good"}})
        .add(static_cast<double>(failed_polls), {{"result", "failed"}});
    return core::metrics_page(text.take() + machine_metrics.text(), site.hooks.more_metrics);
}

Answer SessionService::respond(IncomingRequest const& request)
{
    if (auto answer = impl_->gateway.pass_on(request))
        return std::move(*answer);
    return route_table::respond(Impl::routes(), *impl_, request);
}

/// The address of a repository or folder, whose worlds are to be listed.
std::uint64_t SessionService::max_body(IncomingRequest const& request)
{
    constexpr std::uint64_t longest_address = 4096;
    return request.method == "POST" && request.path == "/viewer/worlds/list" ? longest_address : 0;
}

asio::awaitable<HttpResponse> SessionService::respond_to_body(IncomingRequest const& request)
{
    if (!impl_->sessions.may_ask(request.quota_key, impl_->site.clock.now()))
        co_return SitePages::no_worlds(core::Refused::too_many_starts);
    co_return co_await impl_->pages.list_worlds(request);
}

result<ControllerWay> SessionService::way_of_controller(std::uint16_t machine, std::string_view key,
                                                        std::string_view robot)
{
    return impl_->gateway.way_of_controller(machine, key, robot);
}

void SessionService::stopping()
{
    impl_->classes.stop();
    impl_->relay.stop();
    impl_->gallery.stop();
}

namespace {

/// A transport has to ask `respond` first, which accepts no such WebSocket.
asio::awaitable<void> close_unasked(Channel& channel)
{
    channel.close(1008);
    co_return;
}

} // namespace

/// Not a coroutine itself, as its frame would cost memory for every browser that waits.
asio::awaitable<void> SessionService::serve_websocket(ChannelInfo info, Channel& channel)
{
    if (info.path == "/monitor")
        return impl_->monitor.serve(channel);
    if (info.path == "/client" && !impl_->sessions.relays())
        return close_unasked(channel);
    if (info.path == "/client")
        return impl_->relay.serve(std::move(info), channel);
    if (info.path == "/session")
        return impl_->sessions.serve(info, channel);
    if (info.path == "/class")
        return impl_->classes.serve(std::move(info), channel);
    return impl_->availability.serve(std::move(info), channel);
}

} // namespace webots_cloud
