// Everything that a simulation server tells about itself. The machine is measured once a second (`measure`),
// and pages are made from the last measurement when somebody asks, so that a crowd of watchers costs no more
// than one.
// Decisions: core/load/load_formula, core/access/view_keys.
#include "status_endpoints.hpp"

#include "async/cancellation.hpp"
#include "core/pages/http_pages.hpp"
#include "core/pages/metrics_text.hpp"
#include "core/pages/monitor_page.hpp"
#include "core/pages/monitor_sample.hpp"
#include "core/sandbox/limits.hpp"
#include "core/simulation/gateway_address.hpp"
#include "core/text.hpp"

#include <webots_cloud/version.hpp>

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <functional>
#include <map>
#include <utility>

namespace webots_cloud {
namespace {

constexpr auto usage_interval = std::chrono::seconds(1);
/// A measurement over less than this shows mostly the load of our own start.
constexpr auto shortest_look = std::chrono::milliseconds(500);
constexpr std::size_t usages_at_once = 25; // takes a thread some milliseconds each second

/// The number in `simulation=7`.
std::optional<std::uint64_t> simulation_number(std::string_view query)
{
    constexpr std::string_view name = "simulation=";
    if (!query.starts_with(name))
        return std::nullopt;
    auto const digits = query.substr(name.size());
    std::uint64_t number = 0;
    auto const [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    return error == std::errc() && end == digits.data() + digits.size() ? std::optional(number)
                                                                        : std::nullopt;
}

/// What has gone through the gateway, simulations that have ended included.
struct GatewayTraffic
{
    double tunnels = 0;  ///< Open now. The server has other connections, too.
    double received = 0; ///< Bytes from browsers.
    double sent = 0;
};

GatewayTraffic traffic_of(SessionContext const& context, SimulationSessions const& sessions)
{
    GatewayTraffic traffic;
    traffic.received = static_cast<double>(context.ended_received);
    traffic.sent = static_cast<double>(context.ended_sent);
    for (auto const& [id, session] : sessions)
        if (auto const* tunnels = session->gateway().tunnels()) {
            traffic.tunnels += static_cast<double>(tunnels->open());
            traffic.received += static_cast<double>(tunnels->received());
            traffic.sent += static_cast<double>(tunnels->sent());
        }
    return traffic;
}

} // namespace

StatusEndpoints::StatusEndpoints(SessionContext& context, SimulationSessions const& sessions,
                                 HostMetrics& metrics)
    : context_(context), sessions_(sessions), metrics_(metrics), description_(metrics.description()),
      last_sample_(metrics.sample()), measured_(context.clock.now()),
      view_keys_(context.hooks.new_address_token)
{
    describe_machine();
    context_.cores = description_.cores;
}

void StatusEndpoints::measure(TimePoint due, std::size_t clients)
{
    auto const& clock = context_.clock;
    auto const now = clock.now();
    // This much later than asked for: so long the event loop was busy with something else.
    event_loop_lag_ = now - due;
    event_loop_lags_[measurements_++ % event_loop_lags_.size()] = event_loop_lag_;
    if (now - measured_ < shortest_look)
        return;
    auto sample = metrics_.sample();
    auto figures = core::machine_figures(last_sample_, sample, now - measured_);
    measured_ = now;
    last_sample_ = std::move(sample);
    auto const formula =
        context_.config.reference_load ? core::LoadFormula::reference : core::LoadFormula::strict;
    // Staged simulations go when browsers need the room, so nobody is refused for what they use. Whether more
    // can be staged depends on all that is used.
    context_.memory = last_sample_.memory_used;
    auto without_staged = last_sample_;
    without_staged.memory_used = memory_of_browsers();
    context_.load = core::load_of(formula, cpu_of_browsers(figures.cpu), without_staged);
    average_.add(context_.load);

    figures.running = static_cast<int>(running());
    figures.idle = static_cast<int>(clients - running());
    board_.take(figures, average_.value(), now, clock.wall());
    greeting_ = {};
    if (context_.hooks.monitor_log)
        context_.hooks.monitor_log(core::monitor_csv_line(clock.wall(), figures));
    // Updates go out once processes have been looked at (`look_at_processes`), and only while somebody
    // watches.
    if (feed_.empty() || !look_wanted_)
        return;
    update_due_ = true;
    look_wanted_->notify();
}

template<class Predicate>
std::size_t StatusEndpoints::count(Predicate is_counted) const
{
    return static_cast<std::size_t>(
        std::ranges::count_if(sessions_, [&](auto const& entry) { return is_counted(*entry.second); }));
}

std::size_t StatusEndpoints::running() const
{
    return count([](SimulationSession const& session) {
        return session.stage() == core::SimulationLife::Stage::running && !session.is_staged();
    });
}

/// How many projects are being fetched for later starts.
std::size_t StatusEndpoints::fetches() const
{
    return count([](SimulationSession const& session) { return session.is_fetch_only(); });
}

std::size_t StatusEndpoints::staged() const
{
    return count([](SimulationSession const& session) { return session.is_staged(); });
}

/// Percent of the processors, of which `all` are busy, without what staged simulations use: nobody is refused
/// for that.
double StatusEndpoints::cpu_of_browsers(double all) const
{
    double staged = 0;
    for (auto const& [id, session] : sessions_)
        if (session->is_staged())
            staged += session->usage().processors();
    return description_.cores > 0 ? std::max(0.0, all - 100 * staged / description_.cores) : all;
}

/// Percent that is in use, but for what staged simulations would give back.
double StatusEndpoints::memory_of_browsers() const
{
    double staged = 0;
    for (auto const& [id, session] : sessions_)
        if (session->is_staged())
            staged += static_cast<double>(session->usage().last().memory_bytes);
    auto const all = static_cast<double>(description_.memory_bytes);
    return all > 0 ? std::max(0.0, last_sample_.memory_used - 100 * staged / all) : last_sample_.memory_used;
}

void StatusEndpoints::want_look()
{
    if (look_wanted_ && context_.clock.now() - looked_at_processes_ >= usage_interval)
        look_wanted_->notify();
}

boost::asio::awaitable<result<>> StatusEndpoints::look_at_processes()
{
    auto const executor = co_await boost::asio::this_coro::executor;
    co_await boost::asio::this_coro::throw_if_cancelled(false);
    look_wanted_.emplace(executor);
    for (;;) {
        bool const cancelled = co_await async::is_cancelled(); // also during a look, which is not cancellable
        if (cancelled)
            co_return Failure(boost::asio::error::operation_aborted);
        auto const wanted = co_await look_wanted_->wait();
        if (!wanted)
            co_return wanted;
        bool const update_due = std::exchange(update_due_, false);
        auto const now = context_.clock.now();
        if (update_due || now - looked_at_processes_ >= usage_interval) { // several may have asked at once
            looked_at_processes_ = now;
            co_await look_at_some();
        }
        if (update_due)
            feed_.publish(board_.update(rows(), machine(), context_.state.is_draining()));
    }
}

/// Measures what some of the simulators consume: they take turns.
boost::asio::awaitable<void> StatusEndpoints::look_at_some()
{
    if (context_.launcher.facts().limits.any())
        co_return; // they are looked at every second, whether anybody watches or not
    for (std::size_t i = std::min(usages_at_once, sessions_.size()); i > 0; --i) {
        auto next = sessions_.upper_bound(last_looked_at_);
        if (next == sessions_.end())
            next = sessions_.begin();
        if (next == sessions_.end()) // the last one has ended meanwhile
            co_return;
        last_looked_at_ = next->first;
        auto const session = next->second;
        co_await session->usage().look_at_processes();
    }
}

/// A person who has just been told of a simulation finds it on the page, which is otherwise made once a
/// second. Those who watch by WebSocket are told of it within a second.
void StatusEndpoints::expire_old_pages()
{
    if (std::exchange(shown_changes_, context_.changes) == context_.changes)
        return;
    monitor_html_.expire();
    monitor_json_.expire();
}

void StatusEndpoints::refresh_pages()
{
    describe_machine();
    monitor_html_.expire();
    monitor_json_.expire();
    greeting_ = {};
}

std::vector<core::SimulationRow> StatusEndpoints::rows() const
{
    std::vector<core::SimulationRow> rows;
    for (auto const& [id, session] : sessions_)
        rows.push_back(session->row());
    return rows;
}

std::size_t StatusEndpoints::capacity() const
{
    return static_cast<std::size_t>(context_.admission.max_simulations());
}

LoadReport StatusEndpoints::report() const
{
    // Fetches for later starts are no sessions, which session servers send here and count; but they hold
    // places. Staged simulations hold none.
    auto const fetches = static_cast<int>(this->fetches());
    LoadReport report(average_.value());
    report.sessions = static_cast<int>(sessions_.size() - staged()) - fetches;
    report.starting = static_cast<int>(count([](SimulationSession const& session) {
                          return session.is_starting() && !session.is_staged();
                      })) -
                      fetches;
    report.capacity = std::max(0, context_.admission.max_simulations() - fetches);
    report.memory = memory_of_browsers();
    report.draining = context_.state.is_draining();
    report.arrivals = static_cast<std::int64_t>(context_.start_figures.arrivals());
    report.failed = static_cast<std::int64_t>(context_.start_figures.lost());
    report.departures = *report.arrivals - *report.sessions;
    report.labels = context_.facts.labels;
    if (description_.cores > 0) {
        report.processors = description_.cores;
        report.worlds = worlds();
        if (description_.memory_bytes > 0)
            report.memory_bytes = static_cast<double>(description_.memory_bytes);
        if (description_.graphics_processors > 0)
            report.graphics_processors = description_.graphics_processors;
    }
    report.projects = context_.fetcher.cached();
    // One seat is always left for browsers that come without a class.
    int const for_classes =
        std::min(context_.config.staged_for_classes, context_.admission.max_simulations() - 1);
    if (for_classes > 0 && !report.draining)
        report.staging = for_classes;
    return report;
}

/// What simulations use, by world: those of which most are here, if there are too many.
std::vector<WorldUse> StatusEndpoints::worlds() const
{
    std::map<std::uint64_t, WorldUse> uses;
    for (auto const& [id, session] : sessions_) {
        if (session->is_staged())
            continue; // paused, it says little about what the world uses
        auto const key = session->world_key();
        auto& use = uses[key.world];
        use.key = key;
        if (session->is_starting()) {
            ++use.starting;
        } else if (session->usage().is_measured()) {
            ++use.running;
            use.processors += session->usage().processors();
            use.memory += static_cast<double>(session->usage().last().memory_bytes);
            use.graphics += session->usage().graphics_processors();
        }
    }
    std::vector<WorldUse> worlds;
    auto const simulations = [](WorldUse const& use) { return use.running + use.starting; };
    for (auto const& [world, use] : uses)
        if (simulations(use) > 0)
            worlds.push_back(use);
    std::ranges::stable_sort(worlds, std::greater<>(), simulations);
    worlds.resize(std::min(worlds.size(), LoadReport::max_worlds));
    return worlds;
}

/// What the monitor page shows of it beside what is measured once a second.
std::vector<core::MachineFigure> StatusEndpoints::machine() const
{
    std::vector<core::MachineFigure> figures{{"capacity", static_cast<double>(capacity())}};
    if (context_.launcher.config().gateway)
        figures.push_back({"sent", traffic_of(context_, sessions_).sent});
    return figures;
}

std::string StatusEndpoints::monitor_snapshot()
{
    want_look();
    return board_.snapshot(rows(), machine(), context_.state.is_draining());
}

Answer StatusEndpoints::monitor_page(IncomingRequest const& request)
{
    expire_old_pages();
    auto const now = context_.clock.now();
    auto const known = request.header("If-None-Match");
    // Asked by a page behind a proxy that blocks WebSockets.
    if (request.header("Accept").starts_with("application/json")) {
        auto const make = [this] { return monitor_snapshot(); };
        return monitor_json_.get(now, make).answer("application/json", known);
    }
    want_look();
    auto const make = [this] { return monitor_text(); };
    return monitor_html_.get(now, make).answer(core::html_type, known);
}

/// The same for a page that has no origin, to which browsers give no password: it has been told a key.
Answer StatusEndpoints::watch_by_key(IncomingRequest const& request)
{
    expire_old_pages();
    auto const now = context_.clock.now();
    if (!view_keys_.knows(request.path.substr(core::watch_folder.size()), now)) {
        HttpResponse old(410, std::string(core::html_type), "This page is out of date. Please reload it.");
        old.headers.emplace_back("Access-Control-Allow-Origin", "*");
        return old;
    }
    if (request.upgrade)
        return AcceptWebSocket();
    auto const make = [this] { return monitor_snapshot(); };
    auto shown = monitor_json_.get(now, make).answer("application/json", request.header("If-None-Match"));
    shown.headers.emplace_back("Access-Control-Allow-Origin", "*");
    return shown;
}

std::string StatusEndpoints::monitor_text()
{
    core::MonitorPage page;
    page.title = "Webots simulation server";
    page.heading = context_.config.title;
    page.words = core::simulation_words(average_.value());
    page.snapshot = monitor_snapshot();
    page.assets = monitor_assets("simulation.js", context_.facts.address.port);
    page.assets.key = view_keys_.current(context_.clock.now());
    return core::monitor_page(page);
}

void StatusEndpoints::describe_machine()
{
    core::SimulationAbout about;
    about.title = context_.config.title;
    about.description = context_.config.description;
    about.notices = {context_.facts.notice, context_.facts.isolation_warning, context_.facts.limits_warning};
    about.sandbox = context_.facts.sandbox;
    about.display = context_.facts.display;
    about.host = description_;
    about.allowed = context_.config.repositories.allowed;
    about.blocked = context_.config.repositories.blocked;
    about.registries = context_.config.notify;
    about.share_idle_time = context_.config.repositories.share_idle_time;
    board_.describe(core::about_json(about));
}

boost::asio::awaitable<void> StatusEndpoints::watch(Channel& channel)
{
    want_look();
    // All who connect before the next update, at most a second away, get the same text.
    if (greeting_.empty())
        greeting_ = monitor_snapshot();
    return feed_.serve(greeting_, channel);
}

Answer StatusEndpoints::metrics_answer(IncomingRequest const&)
{
    core::MetricsText text;
    text.family(core::metric("build_info")).add(1, {{"version", version()}});
    text.family(core::metric("load_ratio")).add(average_.value() / 100);
    text.family(core::metric("memory_used_ratio")).add(last_sample_.memory_used / 100);
    text.family(core::metric("disk_used_ratio")).add(last_sample_.disk_used / 100);
    // Fetches for later starts and staged simulations are sessions, but no simulations of browsers.
    auto const starting = static_cast<double>(report().starting.value_or(0));
    auto const active = static_cast<double>(running());
    text.family(core::metric("simulations"))
        .add(starting, {{"state", "starting"}})
        .add(active, {{"state", "running"}})
        .add(static_cast<double>(sessions_.size() - fetches() - staged()) - starting - active,
             {{"state", "idle"}});
    text.family(core::metric("simulations_staged"))
        .add(static_cast<double>(
            count([](SimulationSession const& session) { return session.is_staged_and_ready(); })));
    text.family(core::metric("staged_taken_total")).add(static_cast<double>(context_.staged_taken));
    text.family(core::metric("simulations_max")).add(static_cast<double>(capacity()));
    text.family(core::metric("draining")).add(context_.state.is_draining() ? 1 : 0);
    text.family(core::metric("event_loop_lag_seconds"))
        .add(std::chrono::duration<double>(event_loop_lag_).count());
    // Prometheus asks less often than we measure: a single stop would hardly ever show in the last lag.
    auto const highest = *std::max_element(event_loop_lags_.begin(), event_loop_lags_.end());
    text.family(core::metric("event_loop_lag_max_seconds"))
        .add(std::chrono::duration<double>(highest).count());
    text.family(core::metric("simulations_isolated")).add(context_.facts.isolation_warning.empty() ? 1 : 0);
    if (context_.launcher.facts().limits.any())
        write_consumption(text);
    text.family(core::metric("simulations_graphics_processors"));
    if (description_.graphics_processors > 0) { // else nothing is known of them
        double busy = 0;
        for (auto const& [id, session] : sessions_)
            busy += session->usage().graphics_processors();
        text.add(busy);
    }
    if (context_.launcher.config().gateway)
        write_traffic(text);
    context_.start_figures.write(text);
    context_.fetch_figures.write(text);
    return core::metrics_page(text.take(), context_.hooks.more_metrics);
}

void StatusEndpoints::write_traffic(core::MetricsText& text) const
{
    auto const traffic = traffic_of(context_, sessions_);
    text.family(core::metric("gateway_connections")).add(traffic.tunnels);
    text.family(core::metric("gateway_bytes_total"))
        .add(traffic.received, {{"from", "browsers"}})
        .add(traffic.sent, {{"from", "simulations"}});
}

/// What simulations use, all together, and how many wanted more than they may have.
void StatusEndpoints::write_consumption(core::MetricsText& text) const
{
    double memory = 0;
    double processes = 0;
    double processors = 0;
    for (auto const& [id, session] : sessions_) {
        memory += static_cast<double>(session->usage().last().memory_bytes);
        processes += static_cast<double>(session->usage().last().processes);
        processors += session->usage().processors();
    }
    text.family(core::metric("simulations_memory_bytes")).add(memory);
    text.family(core::metric("simulations_processes")).add(processes);
    text.family(core::metric("simulations_processors")).add(processors);
    text.family(core::metric("simulations_over_limit_total"));
    for (auto const limit : {Limit::memory, Limit::processes, Limit::disk, Limit::build}) {
        auto const found = context_.overruns.find(limit);
        text.add(found == context_.overruns.end() ? 0 : static_cast<double>(found->second),
                 {{"limit", core::label_of(limit)}});
    }
}

/// `POST /api/drain`; with `?exit` the server ends with the last simulation, with `?off` it accepts
/// simulations again.
Answer StatusEndpoints::drain_answer(IncomingRequest const& request)
{
    if (request.query != "" && request.query != "exit" && request.query != "off")
        return HttpResponse(400, std::string(core::html_type),
                            "Expected /api/drain, /api/drain?exit or /api/drain?off.");
    if (request.query != "off") {
        drain(request.query == "exit");
        return core::page("draining");
    }
    context_.state.serve();
    refresh_pages();
    context_.log.warning("New simulations are taken again");
    return core::page("serving");
}

void StatusEndpoints::drain(bool exit_when_empty)
{
    context_.state.drain(exit_when_empty);
    refresh_pages();
    context_.log.warning("Draining: no new simulation is taken");
}

/// `POST /api/end?simulation=7`, with its number on the monitor page.
Answer StatusEndpoints::end_answer(IncomingRequest const& request)
{
    auto const id = simulation_number(request.query);
    if (!id)
        return HttpResponse(400, std::string(core::html_type),
                            "Expected the number of a simulation, as in /api/end?simulation=3.");
    auto const found = sessions_.find(*id);
    if (found == sessions_.end() || !found->second->end_by_operator())
        return HttpResponse(410, std::string(core::html_type),
                            core::concat("There is no simulation ", std::to_string(*id), " any more."));
    return core::page("ending");
}

/// For pages and programs that want to know whether they may do more than read.
Answer StatusEndpoints::operator_answer(IncomingRequest const&)
{
    return core::page("operator");
}

Answer StatusEndpoints::liveness(IncomingRequest const&)
{
    return core::page("alive");
}

bool StatusEndpoints::takes_simulations() const
{
    return !context_.state.is_draining() && !context_.admission.is_full();
}

Answer StatusEndpoints::readiness(IncomingRequest const& request)
{
    if (!takes_simulations())
        return HttpResponse(503, std::string(core::html_type),
                            context_.state.is_draining() ? "draining" : "full");
    bool const wants_json = request.header("Accept").find("application/json") != std::string_view::npos;
    return core::readiness_page(context_.facts.isolation_warning, wants_json);
}

Answer StatusEndpoints::load_answer(IncomingRequest const& request)
{
    bool const wants_json = request.header("Accept").find("application/json") != std::string_view::npos;
    if (wants_json)
        want_look(); // for the next report
    return wants_json ? core::json_page(to_json(report(), version()))
                      : core::page(core::python_float(average_.value()));
}

std::span<Route<StatusEndpoints> const> StatusEndpoints::routes()
{
    using core::Methods;
    using Self = StatusEndpoints;
    using enum Upgrade;
    static constexpr auto table = std::to_array<Route<StatusEndpoints>>({
        // clang-format off
        {"/load",         Methods::read, everybody,           ignored,  &Self::load_answer},
        {"/monitor",      Methods::read, everybody,           accepted, &Self::monitor_page},
        {"/monitor/*",    Methods::read, everybody,           ignored,  &Self::watch_by_key},
        {"/metrics",      Methods::read, everybody,           ignored,  &Self::metrics_answer},
        {"/livez",        Methods::read, everybody,           ignored,  &Self::liveness},
        {"/livez/",       Methods::read, everybody,           ignored,  &Self::liveness},
        {"/readyz",       Methods::read, everybody,           ignored,  &Self::readiness},
        {"/readyz/",      Methods::read, everybody,           ignored,  &Self::readiness},
        {"/api/operator", Methods::read, &Self::is_operators, ignored,  &Self::operator_answer},
        {"/api/drain",    Methods::post, &Self::is_operators, ignored,  &Self::drain_answer},
        {"/api/end",      Methods::post, &Self::is_operators, ignored,  &Self::end_answer},
        // clang-format on
    });
    return table;
}

bool StatusEndpoints::serves(std::string_view path) noexcept
{
    return route_table::find(routes(), path) != nullptr;
}

Answer StatusEndpoints::answer(IncomingRequest const& request)
{
    return route_table::respond(routes(), *this, request);
}

} // namespace webots_cloud
