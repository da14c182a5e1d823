#include <webots_cloud/simulation_service.hpp>

#include "../core/client_protocol.hpp"
#include "../core/http_pages.hpp"
#include "../core/load_formula.hpp"
#include "../core/monitor_page.hpp"
#include "../core/monitor_sample.hpp"
#include "../core/repository_policy.hpp"
#include "../core/start_figures.hpp"
#include "../core/simulation_board.hpp"
#include "../core/text.hpp"
#include "../async/cancellation.hpp"
#include "../async/deadline.hpp"
#include "monitor_feed.hpp"

#include <webots_cloud/version.hpp>

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <map>
#include <optional>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

using namespace asio::experimental::awaitable_operators;

constexpr auto usage_interval = std::chrono::seconds(1);
constexpr std::size_t usages_at_once = 25; // a millisecond or two: more would delay other browsers
constexpr auto progress_interval = std::chrono::milliseconds(500);

/// What one browser has, from its `start` to the last cleaned-up byte.
struct Session
{
    enum class State
    {
        fetching,
        launching,
        idle,
        running
    };

    std::uint64_t id = 0;
    std::string url;
    std::string mode;
    State state = State::fetching;
    TimePoint since;
    TimePoint stage_began;
    bool start_over = false; ///< It got ready, or it failed.
    std::optional<Project> project;
    std::unique_ptr<Simulation> simulation;
    bool ended = false; ///< The simulation has reported its end.

    ProcessUsage used;  ///< At the last look.
    TimePoint looked;   ///< When that was; at first when the simulator was started.
    std::optional<double> cpu; ///< Percent of one processor, between the last two looks.
};

std::string_view name_of(Session::State state)
{
    switch (state) {
    case Session::State::fetching:
        return "fetching the project";
    case Session::State::launching:
        return "loading the world";
    case Session::State::idle:
        return "idle";
    case Session::State::running:
        return "running";
    }
    return {};
}

std::string progress_text(FetchProgress const& progress)
{
    auto const total = progress.objects_total.load();
    auto const received = progress.objects_received.load();
    auto const tenths = progress.bytes_received.load() / 100'000;
    auto const megabytes = concat(std::to_string(tenths / 10), ".", std::to_string(tenths % 10), " MB");
    if (total == 0)
        return concat("Receiving objects (", megabytes, ")");
    return concat("Receiving objects ", std::to_string(std::uint64_t{100} * received / total), "% (", megabytes, ")");
}

} // namespace

struct SimulationService::Impl
{
    Impl(SimulationServiceParams parameters, ProjectFetcher& projects, SimulationLauncher& simulators, HostMetrics& host,
         Clock& time, Logger logger) :
        params(std::move(parameters)),
        fetcher(projects), launcher(simulators), metrics(host), clock(time), log(std::move(logger)),
        description(host.description()), last_sample(host.sample()),
        measured(clock.now())
    {
        set_policy(params);
        address.host = params.server;
        address.ssl = params.ssl;
        address.port_rewrite = params.port_rewrite;
    }

    void set_policy(SimulationServiceParams const& next);
    void measure(TimePoint due);
    void look_at_processes();
    std::size_t running() const;
    std::vector<core::SimulationRow> rows() const;
    asio::awaitable<std::optional<core::StartMessage>> await_start(std::uint64_t id, Channel& channel);
    asio::awaitable<void> host(Session& session, Channel& channel);
    asio::awaitable<result<>> fetch(Session& session, Channel& channel);
    asio::awaitable<result<>> show_progress(std::shared_ptr<FetchProgress const> progress, Channel& channel);
    asio::awaitable<result<>> launch(Session& session, Channel& channel);
    asio::awaitable<void> relay(Session& session, Channel& channel);
    asio::awaitable<void> watch(Channel& channel);
    asio::awaitable<void> clean_up(Session& session);
    void refuse(Session& session, Channel& channel, Failure const& failure);
    void tell(Session const& session, Channel& channel, std::string_view error);
    void pass(Session& session, core::StartStage stage);
    LoadReport report() const;
    HttpResponse figures() const;
    HttpResponse drain(IncomingRequest const& request);
    Answer operate(IncomingRequest const& request);
    std::string monitor_snapshot();
    HttpResponse monitor_page(IncomingRequest const& request);

    SimulationServiceParams params;
    ProjectFetcher& fetcher;
    SimulationLauncher& launcher;
    HostMetrics& metrics;
    Clock& clock;
    Logger log;
    core::RepositoryPolicy policy;
    core::PublicAddress address;

    HostDescription description;
    HostSample last_sample;
    TimePoint measured;
    double current_load = 0; ///< The last sample's.
    core::MovingAverage average;

    std::map<std::uint64_t, Session> sessions;
    std::uint64_t last_id = 0;
    std::size_t clients = 0; ///< Browsers on /client, with and without a simulation.

    core::SimulationBoard board;
    MonitorFeed feed; ///< To those that watch the monitor page.
    core::StartFigures starts;
    Duration event_loop_lag{}; ///< How late the last measurement was.
    bool draining = false;
    bool exit_when_empty = false;

    TimePoint looked_at_processes;
    std::uint64_t last_looked_at = 0; ///< The session whose processes were looked at last: they take turns.
};

SimulationService::SimulationService(SimulationServiceParams params, ProjectFetcher& fetcher, SimulationLauncher& launcher,
                                     HostMetrics& metrics, Clock& clock, Logger log) :
    impl_(std::make_unique<Impl>(std::move(params), fetcher, launcher, metrics, clock, std::move(log)))
{}

SimulationService::~SimulationService() = default;

double SimulationService::load() const noexcept { return impl_->average.value(); }

std::size_t SimulationService::sessions() const noexcept { return impl_->sessions.size(); }

void SimulationService::set_policy(SimulationServiceParams const& params)
{
    impl_->params.allowed_repositories = params.allowed_repositories;
    impl_->params.blocked_repositories = params.blocked_repositories;
    impl_->params.share_idle_time = params.share_idle_time;
    impl_->params.title = params.title;
    impl_->params.description = params.description;
    impl_->set_policy(impl_->params);
}

void SimulationService::Impl::set_policy(SimulationServiceParams const& next)
{
    policy.allowed = next.allowed_repositories;
    policy.blocked = next.blocked_repositories;
    policy.share_idle_time = next.share_idle_time;
    policy.docker = next.docker;
}

asio::awaitable<result<>> SimulationService::run()
{
    for (;;) {
        // On whole seconds, so that the lines of monitor.csv of several machines can be laid side by side.
        auto const next = impl_->clock.now() + core::until_next_second(impl_->clock.wall());
        auto const waited = co_await impl_->clock.wait_until(next);
        if (!waited)
            co_return waited;
        impl_->measure(next);
        if (impl_->exit_when_empty && impl_->sessions.empty())
            co_return result<>();
    }
}

void SimulationService::Impl::measure(TimePoint due)
{
    auto const now = clock.now();
    event_loop_lag = now - due;
    auto sample = metrics.sample();
    auto figures = core::machine_figures(last_sample, sample, now - measured);
    measured = now;
    last_sample = std::move(sample);
    auto const formula = params.strict_load ? core::LoadFormula::strict : core::LoadFormula::reference;
    current_load = core::load_of(formula, figures.cpu, last_sample);
    average.add(current_load);

    figures.running = static_cast<int>(running());
    figures.idle = static_cast<int>(clients - running());
    board.take(figures, average.value(), now, clock.wall());
    if (params.monitor_log)
        params.monitor_log(core::monitor_csv_line(clock.wall(), figures));
    if (feed.empty())
        return;
    look_at_processes();
    feed.publish(board.update(rows(), static_cast<std::size_t>(launcher.params().most_simulations)));
}

std::size_t SimulationService::Impl::running() const
{
    return static_cast<std::size_t>(std::count_if(sessions.begin(), sessions.end(), [](auto const& entry) {
        return entry.second.state == Session::State::running;
    }));
}

/// Takes a look at what some simulators consume: those whose turn it is.
void SimulationService::Impl::look_at_processes()
{
    auto const now = clock.now();
    looked_at_processes = now;
    auto next = sessions.upper_bound(last_looked_at);
    for (std::size_t i = 0; i < std::min(usages_at_once, sessions.size()); ++i, ++next) {
        if (next == sessions.end())
            next = sessions.begin();
        last_looked_at = next->first;
        auto& session = next->second;
        if (!session.simulation || session.ended)
            continue;
        auto const used = session.simulation->usage();
        session.cpu = core::process_cpu_percent(session.used.processor, used.processor, now - session.looked);
        session.used = used;
        session.looked = now;
    }
}

std::vector<core::SimulationRow> SimulationService::Impl::rows() const
{
    std::vector<core::SimulationRow> rows;
    for (auto const& [id, session] : sessions) {
        core::SimulationRow row;
        row.id = id;
        row.world = core::short_world(session.url);
        row.state = name_of(session.state);
        row.age = clock.now() - session.since;
        if (session.simulation) {
            row.process = session.simulation->process_id();
            row.cpu = session.cpu;
            if (session.cpu)
                row.memory = static_cast<double>(session.used.memory_bytes) / 1e6;
        }
        rows.push_back(std::move(row));
    }
    return rows;
}

LoadReport SimulationService::Impl::report() const
{
    LoadReport report(average.value());
    report.sessions = static_cast<int>(sessions.size());
    report.starting = static_cast<int>(std::count_if(sessions.begin(), sessions.end(), [](auto const& entry) {
        return entry.second.state == Session::State::fetching || entry.second.state == Session::State::launching;
    }));
    report.capacity = launcher.params().most_simulations;
    report.memory = last_sample.memory_used;
    report.draining = draining;
    return report;
}

std::string SimulationService::Impl::monitor_snapshot()
{
    if (clock.now() - looked_at_processes >= usage_interval)
        look_at_processes();
    return board.snapshot(rows(), static_cast<std::size_t>(launcher.params().most_simulations));
}

HttpResponse SimulationService::Impl::monitor_page(IncomingRequest const& request)
{
    if (request.header("Accept").starts_with("application/json")) // for pages whose proxy lets no WebSocket through
        return core::json_page(monitor_snapshot());
    if (clock.now() - looked_at_processes >= usage_interval)
        look_at_processes();
    core::SimulationMonitorView view;
    view.title = params.title;
    view.description = params.description;
    view.notice = params.notice;
    view.load = average.value();
    view.host = description;
    view.sample = board.sample();
    view.allowed = params.allowed_repositories;
    view.blocked = params.blocked_repositories;
    view.notify = params.notify;
    view.share_idle_time = params.share_idle_time;
    view.capacity = launcher.params().most_simulations;
    view.simulations = rows();
    view.assets = monitor_assets("simulation.js", params.port);
    return core::page(core::simulation_monitor_page(view));
}

HttpResponse SimulationService::Impl::figures() const
{
    core::MetricsText text;
    text.family("build_info", "gauge", "Always 1; the version is the label.").add(1, {{"version", version()}});
    text.family("load_ratio", "gauge", "The load that GET /load answers; 1 is full.").add(average.value() / 100);
    auto const starting = static_cast<double>(report().starting.value_or(0));
    auto const active = static_cast<double>(running());
    text.family("simulations", "gauge", "Simulations by state.")
        .add(starting, {{"state", "starting"}})
        .add(active, {{"state", "running"}})
        .add(static_cast<double>(sessions.size()) - starting - active, {{"state", "idle"}});
    text.family("simulations_most", "gauge", "Simulations that may run at once.").add(launcher.params().most_simulations);
    text.family("fetches_waiting", "gauge", "Fetches that wait for their turn.").add(static_cast<double>(fetcher.waiting()));
    text.family("draining", "gauge", "1 while no new simulation is taken.").add(draining ? 1 : 0);
    text.family("event_loop_lag_seconds", "gauge", "How late the last measurement of the machine was.")
        .add(std::chrono::duration<double>(event_loop_lag).count());
    starts.write(text);
    return core::metrics_page(text.take(), params.more_metrics);
}

/// `POST /api/drain`, with `?exit` to end with the last simulation, or `?off` to go on as before.
HttpResponse SimulationService::Impl::drain(IncomingRequest const& request)
{
    if (request.method != "POST")
        return core::method_not_allowed_page("POST");
    if (!request.is_operators())
        return {403, std::string(core::html_type), "Draining is asked for on this machine only."};
    draining = request.query != "off";
    exit_when_empty = request.query == "exit";
    log.warning(draining ? "Draining: no new simulation is taken" : "New simulations are taken again");
    return core::page(draining ? "draining" : "serving");
}

/// What operators and their tools ask for.
Answer SimulationService::Impl::operate(IncomingRequest const& request)
{
    if (request.path == "/api/drain")
        return drain(request);
    if (request.method != "GET")
        return core::method_not_allowed_page("GET");
    if (request.path == "/metrics")
        return figures();
    if (request.path == "/livez")
        return core::page("alive");
    bool const full = sessions.size() >= static_cast<std::size_t>(launcher.params().most_simulations);
    if (draining || full)
        return HttpResponse(503, std::string(core::html_type), draining ? "draining" : "full");
    return core::page("ready");
}

void SimulationService::drain(bool exit_when_empty)
{
    impl_->draining = true;
    impl_->exit_when_empty = exit_when_empty;
    impl_->log.warning("Draining: no new simulation is taken");
}

Answer SimulationService::respond(IncomingRequest const& request)
{
    auto const& path = request.path;
    if (path == "/metrics" || path == "/livez" || path == "/readyz" || path == "/api/drain")
        return impl_->operate(request);
    bool const known = path == "/client" || path == "/load" || path == "/monitor";
    if (!known)
        return core::not_found_page();
    if (request.method != "GET")
        return core::method_not_allowed_page("GET");
    if (request.path == "/monitor")
        return request.upgrade ? Answer(Converse()) : impl_->monitor_page(request);
    if (request.path == "/load") {
        bool const wants_json = request.header("Accept").find("application/json") != std::string_view::npos;
        return wants_json ? core::json_page(to_json(impl_->report(), version()))
                          : core::page(core::python_float(impl_->average.value()));
    }
    if (request.upgrade)
        return Converse();
    return HttpResponse(400, std::string(core::html_type), "Can \"Upgrade\" only to \"WebSocket\".");
}

asio::awaitable<void> SimulationService::converse(ChannelInfo info, Channel& channel)
{
    if (info.path == "/monitor")
        co_return co_await impl_->feed.serve(impl_->monitor_snapshot(), channel);
    ++impl_->clients;
    auto const id = ++impl_->last_id;
    impl_->log.info(concat("[", std::to_string(id), "] New client"));
    auto start = co_await impl_->await_start(id, channel);
    if (start) {
        auto& session = impl_->sessions[id];
        session.id = id;
        session.url = std::move(start->url);
        session.mode = std::move(start->mode);
        session.since = session.stage_began = impl_->clock.now();
        // Whichever ends first ends the other: the browser's departure, or the simulation.
        co_await (impl_->host(session, channel) || impl_->watch(channel));
        channel.close(); // what was said is still delivered; the browser need not wait for the cleaning up
        if (!session.start_over)
            impl_->starts.abandoned();
        co_await impl_->clean_up(session);
        impl_->sessions.erase(id);
    }
    --impl_->clients;
    impl_->log.info(concat("[", std::to_string(id), "] Client disconnected"));
}

asio::awaitable<std::optional<core::StartMessage>> SimulationService::Impl::await_start(std::uint64_t id, Channel& channel)
{
    auto const deadline = clock.now() + params.handshake_timeout;
    for (;;) {
        auto const text = co_await async::with_deadline(clock, deadline, channel.receive());
        if (!text && text.error() == errc::timed_out)
            (void)channel.send(core::error_message("No simulation was asked for in time: please start again."));
        if (!text)
            co_return std::nullopt;
        auto message = core::parse_client_message(*text);
        if (auto* start = std::get_if<core::StartMessage>(&message))
            co_return std::move(*start);
        if (auto const* malformed = std::get_if<core::MalformedMessage>(&message)) {
            log.warning(concat("[", std::to_string(id), "] Malformed message: ", malformed->reason));
            (void)channel.send(core::error_message(concat("Wrong message: ", malformed->reason, ".")));
            co_return std::nullopt;
        }
    }
}

/// Everything that a browser may still say while its simulation lives. Ends when the browser has gone.
asio::awaitable<void> SimulationService::Impl::watch(Channel& channel)
{
    for (;;) {
        auto const text = co_await channel.receive();
        if (!text)
            co_return;
        if (std::holds_alternative<core::StartMessage>(core::parse_client_message(*text)))
            (void)channel.send(core::error_message("This connection has started a simulation already: open another one."));
    }
}

void SimulationService::Impl::tell(Session const& session, Channel& channel, std::string_view error)
{
    log.error(concat("[", std::to_string(session.id), "] ", core::printable(error)));
    (void)channel.send(core::error_message(error));
}

/// The start has failed.
void SimulationService::Impl::refuse(Session& session, Channel& channel, Failure const& failure)
{
    session.start_over = true;
    starts.failed(failure);
    tell(session, channel, failure.message());
}

/// The start has come through a stage.
void SimulationService::Impl::pass(Session& session, core::StartStage stage)
{
    auto const now = clock.now();
    starts.passed(stage, now - session.stage_began);
    session.stage_began = now;
    session.start_over = stage == core::StartStage::ready;
}

/// Fetch, launch, relay. Cancelled when the browser has gone; cleaning up is the caller's.
asio::awaitable<void> SimulationService::Impl::host(Session& session, Channel& channel)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    log.info(concat("[", std::to_string(session.id), "] Starting simulation from ", core::printable(session.url)));
    auto const fetched = co_await fetch(session, channel);
    if (!fetched) {
        if (fetched.error().code() != asio::error::operation_aborted)
            refuse(session, channel, fetched.error());
        co_return;
    }
    auto const launched = co_await launch(session, channel);
    if (!launched) {
        refuse(session, channel, launched.error());
        co_return;
    }
    bool const cancelled = co_await async::is_cancelled(); // a start can't be cancelled halfway: look now
    if (!cancelled)
        co_await relay(session, channel);
}

asio::awaitable<result<>> SimulationService::Impl::fetch(Session& session, Channel& channel)
{
    auto const ref = fetcher.parse(session.url);
    if (!ref)
        co_return ref.error();
    if (draining)
        co_return Failure(errc::refused, "This simulation server is about to stop. Please start again on another one.");
    if (auto const refused = core::refusal(policy, session.url, current_load))
        co_return Failure(errc::refused, *refused);
    auto progress = std::make_shared<FetchProgress>();
    auto outcome = co_await (fetcher.fetch(*ref, progress) || show_progress(progress, channel));
    if (outcome.index() == 1)
        co_return std::get<1>(outcome).error();
    auto& project = std::get<0>(outcome);
    if (!project)
        co_return project.error();
    session.project = std::move(*project);
    pass(session, core::StartStage::fetch);
    co_return result<>();
}

/// Tells the browser how far the fetch is, while there is something new. Ends only when cancelled.
asio::awaitable<result<>> SimulationService::Impl::show_progress(std::shared_ptr<FetchProgress const> progress,
                                                                 Channel& channel)
{
    std::string last;
    for (;;) {
        auto const waited = co_await clock.wait_until(clock.now() + progress_interval);
        if (!waited)
            co_return waited;
        auto text = progress_text(*progress);
        if (text != last)
            (void)channel.send(core::loading_message(text));
        last = std::move(text);
    }
}

asio::awaitable<result<>> SimulationService::Impl::launch(Session& session, Channel& channel)
{
    session.state = Session::State::launching;
    LaunchSpec spec;
    spec.world = session.project->world;
    spec.world_header = session.project->world_header;
    spec.mode = session.mode;
    spec.label = std::to_string(session.id);
    auto simulation = co_await launcher.launch(std::move(spec));
    if (!simulation)
        co_return simulation.error();
    session.simulation = std::move(*simulation);
    session.looked = clock.now();
    pass(session, core::StartStage::launch);
    auto const timeout = std::chrono::duration_cast<std::chrono::seconds>(launcher.params().timeout);
    (void)channel.send(core::shutdown_timeout_message(timeout.count()));
    co_return result<>();
}

asio::awaitable<void> SimulationService::Impl::relay(Session& session, Channel& channel)
{
    for (;;) {
        auto const event = co_await session.simulation->next_event();
        if (!event)
            co_return;
        if (auto const* ready = std::get_if<SimulationReady>(&*event)) {
            session.state = Session::State::idle;
            pass(session, core::StartStage::ready);
            log.info(concat("[", std::to_string(session.id), "] Webots world is loaded, ready to receive connections"));
            (void)channel.send(core::webots_message(address, ready->port));
        } else if (std::holds_alternative<SimulationHeartbeat>(*event)) {
            (void)channel.send(".");
        } else if (auto const* activity = std::get_if<SimulationActivity>(&*event)) {
            session.state = activity->running ? Session::State::running : Session::State::idle;
        } else {
            session.ended = true;
            auto const& ended = std::get<SimulationEnded>(*event);
            if (ended.was_ready)
                tell(session, channel, ended.reason);
            else
                refuse(session, channel, Failure(errc::start_failed, ended.reason));
            co_return;
        }
    }
}

asio::awaitable<void> SimulationService::Impl::clean_up(Session& session)
{
    auto const name = concat("[", std::to_string(session.id), "] Webots ");
    if (session.simulation) {
        auto const process = concat("[", std::to_string(session.simulation->process_id()), "] ");
        log.info(concat(name, process, session.ended ? "exited" : "was killed"));
        session.simulation->terminate();
        while (!session.ended) {
            auto const event = co_await session.simulation->next_event();
            session.ended = !event || std::holds_alternative<SimulationEnded>(*event);
        }
        session.simulation.reset();
    }
    if (session.project) {
        auto project = std::move(*session.project);
        co_await fetcher.discard(std::move(project));
    }
}

} // namespace webots_cloud
