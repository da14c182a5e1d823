// The session server from above: a table of paths (`routes`) leads to the functions that answer, all of them
// from memory. The machines are those of the Fleet, which LoadMonitor, Scheduler, MachinePaths and
// ClientRelay follow as this does. Waiting browsers are client_relay.cpp's, classes class_endpoint.cpp's.
// Decisions: core/placement/scheduler, core/access/forwarding, core/fleet/drain_order, core/site_state.
#include <webots_cloud/session_service.hpp>

#include "async/first_of.hpp"
#include "class_endpoint.hpp"
#include "class_stager.hpp"
#include "client_relay.hpp"
#include "core/access/asked_name.hpp"
#include "core/access/controller_greeting.hpp"
#include "core/access/forwarding.hpp"
#include "core/access/machine_paths.hpp"
#include "core/access/site_access.hpp"
#include "core/access/token_buckets.hpp"
#include "core/classes/class_paths.hpp"
#include "core/fleet/drain_order.hpp"
#include "core/gallery/world_list.hpp"
#include "core/pages/http_pages.hpp"
#include "core/pages/metrics_text.hpp"
#include "core/pages/monitor_page.hpp"
#include "core/pages/session_board.hpp"
#include "core/pages/shared_page.hpp"
#include "core/pages/viewer_defaults.hpp"
#include "core/public_place.hpp"
#include "core/refusals.hpp"
#include "core/simulation/gateway_address.hpp"
#include "core/simulation/public_base.hpp"
#include "core/site_state.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"
#include "gallery.hpp"
#include "machine_metrics.hpp"
#include "service/monitor_feed.hpp"
#include "service/route_table.hpp"
#include "service/tell.hpp"
#include "web/assets.hpp"

#include <webots_cloud/version.hpp>

#include <array>
#include <map>
#include <optional>
#include <span>
#include <unordered_set>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

/// A page with more would be so large that others would notice while it is made; its script asks for them.
constexpr std::size_t max_machines_in_page = 500;

// Placements time out and reports become stale without an event, so availability is computed again this
// often.
constexpr auto availability_check = std::chrono::seconds(1);

std::string transition_line(LoadEvent const& event)
{
    auto const& server = event.server;
    auto const load = concat(core::python_float(server.report.load), "%");
    switch (event.transition) {
    case LoadTransition::not_responding:
        return concat(server.address,
                      " simulation server is not responding (assuming 100% load): ", server.problem);
    case LoadTransition::too_slow:
        return concat(server.address,
                      " simulation server is taking too long to respond (assuming 100% load)");
    case LoadTransition::working_again:
        return concat(server.address, " simulation server is up and running again (load = ", load, ")");
    case LoadTransition::reached_maximum:
        return concat(server.address, " simulation server has reached maximum load (", load, ")");
    case LoadTransition::available_again:
        return concat(server.address, " simulation server is available again (load = ", load, ")");
    case LoadTransition::none:
        break;
    }
    return {};
}

// Includes the content type: GET /session is the busiest request, and a content type of its own would cost it
// an allocation.
constexpr std::string_view html_for_any_origin = "Content-Type: text/html; charset=UTF-8\r\n"
                                                 "X-Content-Type-Options: nosniff\r\n"
                                                 "Access-Control-Allow-Origin: *\r\n"
                                                 "Access-Control-Allow-Headers: x-requested-with\r\n"
                                                 "Access-Control-Allow-Methods: POST, GET, OPTIONS\r\n";
constexpr std::string_view any_origin = html_for_any_origin.substr(html_for_any_origin.find("X-"));

/// What `/session` answers instead of an address.
std::string session_error(core::Refused why)
{
    return concat("Error: ", core::row_of(why).sentence);
}

/// Pages know it by its code (protocol 2.1).
void give_reason(HttpResponse& response, core::Refused why)
{
    response.headers.emplace_back("Webots-Reason", core::row_of(why).code);
    response.headers.emplace_back("Access-Control-Expose-Headers", "Webots-Reason");
}

HttpResponse session_answer(std::string address)
{
    HttpResponse response(200, {}, std::move(address));
    response.fixed_headers = html_for_any_origin;
    if (response.body.starts_with("Error:"))
        give_reason(response, core::Refused::no_machine);
    return response;
}

AskedAddress asked_by(IncomingRequest const& request)
{
    return core::asked_address(request.headers, request.is_from_proxy);
}

HttpResponse for_any_page(HttpResponse response)
{
    response.headers.emplace_back("Access-Control-Allow-Origin", "*");
    return response;
}

} // namespace

struct SessionService::Impl final : FleetObserver
{
    Impl(SessionServiceParams parameters, Fleet& machines, LoadMonitor& load_monitor, Scheduler& placing,
         Clock& time, Logger logger, SessionServiceHooks others)
        : params(std::move(parameters)), fleet(machines), monitor(load_monitor), scheduler(placing),
          clock(time), log(std::move(logger)), hooks(std::move(others)), started(clock.wall()),
          board(monitor.params().interval, monitor.params().threshold),
          machine_metrics(machines, load_monitor, placing, time),
          gallery(params.config, machines, load_monitor, hooks.http, hooks.make_ticket, time),
          class_stager(machines, load_monitor, time, log, stager_hooks()),
          classes(load_monitor, placing, time, log, class_hooks()),
          relay(relay_params(), machines, load_monitor, placing, time, log, relay_hooks())
    {
        set_budget();
        classes.set_password(params.config.teacher_password);
        // The board shows what the monitor knows of a machine, so it comes after it, and is told first of
        // machines that leave.
        monitor.follow(fleet);
        scheduler.follow(fleet);
        fleet.add_observer(paths);
        fleet.add_observer(relay);
        fleet.add_observer(*this);
        describe_site();
        update_monitor();
    }

    void put(FleetMachine const& machine, FleetMachine const* was,
             std::optional<std::string_view> before) override;
    void remove(FleetMachine const& machine) override;
    void settled() override;

    ClassEndpointHooks class_hooks();
    core::ClassNetwork network_of(AskedAddress const& asked) const;
    ClassStagerHooks stager_hooks() const;
    ClientRelayParams relay_params() const;
    ClientRelayHooks relay_hooks();

    void set_budget()
    {
        asked = core::TokenBuckets(static_cast<std::size_t>(params.config.session_burst),
                                   params.config.session_rate);
    }

    asio::awaitable<result<>> carry_reports();
    asio::awaitable<result<>> check_availability();
    asio::awaitable<void> say_place(std::string text, Channel& channel);
    asio::awaitable<void> show_availability(std::string name, ChannelInfo info, Channel& channel);
    void take(LoadEvent const& event);
    void update_availability(TimePoint now);
    core::SiteState site_state(std::size_t waiting, bool is_available, TimePoint now) const;
    bool may_ask(std::string_view quota_key, TimePoint now);
    std::string address_of(std::string_view server, AskedAddress const& by) const;
    std::string machine_address(std::string_view server, AskedAddress const& by);
    template<class GetAsked>
    std::string place(TimePoint now, std::string_view token, core::SeatRequest seat,
                      GetAsked const& get_asked);
    core::StudentMachine student_machine(std::string_view entry, AskedAddress const& by) const;
    bool relays(IncomingRequest const& request) const;
    std::string own_address(AskedAddress const& by) const;
    std::string own_base(AskedAddress const& by) const;
    std::string_view path_below_us(std::string_view server, AskedAddress const& by) const;
    std::string public_address(std::string_view server, AskedAddress const& by) const;
    Answer client_without_upgrade(IncomingRequest const& request);
    HttpResponse too_many_asked(Duration wait) const;
    core::ForwardingTable const& forwarding_table();
    std::string path_of_machine(std::string_view path, AskedAddress const& by) const;
    std::optional<Answer> pass_on(IncomingRequest const& request);
    std::optional<Answer> pass_on_below(IncomingRequest const& request) const;
    static Forward to_machine(core::ForwardTarget target);

    static std::span<Route<Impl> const> routes();
    bool may_read_decisions(IncomingRequest const& request) const;
    bool is_operators(IncomingRequest const& request) const { return request.is_operator; }
    Answer is_operator(IncomingRequest const& request);
    Answer drain(IncomingRequest const& request);
    bool hears_machines(IncomingRequest const&) const { return bool(hooks.take_announcement); }
    Answer machine_announced(IncomingRequest const& request) { return hooks.take_announcement(request); }
    Answer session(IncomingRequest const& request);
    Answer availability(IncomingRequest const& request);
    Answer mean_load(IncomingRequest const& request);
    Answer monitor_page(IncomingRequest const& request);
    Answer web_file(IncomingRequest const& request);
    Answer no_folder(IncomingRequest const& request);
    Answer class_page(IncomingRequest const& request);
    HttpResponse defaults_page() const;
    Answer embedded(std::string_view name, IncomingRequest const& request);
    Answer decisions(IncomingRequest const& request);
    Answer metrics(IncomingRequest const& request);
    Answer liveness(IncomingRequest const& request);
    Answer readiness(IncomingRequest const& request);

    void write_relay(core::MetricsText& text) const;
    void expire_pages();
    void expire_monitor();
    void update_monitor();
    void count_placed();
    core::SiteState state_of(ServerLoad const& server) const;
    std::optional<core::WaitingFigures> waiting_figures() const;
    std::string monitor_snapshot();
    std::string monitor_text();
    void describe_site();

    SessionServiceParams params;
    Fleet& fleet;
    LoadMonitor& monitor;
    Scheduler& scheduler;
    Clock& clock;
    Logger log;
    SessionServiceHooks hooks;
    WallTime started;
    bool available = false;
    core::SiteState state = core::SiteState::unknown;
    std::unordered_set<Channel*> browsers;       // those that watch availability,
    std::unordered_set<Channel*> state_browsers; // and that ask for the state of the site instead
    core::SessionBoard board;
    MonitorFeed feed; // to those that watch the monitor page
    core::TimedPage monitor_html;
    core::TimedPage monitor_json;
    MachineMetrics machine_metrics;
    /// The first text for browsers that connect before the next update; empty: not made yet.
    std::string greeting;
    std::map<char const*, core::SharedPage>
        files; // below /viewer, /view and /class, by the address of their embedded contents
    std::uint64_t placed = 0;
    std::uint64_t refused = 0;
    std::uint64_t limited = 0;
    std::optional<core::ForwardingTable> forwarding; ///< Of the fleet; nothing: it has changed since.
    core::MachinePaths paths;
    core::TokenBuckets asked; // requests of each client for a place
    std::uint64_t good_polls = 0;
    std::uint64_t failed_polls = 0;
    Gallery gallery;
    ClassStager class_stager;
    ClassEndpoint classes;
    ClientRelay relay;
};

SessionService::SessionService(SessionServiceParams params, Fleet& fleet, LoadMonitor& monitor,
                               Scheduler& scheduler, Clock& clock, Logger log, SessionServiceHooks hooks)
    : impl_(std::make_unique<Impl>(std::move(params), fleet, monitor, scheduler, clock, std::move(log),
                                   std::move(hooks)))
{}

SessionService::~SessionService() = default;

void SessionService::apply(SessionServiceParams params)
{
    params.address.port = impl_->params.address.port;
    bool const keeps_budget = params.config.session_burst == impl_->params.config.session_burst &&
                              params.config.session_rate == impl_->params.config.session_rate;
    impl_->params = std::move(params);
    impl_->describe_site();
    impl_->board.set_threshold(impl_->monitor.params().threshold);
    impl_->classes.set_password(impl_->params.config.teacher_password);
    impl_->relay.apply(impl_->relay_params());
    if (!keeps_budget)
        impl_->set_budget();
    impl_->gallery.refresh();
    impl_->expire_pages();
    impl_->update_availability(impl_->clock.now());
    impl_->update_monitor();
}

void SessionService::Impl::put(FleetMachine const& machine, FleetMachine const* was,
                               std::optional<std::string_view> before)
{
    board.put(*monitor.find(machine.spec.address), machine, was, before);
    forwarding.reset();
}

void SessionService::Impl::remove(FleetMachine const& machine)
{
    board.remove(machine.spec.address);
    forwarding.reset();
}

void SessionService::Impl::settled()
{
    expire_monitor();
    update_availability(clock.now());
}

asio::awaitable<result<>> SessionService::run()
{
    auto parts =
        async::first_of(impl_->carry_reports(), impl_->check_availability(), impl_->machine_metrics.run(),
                        impl_->relay.run(), impl_->gallery.run(), impl_->class_stager.run());
    co_return co_await std::move(parts);
}

asio::awaitable<result<>> SessionService::Impl::carry_reports()
{
    for (;;) {
        auto const events = co_await monitor.next_events();
        if (!events)
            co_return events.error();
        for (auto const& event : *events)
            take(event);
        relay.update();
        update_availability(clock.now());
    }
}

asio::awaitable<result<>> SessionService::Impl::check_availability()
{
    for (;;) {
        auto const waited = co_await clock.wait_until(clock.now() + availability_check);
        if (!waited)
            co_return waited;
        classes.update();
        update_availability(clock.now());
        update_monitor();
    }
}

ClassEndpointHooks SessionService::Impl::class_hooks()
{
    ClassEndpointHooks of_classes;
    of_classes.random_bytes = hooks.random_bytes;
    of_classes.network = std::bind_front(&Impl::network_of, this);
    of_classes.machine_address = std::bind_front(&Impl::machine_address, this);
    of_classes.simulator_address = std::bind_front(&Impl::address_of, this);
    of_classes.stage = [this](std::vector<core::StagingWish> wishes) {
        return class_stager.update(std::move(wishes), params.address.ssl);
    };
    return of_classes;
}

/// Only for those who have asked this machine by a name that it has for itself: others have a link for
/// students, and need not know its networks.
core::ClassNetwork SessionService::Impl::network_of(AskedAddress const& asked) const
{
    core::ClassNetwork network;
    if (!hooks.shared_addresses || core::reach_of(asked.host) != core::Reach::this_machine)
        return network;
    network.addresses = hooks.shared_addresses();
    network.is_open = params.address.host == core::asked_name;
    return network;
}

ClassStagerHooks SessionService::Impl::stager_hooks() const
{
    ClassStagerHooks of_stager;
    of_stager.websockets = hooks.websockets;
    of_stager.make_ticket = hooks.make_ticket;
    return of_stager;
}

ClientRelayParams SessionService::Impl::relay_params() const
{
    ClientRelayParams of_relay;
    of_relay.tls = params.address.ssl;
    of_relay.waiting_places = static_cast<std::size_t>(params.config.waiting_room);
    of_relay.finds_machines = params.finds_machines;
    return of_relay;
}

ClientRelayHooks SessionService::Impl::relay_hooks()
{
    ClientRelayHooks of_relay;
    of_relay.websockets = hooks.websockets;
    of_relay.make_ticket = hooks.make_ticket;
    of_relay.waiting_mac = hooks.sign_waiting_ticket;
    of_relay.random_bytes = hooks.random_bytes;
    of_relay.may_ask = [this](std::string_view quota_key) { return may_ask(quota_key, clock.now()); };
    of_relay.note_placement = [this](bool is_placed) {
        ++(is_placed ? placed : refused);
        update_availability(clock.now());
    };
    of_relay.ask_for_seat = [this](std::string_view student) {
        return classes.ask_for_seat(student, clock.now());
    };
    of_relay.take_seat = [this](std::string_view student, core::SeatRequest seat, std::string_view entry,
                                AskedAddress const& by) {
        classes.take_seat(student, seat, student_machine(entry, by), clock.now());
    };
    of_relay.public_address = std::bind_front(&Impl::public_address, this);
    of_relay.supply = [this] {
        auto const now = clock.now();
        return site_state(0, scheduler.available(now), now);
    };
    of_relay.note_line = [this] { update_availability(clock.now()); };
    of_relay.class_of = [this](std::string_view student) { return classes.class_of(student); };
    return of_relay;
}

void SessionService::Impl::take(LoadEvent const& event)
{
    ++(event.server.state == ServerState::up ? good_polls : failed_polls);
    scheduler.take(event, clock.now());
    // One that is slow may be busy; one that is not there may be followed by another at its address.
    if (!event.is_late)
        paths.answered(event.server.address, event.server.state == ServerState::up);
    // After the scheduler has the report: those who have waited for it are placed by that.
    relay.heard_from(event.server.address);
    if (!event.is_repeated)
        board.change(event.server.address);
    if (event.transition == LoadTransition::none)
        return;
    if (!hooks.tell_operator || !hooks.tell_operator(event))
        log.info(transition_line(event));
}

/// `waiting`: in the line.
core::SiteState SessionService::Impl::site_state(std::size_t waiting, bool is_available, TimePoint now) const
{
    core::SiteFacts facts;
    facts.is_available = is_available;
    facts.can_wait = params.config.relay && params.config.waiting_room > 0;
    facts.waiting = waiting;
    if (core::depends_on_machines(facts)) {
        facts.machines = scheduler.refusals(now);
        // While one machine has reported, there is mostly no need to count.
        auto const unheard = facts.machines[static_cast<std::size_t>(Refusal::unknown)];
        facts.is_awaited = unheard > 0 && !facts.is_available && monitor.totals().unknown > 0;
    }
    return core::site_state(facts);
}

void SessionService::Impl::update_availability(TimePoint now)
{
    bool const now_available = scheduler.available(now);
    if (auto const now_state = site_state(relay.waiting(), now_available, now); now_state != state) {
        state = now_state;
        for (auto* const browser : state_browsers)
            (void)browser->send(std::string(core::word_of(state)));
    }
    if (now_available == available)
        return;
    available = now_available;
    // A channel whose queue is full closes itself; its own coroutine then removes it from the set.
    for (auto* const browser : browsers)
        (void)browser->send(available ? "1" : "0");
}

/// Whether a client may ask for a place once more.
bool SessionService::Impl::may_ask(std::string_view quota_key, TimePoint now)
{
    auto const verdict = asked.take(quota_key, now);
    if (verdict == core::TokenBuckets::Verdict::taken)
        return true;
    ++limited;
    if (verdict == core::TokenBuckets::Verdict::refused_first)
        log.warning(
            LogCause("session limit"),
            concat("More requests for /session than one address may send come from ", asked.refused_by(),
                   ": see \"sessionBurst\" and \"sessionRate\", and \"trustedProxies\" if that is a proxy"));
    return false;
}

/// Where a browser that has asked us so reaches a simulation server, or what is below it.
std::string SessionService::Impl::address_of(std::string_view server, AskedAddress const& by) const
{
    if (auto address = public_address(server, by); !address.empty())
        return address;
    if (!server.starts_with(core::asked_name))
        return core::machine_reached_at(server, params.address, by);
    auto const path = core::path_in(server);
    bool const is_where_asked = server.substr(0, server.size() - path.size()) == core::asked_name;
    bool const is_below_us = path.starts_with(core::machine_folder) ||
                             (params.config.gateway && core::is_placed_by_proxy(params.address, by));
    return is_where_asked && !path.empty() && is_below_us
               ? concat(own_base(by), path)
               : core::machine_reached_at(server, params.address, by);
}

/// The path of a machine that is reached below this server's own address. Empty: its entry says where it is.
std::string_view SessionService::Impl::path_below_us(std::string_view server, AskedAddress const& by) const
{
    auto path = paths.empty() ? std::string_view() : paths.path_of(server);
    if (!path.empty() || !params.config.gateway)
        return path;
    path = core::path_at_own_port(params.address, server);
    if (path.empty())
        path = core::path_behind_proxy(params.address, params.other_names, by, server);
    auto const* const machine = path.empty() ? nullptr : fleet.find(server);
    return machine && !machine->spec.internal_address.empty() ? path : std::string_view();
}

/// The same, as a whole address. Empty: browsers reach it without us.
std::string SessionService::Impl::public_address(std::string_view server, AskedAddress const& by) const
{
    auto const path = path_below_us(server, by);
    return path.empty() ? std::string() : concat(own_base(by), path);
}

/// Where a browser that has asked us so reaches this server.
std::string SessionService::Impl::own_base(AskedAddress const& by) const
{
    return core::own_base(params.address, params.other_names, by);
}

/// The same, with a ticket where machines want one.
std::string SessionService::Impl::machine_address(std::string_view server, AskedAddress const& by)
{
    auto address = address_of(server, by);
    if (hooks.make_ticket)
        address += concat("/ticket/", hooks.make_ticket(server));
    return address;
}

/// `token` and `seat` are of a student; others have `unknown`. `get_asked` returns where the request has
/// asked us, which is looked for only where the address depends on that.
template<class GetAsked>
std::string SessionService::Impl::place(TimePoint now, std::string_view token, core::SeatRequest seat,
                                        GetAsked const& get_asked)
{
    bool const is_held = seat == core::SeatRequest::held;
    auto const placement = is_held ? scheduler.place_held(now) : scheduler.place(now);
    ++(placement ? placed : refused);
    if (!placement) {
        update_availability(now);
        return session_error(core::Refused::no_machine);
    }
    // This is the busiest path, and on most sites the address does not depend on how we were asked.
    bool const depends =
        params.config.gateway || !paths.empty() || placement->address.starts_with(core::asked_name);
    auto const by = depends ? get_asked() : AskedAddress();
    if (seat != core::SeatRequest::unknown)
        classes.take_seat(token, seat, student_machine(placement->address, by), now);
    update_availability(now);
    return machine_address(placement->address, by);
}

/// Where the simulators of a student will be, whose browser has asked us so.
core::StudentMachine SessionService::Impl::student_machine(std::string_view entry,
                                                           AskedAddress const& by) const
{
    core::StudentMachine machine;
    auto const path = path_below_us(entry, by);
    machine.entry = path.empty() ? std::string(entry) : concat(core::asked_name, path);
    machine.reached_at = address_of(entry, by);
    // The gateway passes on what is below a machine's port or path, and no other ports.
    machine.is_closed = params.config.gateway && (core::public_port(entry) != 0 || !path.empty());
    return machine;
}

/// Whether `/client` is here.
bool SessionService::Impl::relays(IncomingRequest const&) const
{
    return params.config.relay && hooks.websockets;
}

/// What `/session` answers where this server relays. No place is taken before a browser asks for a
/// simulation.
std::string SessionService::Impl::own_address(AskedAddress const& by) const
{
    if (!relay.takes_more(clock.now()))
        return session_error(core::Refused::no_machine);
    return own_base(by);
}

Answer SessionService::Impl::client_without_upgrade(IncomingRequest const& request)
{
    return upgrade_wanted(log, request);
}

/// With status 200, as every answer of /session: pages of before 2021 show nothing for any other status, and
/// later ones only look at the text.
HttpResponse SessionService::Impl::too_many_asked(Duration wait) const
{
    HttpResponse response(200, {}, session_error(core::Refused::too_many_starts));
    response.fixed_headers = html_for_any_origin;
    give_reason(response, core::Refused::too_many_starts);
    response.headers.emplace_back("Retry-After", core::seconds_rounded_up(wait));
    return response;
}

/// All that the session server answers; the busiest path is the first one.
std::span<Route<SessionService::Impl> const> SessionService::Impl::routes()
{
    using core::Methods;
    using enum Upgrade;
    static constexpr auto table = std::to_array<Route<Impl>>({
        // clang-format off
        {"/session",       Methods::read_and_options, everybody,                 accepted, &Impl::session, any_origin},
        {"/",              Methods::read,             everybody,                 accepted, &Impl::availability},
        {"/request",       Methods::read,             everybody,                 ignored,  &Impl::availability},
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
        {"/api/machines",  Methods::post,             &Impl::hears_machines,     ignored,  &Impl::machine_announced},
        {"/viewer/worlds/list", Methods::post,        everybody,                 ignored,  &Impl::no_folder},
        {"/viewer*",       Methods::read,             everybody,                 ignored,  &Impl::web_file},
        {"/view/*",        Methods::read,             everybody,                 ignored,  &Impl::web_file, any_origin},
        {"/client",        Methods::get,              &Impl::relays,             accepted, &Impl::client_without_upgrade},
        {"/class",         Methods::read,             everybody,                 accepted, &Impl::class_page},
        {"/class/*",       Methods::read,             everybody,                 ignored,  &Impl::class_page},
        // clang-format on
    });
    return table;
}

Answer SessionService::Impl::session(IncomingRequest const& request)
{
    if (request.method == "GET") {
        if (relays(request))
            return session_answer(own_address(asked_by(request)));
        auto const now = clock.now();
        auto const token = core::class_token(request.query);
        // Before the class is asked: wrong tokens can be tried no more often than that, either.
        if (!may_ask(request.quota_key, now))
            return too_many_asked(asked.interval());
        auto const seat = classes.ask_for_seat(token, now);
        if (seat == core::SeatRequest::too_often)
            return too_many_asked(core::class_limits::seat_interval);
        auto const get_asked = [&request] { return asked_by(request); };
        return session_answer(place(now, token, seat, get_asked));
    }
    bool const is_head = request.method == "HEAD"; // only asks whether the server is there: takes no place
    HttpResponse response(is_head ? 200 : 204, {}, {});
    response.fixed_headers = is_head ? html_for_any_origin : any_origin;
    return response;
}

/// Scripts are told whether a session could be placed; people, who have typed the address, are led to the
/// worlds that they can start, or to the page that starts any.
Answer SessionService::Impl::availability(IncomingRequest const& request)
{
    auto response = core::page(available ? "1" : "0");
    if (request.header("Accept").find("text/html") != std::string_view::npos) {
        response = HttpResponse(302, {}, {});
        // relative, for proxies that rewrite paths
        response.headers.emplace_back("Location", gallery.is_wanted() ? "viewer/worlds/" : "viewer/");
    }
    response.headers.emplace_back("Vary", "Accept");
    return response;
}

Answer SessionService::Impl::mean_load(IncomingRequest const&)
{
    return core::page(core::mean_load(monitor.totals()));
}

Answer SessionService::Impl::liveness(IncomingRequest const&)
{
    return core::page("alive");
}

/// While all machines are full it is ready as well: else a load balancer would take every session server of a
/// full site out of service, with those who wait in its line and those whose simulations it relays.
Answer SessionService::Impl::readiness(IncomingRequest const&)
{
    auto const& servers = monitor.servers();
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

void SessionService::Impl::count_placed()
{
    board.count_placed(std::bind_front(&Scheduler::placed, &scheduler));
    board.note_states(std::bind_front(&Impl::state_of, this));
    board.note_refusals(std::bind_front(&ClientRelay::last_refusal, &relay));
    board.note_site(state);
    board.note_waiting(waiting_figures());
}

core::SiteState SessionService::Impl::state_of(ServerLoad const& server) const
{
    return core::machine_state(scheduler.refusal_of(server.address, clock.now()),
                               server.state == ServerState::unknown);
}

std::optional<core::WaitingFigures> SessionService::Impl::waiting_figures() const
{
    if (!params.config.relay)
        return std::nullopt;
    auto const figures = relay.figures();
    core::WaitingFigures waiting;
    waiting.waiting = figures.waiting;
    waiting.longest = figures.longest_wait;
    waiting.relayed = figures.relayed;
    for (auto const why : core::all_wait_reasons)
        if (auto const count = figures.reasons[static_cast<std::size_t>(why)]; count > 0)
            waiting.reasons.emplace_back(core::word_of(why), count);
    return waiting;
}

std::string SessionService::Impl::monitor_snapshot()
{
    count_placed();
    return board.snapshot();
}

void SessionService::Impl::update_monitor()
{
    greeting = {};
    if (!feed.empty() || board.ends_minute(clock.now()))
        count_placed();
    board.take(clock.now(), clock.wall());
    if (feed.empty())
        return;
    if (auto const update = board.update(); !update.empty())
        feed.publish(update);
}

Answer SessionService::Impl::monitor_page(IncomingRequest const& request)
{
    auto const known = request.header("If-None-Match");
    // Asked by a page behind a proxy that blocks WebSockets.
    if (request.header("Accept").starts_with("application/json")) {
        auto const make = [this] { return monitor_snapshot(); };
        return monitor_json.get(clock.now(), make).answer("application/json", known);
    }
    auto const make = [this] { return monitor_text(); };
    return monitor_html.get(clock.now(), make).answer(core::html_type, known);
}

std::string SessionService::Impl::monitor_text()
{
    core::MonitorPage page;
    page.title = "Webots session server";
    page.words = core::session_words(started, fleet.machines().size(), monitor.totals());
    if (fleet.machines().size() <= max_machines_in_page)
        page.snapshot = monitor_snapshot();
    page.assets = monitor_assets("session.js", params.address.port);
    return core::monitor_page(page);
}

void SessionService::Impl::describe_site()
{
    core::SessionAbout about;
    about.started = started;
    about.is_tls = params.address.ssl;
    about.is_gateway = params.config.gateway;
    about.shows_decisions = params.config.decisions_for_all;
    board.describe(core::about_json(about));
}

/// Answers a request that has no body; `respond_to_body` answers the others.
Answer SessionService::Impl::no_folder(IncomingRequest const&)
{
    return for_any_page(
        core::json_page(core::world_list_error(core::refused(core::Refused::address_without_folder))));
}

/// The viewer page, the gallery below it, and the modules from which they and pages of other sites are made.
Answer SessionService::Impl::web_file(IncomingRequest const& request)
{
    auto const path = request.path;
    if (path == "/viewer" || path == "/viewer/worlds") {
        HttpResponse response(301, {}, {}); // relative, for proxies that rewrite paths
        response.headers.emplace_back("Location", path == "/viewer" ? "viewer/" : "worlds/");
        return response;
    }
    if (path == "/viewer/worlds/list.json")
        return for_any_page(gallery.answer(request.header("If-None-Match")));
    constexpr std::string_view picture_folder = "/viewer/worlds/picture/";
    if (path.starts_with(picture_folder))
        return for_any_page(
            gallery.picture(path.substr(picture_folder.size()), request.header("If-None-Match")));
    if (path == "/viewer/defaults.json")
        return defaults_page();
    constexpr std::string_view page_folder = "/viewer/";
    constexpr std::string_view gallery_folder = "/viewer/worlds/";
    auto name = path == page_folder      ? std::string_view("viewer/index.html")
                : path == gallery_folder ? std::string_view("viewer/worlds/index.html")
                                         : path.substr(1);
    // The page finds the modules below itself, so that proxies need one rule for both.
    if (path.starts_with("/viewer/view/"))
        name = path.substr(page_folder.size());
    return embedded(name, request);
}

HttpResponse SessionService::Impl::defaults_page() const
{
    return for_any_page(core::json_page(core::viewer_defaults_json(params.config)));
}

/// A file of `src/web`: public, and the same for everybody. Pages of other sites import modules, or learn
/// that a build lacks one; and our own pages have no origin in a sandboxed frame.
Answer SessionService::Impl::embedded(std::string_view name, IncomingRequest const& request)
{
    auto const asset = web::find_asset(name);
    if (!asset)
        return for_any_page(core::not_found_page());
    auto& page = files[asset->content.data()];
    if (page.empty())
        page.set(std::string(asset->content), std::string(asset->gzip));
    // A page that was made of this script or style sheet names it so (cmake/embed_files.cmake).
    constexpr std::string_view version = "v=";
    constexpr std::size_t version_digits = 16;
    bool const is_named =
        request.query.starts_with(version) &&
        request.query.substr(version.size()) == asset->inline_hash.substr(0, version_digits);
    return for_any_page(page.answer(asset->content_type, request.header("If-None-Match"),
                                    is_named ? core::Kept::for_ever : core::Kept::until_asked));
}

/// The page of classes, for teachers and students.
Answer SessionService::Impl::class_page(IncomingRequest const& request)
{
    if (request.path == "/class") {
        HttpResponse response(301, {}, {});
        response.headers.emplace_back("Location", "class/"); // relative, for proxies that rewrite paths
        return response;
    }
    if (request.path == "/class/defaults.json")
        return defaults_page();
    return embedded(core::class_file(request.path), request);
}

bool SessionService::Impl::may_read_decisions(IncomingRequest const& request) const
{
    return params.config.decisions_for_all || request.is_operator;
}

/// Why browsers were sent where they were sent.
Answer SessionService::Impl::decisions(IncomingRequest const&)
{
    return core::json_page(decisions_json(scheduler, clock.now()));
}

/// For pages and programs that want to know whether they may do more than read.
Answer SessionService::Impl::is_operator(IncomingRequest const&)
{
    return core::page("operator");
}

/// `POST /api/drain?machine=sim1:2000`: no browser is sent there, until `&off`.
Answer SessionService::Impl::drain(IncomingRequest const& request)
{
    auto const order = core::parse_drain_order(request.query);
    if (!order)
        return HttpResponse(400, std::string(core::html_type),
                            "Expected /api/drain?machine=<address> or /api/drain?machine=<address>&off.");
    if (!fleet.drain(order->machine, !order->off))
        return HttpResponse(400, std::string(core::html_type),
                            concat("There is no machine ",
                                   core::escape_html(core::printable(order->machine, 200)),
                                   " in \"simulationServers\"."));
    expire_pages();
    if (fleet.find(order->machine)->is_draining() == order->off)
        return HttpResponse(
            409, std::string(core::html_type),
            "The configuration drains this machine, with \"drain\" in \"simulationServers\".");
    log.warning(concat(core::printable(order->machine),
                       order->off ? " gets new sessions again" : " is drained: it gets no new sessions"));
    return core::page(order->off ? "serving" : "draining");
}

Answer SessionService::Impl::metrics(IncomingRequest const&)
{
    auto const servers = monitor.totals();
    core::MetricsText text;
    text.family(core::metric("build_info")).add(1, {{"version", version()}});
    text.family(core::metric("servers"))
        .add(static_cast<double>(servers.up), {{"state", "up"}})
        .add(static_cast<double>(servers.down), {{"state", "down"}})
        .add(static_cast<double>(servers.unknown), {{"state", "unknown"}});
    text.family(core::metric("servers_drained")).add(static_cast<double>(fleet.drained()));
    text.family(core::metric("available")).add(available ? 1 : 0);
    text.family(core::metric("site_state"));
    for (auto const each : core::all_site_states)
        text.add(each == state ? 1 : 0, {{"state", core::word_of(each)}});
    text.family(core::metric("availability_watchers"))
        .add(static_cast<double>(browsers.size() + state_browsers.size()));
    text.family(core::metric("placements_total"))
        .add(static_cast<double>(placed), {{"result", "placed"}})
        .add(static_cast<double>(refused), {{"result", "refused"}})
        .add(static_cast<double>(limited), {{"result", "limited"}});
    auto const of_classes = classes.figures();
    text.family(core::metric("classes")).add(static_cast<double>(of_classes.classes));
    text.family(core::metric("class_students")).add(static_cast<double>(of_classes.students));
    text.family(core::metric("class_seats_held")).add(static_cast<double>(of_classes.seats_held));
    text.family(core::metric("class_pictures_total"))
        .add(static_cast<double>(classes.pictures_relayed()), {{"result", "relayed"}})
        .add(static_cast<double>(classes.pictures_dropped()), {{"result", "dropped"}});
    if (params.config.relay)
        write_relay(text);
    text.family(core::metric("polls_total"))
        .add(static_cast<double>(good_polls), {{"result", "good"}})
        .add(static_cast<double>(failed_polls), {{"result", "failed"}});
    return core::metrics_page(text.take() + machine_metrics.text(), hooks.more_metrics);
}

/// Something has changed that whoever changed it wants to see at once.
void SessionService::Impl::expire_pages()
{
    expire_monitor();
    machine_metrics.expire();
}

void SessionService::Impl::expire_monitor()
{
    monitor_html.expire();
    monitor_json.expire();
    greeting = {};
}

void SessionService::Impl::write_relay(core::MetricsText& text) const
{
    auto const figures = relay.figures();
    text.family(core::metric("waiting")).add(static_cast<double>(figures.waiting));
    text.family(core::metric("waiting_max")).add(static_cast<double>(params.config.waiting_room));
    text.family(core::metric("waiting_longest_seconds"))
        .add(std::chrono::duration<double>(figures.longest_wait).count());
    text.family(core::metric("waiting_seconds")).add(relay.waits());
    text.family(core::metric("waiting_given_up_total")).add(static_cast<double>(figures.given_up));
    text.family(core::metric("waiting_refused_total")).add(static_cast<double>(figures.refused));
    text.family(core::metric("relayed")).add(static_cast<double>(figures.relayed));
    text.family(core::metric("relay_questions_total")).add(static_cast<double>(figures.questions));
    text.family(core::metric("relay_attempts_total"));
    for (auto const& [outcome, count] : figures.attempts)
        text.add(static_cast<double>(count), {{"result", outcome}});
}

core::ForwardingTable const& SessionService::Impl::forwarding_table()
{
    if (!forwarding) {
        forwarding.emplace();
        for (auto const& machine : fleet.machines())
            forwarding->add(machine.spec);
    }
    return *forwarding;
}

/// `/2000` of the path `/2000/client`, where a machine can't know by itself that browsers reach it there;
/// empty otherwise.
std::string SessionService::Impl::path_of_machine(std::string_view path, AskedAddress const& by) const
{
    auto const split = core::split_port_path(path);
    if (!split)
        return {};
    auto const below_us = concat("/", std::to_string(split->port));
    if (core::is_placed_by_proxy(params.address, by))
        return below_us;
    bool const is_at_own_port = !path_below_us(concat(params.address.host, below_us), by).empty();
    return is_at_own_port ? below_us : std::string();
}

/// To the simulation server whose port the path begins with.
std::optional<Answer> SessionService::Impl::pass_on(IncomingRequest const& request)
{
    if (!params.config.gateway)
        return std::nullopt;
    auto target = forwarding_table().find(request.path, request.query);
    if (!target)
        return pass_on_below(request);
    auto forward = to_machine(std::move(*target));
    if (forward.kind == UpstreamKind::simulation) { // as a simulation server's gateway says of them
        forward.answer_headers.emplace_back("Access-Control-Allow-Origin", "*");
        return forward;
    }
    // A machine with our name knows our port, or our path, from us alone.
    auto const by = asked_by(request);
    if (auto const path = path_of_machine(request.path, by); !path.empty())
        forward.headers.emplace_back(core::public_address_header, concat(own_base(by), path));
    return forward;
}

/// What answers there is not ours, but would have the origin of our pages.
Forward SessionService::Impl::to_machine(core::ForwardTarget target)
{
    Forward forward;
    forward.upstream = Upstream(std::move(target.machine.host), target.machine.port);
    forward.upstream.tls = target.machine.tls;
    forward.upstream.name = std::move(target.machine.name);
    forward.upstream.elsewhere = target.is_elsewhere;
    forward.kind = target.kind;
    // A trusted machine says itself which pages are simulations', and which are editors, that need an origin.
    bool const is_behind_its_gateway =
        target.kind != UpstreamKind::simulation && core::is_gateway_path(target.target);
    if (!target.is_trusted || !is_behind_its_gateway)
        forward.added_answer_headers.emplace_back("Content-Security-Policy", core::sandbox_policy);
    if (!target.is_trusted && target.kind != UpstreamKind::simulation)
        forward.headers.emplace_back(core::untrusted_header, "1");
    forward.target = std::move(target.target);
    return forward;
}

/// To a machine with a path of its own. It is called by the name that polls use, which it knows, whatever
/// browsers call us; and its own policy for web pages does not count, since it does not know our name.
std::optional<Answer> SessionService::Impl::pass_on_below(IncomingRequest const& request) const
{
    auto found = paths.find(request.path, request.query);
    if (!found)
        return std::nullopt;
    if (!found->target)
        return HttpResponse(502, std::string(core::html_type),
                            "The simulation server of this address does not answer. Please start again.");
    auto host = core::authority_of(found->target->machine);
    auto forward = to_machine(std::move(*found->target));
    forward.headers.emplace_back("Host", std::move(host));
    forward.headers.emplace_back("Origin", "");
    forward.headers.emplace_back(core::public_address_header,
                                 concat(own_base(asked_by(request)), found->path));
    return forward;
}

Answer SessionService::respond(IncomingRequest const& request)
{
    if (auto answer = impl_->pass_on(request)) {
        // What a machine answers has the site's origin, and would answer for its pages from then on.
        if (std::holds_alternative<Forward>(*answer) && request.header("Service-Worker") == "script")
            return HttpResponse(403, std::string(core::html_type),
                                "Machines can't register service workers for this site.");
        return std::move(*answer);
    }
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
    if (!impl_->may_ask(request.quota_key, impl_->clock.now()))
        co_return for_any_page(
            core::json_page(core::world_list_error(core::refused(core::Refused::too_many_starts))));
    auto const client = std::string(request.quota_key.empty() ? std::string_view() : request.client);
    auto listed = co_await impl_->gallery.look_into(std::string(core::trim(request.body)), client);
    co_return for_any_page(std::move(listed));
}

result<ControllerWay> SessionService::way_of_controller(std::uint16_t machine, std::string_view key,
                                                        std::string_view robot)
{
    for (auto const& each : impl_->fleet.machines()) {
        auto const place = core::parse_internal_address(each.spec.controllers);
        if (!place || machine == 0 || core::port_of_machine(each.spec.address) != machine)
            continue;
        ControllerWay way;
        way.upstream = Upstream(place->host, place->port);
        way.asks_for = core::controller_path(key, robot);
        return way;
    }
    return Failure(errc::refused,
                   "No machine of this site takes controllers at this address: take the whole one "
                   "that the console of the simulation shows.");
}

void SessionService::stopping()
{
    impl_->classes.stop();
    impl_->relay.stop();
    impl_->gallery.stop();
}

/// Not a coroutine itself, as its frame would cost memory for every browser that waits.
asio::awaitable<void> SessionService::serve_websocket(ChannelInfo info, Channel& channel)
{
    if (info.path == "/monitor") {
        // All who connect before the next update get the same text; what has changed since is in that update.
        if (impl_->greeting.empty())
            impl_->greeting = impl_->monitor_snapshot();
        return impl_->feed.serve(impl_->greeting, channel);
    }
    if (info.path == "/client")
        return impl_->relay.serve(std::move(info), channel);
    if (info.path == "/session" && impl_->params.config.relay && impl_->hooks.websockets)
        return impl_->say_place(impl_->own_address(info.asked), channel);
    if (info.path == "/session") {
        auto const now = impl_->clock.now();
        auto const token = core::class_token(info.query);
        auto const get_asked = [&info]() -> AskedAddress const& { return info.asked; };
        auto const seat = impl_->may_ask(info.quota_key, now) ? impl_->classes.ask_for_seat(token, now)
                                                              : core::SeatRequest::too_often;
        return impl_->say_place(seat == core::SeatRequest::too_often
                                    ? session_error(core::Refused::too_many_starts)
                                    : impl_->place(now, token, seat, get_asked),
                                channel);
    }
    if (info.path == "/class")
        return impl_->classes.serve(std::move(info), channel);
    auto name = concat("[", core::printable(info.asked.host, 100), "] ");
    impl_->log.info(LogCause("client"), concat(name, "New client", core::of_client(info.client)));
    return impl_->show_availability(std::move(name), std::move(info), channel);
}

asio::awaitable<void> SessionService::Impl::say_place(std::string text, Channel& channel)
{
    (void)channel.send(std::move(text));
    channel.close(1000);
    co_return;
}

/// `name`: of the browser, for the log.
asio::awaitable<void> SessionService::Impl::show_availability(std::string name, ChannelInfo info,
                                                              Channel& channel)
{
    bool const wants_state = info.query == "state";
    auto const client = std::move(info.client);
    auto& watchers = wants_state ? state_browsers : browsers;
    watchers.insert(&channel);
    (void)channel.send(wants_state ? std::string(core::word_of(state)) : available ? "1" : "0");
    for (;;) {
        auto const message = co_await channel.receive();
        if (!message)
            break;
        log.info(LogCause("message", client),
                 concat(name, "Ignored client message: ", core::printable(*message)));
    }
    watchers.erase(&channel);
    log.info(LogCause("client"), concat(name, "Client disconnected"));
}

} // namespace webots_cloud
