#include "gate.hpp"
#include "service/setups.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"
#include "service/simulations/stager.hpp"
#include "service/simulations/status_endpoints.hpp"

#include <webots_cloud/testing/fixed_metrics.hpp>
#include <webots_cloud/testing/loopback_channel.hpp>
#include <webots_cloud/testing/memory_project_source.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/scripted_processes.hpp>
#include <webots_cloud/testing/world.hpp>

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <array>
#include <optional>

using namespace webots_cloud;
using namespace std::chrono_literals;
namespace asio = boost::asio;

BOOST_AUTO_TEST_SUITE(status_endpoints)

namespace {

ProjectFetcherParams fetcher_params()
{
    ProjectFetcherParams params;
    params.instances = "/instances";
    return params;
}

LauncherSetup launcher_setup(int max_simulations)
{
    LauncherSetup setup;
    setup.facts.webots = "/opt/webots/webots";
    setup.config.max_simulations = max_simulations;
    return setup;
}

core::AdmissionLimits admission_limits(int max_simulations)
{
    core::AdmissionLimits limits;
    limits.max_simulations = max_simulations;
    return limits;
}

asio::awaitable<ProcessUsage> usage_behind(Gate& gate)
{
    co_await gate.pass();
    co_return ProcessUsage();
}

/// What it consumes is known when the gate is open.
class GatedProcess final : public Process
{
public:
    GatedProcess(std::unique_ptr<Process> process, Gate& gate) : process_(std::move(process)), gate_(gate) {}

    int id() const noexcept override { return process_->id(); }
    asio::awaitable<result<ProcessEvent>> next_event() override { return process_->next_event(); }
    void terminate() noexcept override { process_->terminate(); }
    asio::awaitable<std::uint16_t> listening_port(std::uint16_t first, std::uint16_t last) override
    {
        return process_->listening_port(first, last);
    }
    asio::awaitable<ProcessUsage> usage() override
    {
        return gate_.is_open() ? process_->usage() : usage_behind(gate_);
    }

private:
    std::unique_ptr<Process> process_;
    Gate& gate_;
};

class GatedProcesses final : public ProcessHost
{
public:
    GatedProcesses(ProcessHost& processes, Gate& gate) : processes_(processes), gate_(gate) {}

    asio::awaitable<result<std::unique_ptr<Process>>> start(ProcessSpec spec) override
    {
        auto started = co_await processes_.start(std::move(spec));
        if (!started)
            co_return started.error();
        co_return std::make_unique<GatedProcess>(std::move(*started), gate_);
    }
    result<std::unique_ptr<PortHold>> hold_port(std::uint16_t port) override
    {
        return processes_.hold_port(port);
    }

private:
    ProcessHost& processes_;
    Gate& gate_;
};

/// Operator endpoints over sessions that the test makes; the machine is sampled when the test calls
/// `measure`.
struct Fixture
{
    explicit Fixture(ServiceSetup given = {}, int max_simulations = 4)
        : Fixture(std::move(given), SimulationServiceHooks(), max_simulations)
    {}

    explicit Fixture(SimulationServiceHooks hooks) : Fixture(ServiceSetup(), std::move(hooks), 4) {}

    Fixture(ServiceSetup given, SimulationServiceHooks service_hooks, int max_simulations)
        : setup(std::move(given)), hooks(std::move(service_hooks)),
          fetcher(fetcher_params(), {Forge("https://github.com", source)}, log.logger()),
          launcher(launcher_setup(max_simulations).config, launcher_setup(max_simulations).facts,
                   gated_processes, world.clock, log.logger()),
          context(setup.config, setup.facts, hooks, fetcher, launcher, world.clock, log.logger(),
                  admission_limits(max_simulations))
    {
        source.add("o/r", "a.wbt");
        context.policy.rules.allowed = {"https://github.com/o"};
        context.stager = &stager;
        endpoints.emplace(context, sessions, metrics);
    }

    ~Fixture()
    {
        for (auto const& browser : browsers)
            browser->browser_leaves();
        world.run(conversations.join());
        tasks.cancel_all();
        world.run(tasks.join());
        BOOST_TEST(launcher.running() == 0u);
        BOOST_TEST(source.directories().empty());
        BOOST_TEST(world.clock.pending() == 0u);
    }

    HttpResponse ask(std::string_view method, std::string_view path, std::string_view query = {},
                     bool is_operator = false)
    {
        IncomingRequest request;
        request.method = method;
        request.path = path;
        request.query = query;
        request.is_operator = is_operator;
        return std::get<HttpResponse>(endpoints->answer(request));
    }

    HttpResponse get(std::string_view path, std::string_view header = {}, std::string_view value = {})
    {
        std::pair<std::string_view, std::string_view> const headers[] = {{header, value}};
        IncomingRequest request;
        request.method = "GET";
        request.path = path;
        request.headers = headers;
        return std::get<HttpResponse>(endpoints->answer(request));
    }

    LoadReport report()
    {
        return parse_load_report(get("/load", "Accept", "application/json").text()).value();
    }

    /// Whether `GET /metrics` has this line.
    bool shows(std::string const& line)
    {
        return ("\n" + get("/metrics").text()).find("\n" + line + "\n") != std::string::npos;
    }

    /// Lets a second pass, in which the processor was busy for `cpu` percent, and samples the machine.
    void measure(std::uint64_t cpu = 0, Duration lag = {})
    {
        metrics.cpu = cpu;
        world.advance(1s);
        endpoints->measure(world.clock.now() - lag, sessions.size());
        world.settle();
    }

    testing::LoopbackChannel& browser()
    {
        return *browsers.emplace_back(std::make_unique<testing::LoopbackChannel>(world.executor()));
    }

    /// A session that has not begun to fetch.
    SimulationSession& add_session(std::string url = "https://github.com/o/r/blob/main/worlds/a.wbt")
    {
        auto const id = sessions.size() + 1;
        core::StartMessage start;
        start.url = std::move(url);
        start.mode = "x3d";
        return *(sessions[id] =
                     std::make_shared<SimulationSession>(context, world.executor(), id, "", start));
    }

    testing::LoopbackChannel& run(SimulationSession& session)
    {
        auto& channel = browser();
        conversations.spawn(session.run(channel));
        world.settle();
        return channel;
    }

    testing::LoopbackChannel& watch()
    {
        auto& channel = browser();
        conversations.spawn(endpoints->watch(channel));
        world.settle();
        return channel;
    }

    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedProcesses processes{world.clock};
    Gate gate{world.executor()};
    GatedProcesses gated_processes{processes, gate};
    testing::MemoryProjectSource source{world.clock};
    testing::FixedMetrics metrics;
    ServiceSetup setup;
    SimulationServiceHooks hooks;
    ProjectFetcher fetcher;
    SimulationLauncher launcher;
    SessionContext context;
    SimulationSessions sessions;
    Stager stager{context, sessions, [] { return 0u; }};
    std::optional<StatusEndpoints> endpoints;
    std::vector<std::unique_ptr<testing::LoopbackChannel>> browsers;
    async::TaskGroup conversations{world.executor()}; ///< End when their browser leaves.
    async::TaskGroup tasks{world.executor()};
};

using Ended = std::optional<result<>>;

asio::awaitable<void> look_at_processes(StatusEndpoints& endpoints, Ended& ended)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto outcome = co_await endpoints.look_at_processes();
    ended.emplace(std::move(outcome));
}

bool has(std::string const& text, std::string_view part)
{
    return text.find(part) != std::string::npos;
}

} // namespace

BOOST_AUTO_TEST_CASE(only_its_own_paths_to_the_letter_are_served)
{
    for (auto const path : {"/load", "/monitor", "/monitor/key", "/metrics", "/livez", "/readyz",
                            "/api/drain", "/api/end", "/api/operator"})
        BOOST_TEST(StatusEndpoints::serves(path), path);
    for (auto const path : {"", "/", "/load/", "/Load", "/client", "/session", "/api", "/api/drain/"})
        BOOST_TEST(!StatusEndpoints::serves(path), path);
}

BOOST_AUTO_TEST_CASE(a_page_without_origin_keeps_itself_current_by_its_key)
{
    SimulationServiceHooks hooks;
    hooks.new_address_token = [n = 0]() mutable { return "key" + std::to_string(++n); };
    Fixture fixture(std::move(hooks));
    auto const shown = fixture.get("/monitor").text();
    BOOST_TEST(has(shown, "data-key=\"key1\""));
    auto const current = fixture.get("/monitor/key1");
    BOOST_TEST(current.status == 200);
    BOOST_TEST(current.content_type == "application/json");
    BOOST_TEST(
        (current.headers.back() == std::pair<std::string, std::string>("Access-Control-Allow-Origin", "*")));
    IncomingRequest handshake;
    handshake.method = "GET";
    handshake.path = "/monitor/key1";
    handshake.upgrade = true;
    BOOST_TEST(std::holds_alternative<AcceptWebSocket>(fixture.endpoints->answer(handshake)));
    for (auto const* wrong : {"/monitor/", "/monitor/key2", "/monitor/key1/", "/monitor/KEY1"}) {
        auto const refused = fixture.get(wrong);
        BOOST_TEST(refused.status == 410, wrong);
        // So the page learns that it has to be loaded again.
        BOOST_TEST((refused.headers == HttpHeaders{{"Access-Control-Allow-Origin", "*"}}));
        handshake.path = wrong;
        BOOST_TEST(std::holds_alternative<HttpResponse>(fixture.endpoints->answer(handshake)), wrong);
    }
}

BOOST_AUTO_TEST_CASE(what_only_answers_may_only_be_read)
{
    Fixture fixture;
    for (auto const path : {"/load", "/monitor", "/metrics", "/livez", "/readyz"})
        for (auto const method : {"POST", "PUT", "DELETE", "OPTIONS", "get"}) {
            auto const answer = fixture.ask(method, path);
            BOOST_TEST(answer.status == 405, method << " " << path);
            BOOST_TEST_REQUIRE(answer.headers.size() == 1u);
            BOOST_TEST((answer.headers[0] == std::pair<std::string, std::string>("Allow", "GET, HEAD")));
        }
}

BOOST_AUTO_TEST_CASE(it_lives_whatever_the_state_and_is_ready_while_a_simulation_could_be_started)
{
    Fixture fixture;
    auto const check = [&](int status, std::string const& body) {
        BOOST_TEST(fixture.get("/livez").status == 200);
        BOOST_TEST(fixture.get("/livez").text() == "alive");
        BOOST_TEST(fixture.get("/readyz").status == status);
        BOOST_TEST(fixture.get("/readyz").text() == body);
    };
    check(200, "ready");
    std::array<core::Admission::Place, 4> places;
    for (auto& place : places) {
        check(200, "ready");
        BOOST_TEST_REQUIRE(
            (fixture.context.admission.admit({}, {}, place) == core::Admission::Verdict::admitted));
    }
    check(503, "full");
    fixture.endpoints->drain(false);
    check(503, "draining");
    for (auto& place : places)
        place.release();
    check(503, "draining");
}

BOOST_AUTO_TEST_CASE(what_keeps_simulations_apart_and_is_missing_makes_nobody_unready_but_is_said_as_text)
{
    ServiceSetup setup;
    setup.facts.isolation_warning = "no <namespaces>";
    Fixture fixture(setup);
    BOOST_TEST(fixture.get("/readyz").status == 200);
    BOOST_TEST(fixture.get("/readyz").text() == "ready, but: no &lt;namespaces&gt;");
    BOOST_TEST(fixture.shows("webots_simulations_isolated 0"));
    BOOST_TEST(fixture.get("/readyz", "Accept", "application/json").text() ==
               R"({"ready":true,"but":"no <namespaces>"})");
}

// Others than the operator must not even learn that the path exists.
BOOST_AUTO_TEST_CASE(only_the_operator_drains_and_only_by_a_request_that_is_meant)
{
    Fixture fixture;
    for (auto const method : {"GET", "POST"})
        BOOST_TEST(fixture.ask(method, "/api/drain").status == 404, method);
    auto const read = fixture.ask("GET", "/api/drain", "", true);
    BOOST_TEST(read.status == 405);
    BOOST_TEST_REQUIRE(read.headers.size() == 1u);
    BOOST_TEST((read.headers[0] == std::pair<std::string, std::string>("Allow", "POST")));
    for (auto const query : {"exit=1", "EXIT", "on", "exit&off"}) {
        auto const wrong = fixture.ask("POST", "/api/drain", query, true);
        BOOST_TEST(wrong.status == 400, query);
        BOOST_TEST(wrong.text() == "Expected /api/drain, /api/drain?exit or /api/drain?off.");
    }
    BOOST_TEST(!fixture.context.state.is_draining());
    BOOST_TEST(fixture.log.lines.empty());
}

BOOST_AUTO_TEST_CASE(the_operator_is_told_so_and_nobody_else)
{
    Fixture fixture;
    BOOST_TEST(fixture.ask("GET", "/api/operator").status == 404);
    BOOST_TEST(fixture.ask("GET", "/api/operator", "", true).text() == "operator");
    BOOST_TEST(fixture.ask("POST", "/api/operator", "", true).status == 405);
}

BOOST_AUTO_TEST_CASE(a_drained_server_has_finished_when_it_was_asked_to_and_nobody_is_left)
{
    Fixture fixture;
    BOOST_TEST(!fixture.endpoints->has_finished());
    fixture.add_session();
    BOOST_TEST(fixture.ask("POST", "/api/drain", "exit", true).text() == "draining");
    BOOST_TEST(fixture.context.state.is_draining());
    BOOST_TEST(fixture.report().draining);
    BOOST_TEST(fixture.shows("webots_draining 1"));
    BOOST_TEST(has(fixture.get("/monitor").text(), "\"draining\":true"));
    BOOST_TEST(has(fixture.get("/monitor", "Accept", "application/json").text(), "\"draining\":true"));
    BOOST_TEST(fixture.log.contains("Draining: no new simulation is taken"));
    BOOST_TEST(!fixture.endpoints->has_finished());
    fixture.sessions.clear();
    BOOST_TEST(fixture.endpoints->has_finished());
    // A drain that does not ask for an exit leaves the server running.
    BOOST_TEST(fixture.ask("POST", "/api/drain", "", true).text() == "draining");
    BOOST_TEST(fixture.context.state.is_draining());
    BOOST_TEST(!fixture.endpoints->has_finished());
}

BOOST_AUTO_TEST_CASE(a_drain_that_is_taken_back_leaves_nothing_of_itself)
{
    Fixture fixture;
    fixture.endpoints->drain(true);
    BOOST_TEST(fixture.ask("POST", "/api/drain", "off", true).text() == "serving");
    BOOST_TEST(!fixture.context.state.is_draining());
    BOOST_TEST(!fixture.endpoints->has_finished());
    BOOST_TEST(fixture.get("/readyz").status == 200);
    BOOST_TEST(fixture.shows("webots_draining 0"));
    BOOST_TEST(!has(fixture.get("/monitor").text(), "\"draining\":true"));
    BOOST_TEST(!has(fixture.get("/monitor", "Accept", "application/json").text(), "\"draining\""));
    BOOST_TEST(fixture.log.contains("New simulations are taken again"));
}

BOOST_AUTO_TEST_CASE(load_is_the_mean_of_some_looks_and_policy_gets_the_last)
{
    Fixture fixture;
    BOOST_TEST(fixture.get("/load").text() == "0.0");
    fixture.measure(100);
    fixture.measure(20);
    BOOST_TEST(fixture.endpoints->load() == 60);
    BOOST_TEST(fixture.get("/load").text() == "60.0");
    BOOST_TEST(fixture.context.load == 20);
    BOOST_TEST(fixture.shows("webots_load_ratio 0.6"));
}

BOOST_AUTO_TEST_CASE(two_looks_within_half_a_second_are_one)
{
    Fixture fixture;
    fixture.measure(10);
    auto const seen = fixture.metrics.next.cpu_total;
    fixture.metrics.cpu = 100;
    fixture.world.advance(499ms);
    fixture.endpoints->measure(fixture.world.clock.now(), 0);
    BOOST_TEST(fixture.metrics.next.cpu_total == seen);
    BOOST_TEST(fixture.endpoints->load() == 10);
    fixture.world.advance(1ms);
    fixture.endpoints->measure(fixture.world.clock.now(), 0);
    BOOST_TEST(fixture.metrics.next.cpu_total > seen);
    BOOST_TEST(fixture.context.load == 100);
}

BOOST_AUTO_TEST_CASE(the_report_counts_sessions_starts_and_those_who_came_and_left)
{
    Fixture fixture;
    fixture.metrics.next.memory_used = 12.5;
    fixture.setup.facts.labels = {"gpu"};
    fixture.processes.expect().prints(".\n");
    fixture.add_session();
    fixture.run(fixture.add_session());
    fixture.measure();
    auto const report = fixture.report();
    BOOST_TEST(report.sessions.value() == 2);
    BOOST_TEST(report.starting.value() == 1);
    BOOST_TEST(report.capacity.value() == 4);
    BOOST_TEST(report.memory.value() == 12.5);
    BOOST_TEST(!report.draining);
    BOOST_TEST(report.arrivals.value() == 2);
    BOOST_TEST(report.departures.value() == 0);
    BOOST_TEST((report.labels == std::vector<std::string>{"gpu"}));
    fixture.sessions.erase(1);
    BOOST_TEST(fixture.report().departures.value() == 1);
}

BOOST_AUTO_TEST_CASE(the_report_tells_what_worlds_use_once_it_has_been_measured)
{
    Ended ended; // outlives the fixture, whose end cancels what writes it
    Fixture fixture;
    fixture.metrics.host.cores = 8;
    fixture.metrics.host.memory_bytes = 16'000'000'000;
    fixture.metrics.host.graphics_processors = 2;
    fixture.endpoints.emplace(fixture.context, fixture.sessions, fixture.metrics);
    fixture.tasks.spawn(look_at_processes(*fixture.endpoints, ended));
    fixture.world.settle();
    fixture.processes.expect().prints(".\n").renders(25);
    fixture.run(fixture.add_session());
    fixture.add_session();
    fixture.add_session();
    fixture.add_session("https://github.com/o/r/blob/main/worlds/b.wbt");
    auto report = fixture.report(); // which asks for a look at the simulators
    BOOST_TEST(report.processors.value() == 8);
    BOOST_TEST(report.memory_bytes.value() == 16e9);
    BOOST_TEST(report.graphics_processors.value() == 2);
    BOOST_REQUIRE(report.worlds.size() == 2u);
    BOOST_TEST((report.worlds[0].key == world_key("https://github.com/o/r/blob/main/worlds/a.wbt", "x3d")));
    BOOST_TEST(report.worlds[0].starting == 2);
    BOOST_TEST(report.worlds[0].running == 0, "nothing is known of it");
    BOOST_TEST(report.worlds[1].starting == 1);
    fixture.world.advance(1s);
    fixture.world.settle();
    BOOST_TEST(fixture.report().worlds[0].running == 1);
    fixture.world.advance(1s);
    fixture.world.settle();
    report = fixture.report();
    BOOST_TEST(report.worlds[0].graphics == 0.25, boost::test_tools::tolerance(1e-6));
    BOOST_TEST(fixture.shows("webots_simulations_graphics_processors 0.25"));
    BOOST_TEST(fixture.get("/monitor").text().find("\"graphics\":25,") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(the_report_tells_which_projects_are_cached)
{
    Fixture fixture;
    BOOST_TEST(fixture.report().projects.empty());
    fixture.source.in_cache = {7, 0xffffffff};
    BOOST_TEST((fixture.report().projects == std::vector<std::uint32_t>{7, 0xffffffff}));
}

BOOST_AUTO_TEST_CASE(figures_show_each_session_in_one_state)
{
    Fixture fixture;
    auto const check = [&](int starting, int running, int idle) {
        BOOST_TEST(fixture.shows("webots_simulations{state=\"starting\"} " + std::to_string(starting)));
        BOOST_TEST(fixture.shows("webots_simulations{state=\"running\"} " + std::to_string(running)));
        BOOST_TEST(fixture.shows("webots_simulations{state=\"idle\"} " + std::to_string(idle)));
    };
    check(0, 0, 0);
    fixture.processes.expect().prints(".\n").after(10s).prints("real-time\n");
    auto& session = fixture.add_session();
    fixture.add_session();
    check(2, 0, 0);
    fixture.run(session);
    check(1, 0, 1);
    fixture.world.advance(10s);
    check(1, 1, 0);
}

BOOST_AUTO_TEST_CASE(a_pause_of_the_event_loop_is_shown_for_a_minute)
{
    Fixture fixture;
    fixture.measure(0, 3s);
    BOOST_TEST(fixture.shows("webots_event_loop_lag_seconds 3"));
    for (int i = 0; i < 59; ++i)
        fixture.measure();
    BOOST_TEST(fixture.shows("webots_event_loop_lag_seconds 0"));
    BOOST_TEST(fixture.shows("webots_event_loop_lag_max_seconds 3"));
    fixture.measure();
    BOOST_TEST(fixture.shows("webots_event_loop_lag_max_seconds 0"));
}

BOOST_AUTO_TEST_CASE(figures_of_others_stand_below_our_own)
{
    SimulationServiceHooks hooks;
    hooks.more_metrics = [] { return std::string("adapter_figure 7\n"); };
    Fixture fixture(hooks);
    BOOST_TEST(fixture.get("/metrics").text().ends_with("\nadapter_figure 7\n"));
    BOOST_TEST(fixture.shows("webots_simulations_isolated 1"));
}

BOOST_AUTO_TEST_CASE(the_monitor_is_made_once_a_second_and_anew_when_the_configuration_has_changed)
{
    Fixture fixture;
    fixture.setup.config.title = "Old";
    auto const first = fixture.get("/monitor");
    BOOST_TEST(first.status == 200);
    BOOST_TEST(has(first.text(), "Old"));
    fixture.setup.config.title = "New";
    BOOST_TEST((fixture.get("/monitor").shared == first.shared));
    fixture.endpoints->refresh_pages();
    BOOST_TEST(has(fixture.get("/monitor").text(), "New"));
    fixture.setup.config.title = "Newer";
    fixture.world.advance(999ms);
    BOOST_TEST(!has(fixture.get("/monitor").text(), "Newer"));
    fixture.world.advance(1ms);
    BOOST_TEST(has(fixture.get("/monitor").text(), "Newer"));
}

BOOST_AUTO_TEST_CASE(who_has_the_monitor_already_is_not_sent_it_again)
{
    Fixture fixture;
    auto const first = fixture.get("/monitor");
    auto const tag = std::find_if(first.headers.begin(), first.headers.end(),
                                  [](auto const& header) { return header.first == "ETag"; });
    BOOST_TEST_REQUIRE((tag != first.headers.end()));
    BOOST_TEST(fixture.get("/monitor", "If-None-Match", tag->second).status == 304);
    BOOST_TEST(fixture.get("/monitor", "If-None-Match", "\"other\"").status == 200);
}

BOOST_AUTO_TEST_CASE(the_monitor_is_a_page_a_text_for_programs_or_a_websocket)
{
    Fixture fixture;
    fixture.add_session("https://github.com/o/r/blob/main/worlds/<script>.wbt");
    BOOST_TEST(fixture.get("/monitor").content_type == "text/html; charset=UTF-8");
    BOOST_TEST(!has(fixture.get("/monitor").text(), "<script>.wbt"));
    auto const json = fixture.get("/monitor", "Accept", "application/json");
    BOOST_TEST(json.content_type == "application/json");
    BOOST_TEST(has(json.text(), "\"state\":\"fetching the project\""));
    IncomingRequest request;
    request.method = "GET";
    request.path = "/monitor";
    request.upgrade = true;
    BOOST_TEST(std::holds_alternative<AcceptWebSocket>(fixture.endpoints->answer(request)));
}

BOOST_AUTO_TEST_CASE(each_look_is_a_line_of_the_monitor_log)
{
    std::vector<std::string> lines;
    SimulationServiceHooks hooks;
    hooks.monitor_log = [&lines](std::string line) { lines.push_back(std::move(line)); };
    Fixture fixture(hooks);
    fixture.measure();
    fixture.measure();
    BOOST_TEST(lines.size() == 2u);
    fixture.endpoints->measure(fixture.world.clock.now(), 0); // without a sample
    BOOST_TEST(lines.size() == 2u);
}

BOOST_AUTO_TEST_CASE(who_watches_gets_everything_and_then_what_is_new_after_each_look)
{
    Ended ended; // declared first: the destructor of the fixture ends the measurement, which writes here
    Fixture fixture;
    auto const looking = fixture.tasks.spawn(look_at_processes(*fixture.endpoints, ended));
    fixture.measure();
    auto& watcher = fixture.watch();
    BOOST_TEST_REQUIRE(watcher.sent.size() == 1u);
    BOOST_TEST(has(watcher.sent[0], "\"series\""));
    fixture.processes.expect().prints(".\n").consumes(150, 2'000'000);
    fixture.run(fixture.add_session());
    BOOST_TEST(watcher.sent.size() == 1u);
    fixture.measure();
    BOOST_TEST_REQUIRE(watcher.sent.size() == 2u);
    BOOST_TEST(!has(watcher.sent[1], "\"series\""));
    BOOST_TEST(has(watcher.sent[1], "\"cpu\":150,\"memory\":2"), watcher.sent[1]);
    watcher.browser_leaves();
    fixture.world.settle();
    fixture.measure();
    BOOST_TEST(watcher.sent.size() == 2u);
    async::TaskGroup::cancel(looking);
    fixture.world.settle();
    BOOST_TEST_REQUIRE(ended.has_value());
    BOOST_TEST((ended->error().code() == asio::error::operation_aborted));
}

// A look is the work of another thread, and not cancellable: the server must not wait for the next one after
// it.
BOOST_AUTO_TEST_CASE(a_server_that_is_stopped_during_a_look_waits_for_no_other)
{
    Ended ended;
    Fixture fixture;
    auto const looking = fixture.tasks.spawn(look_at_processes(*fixture.endpoints, ended));
    fixture.processes.expect().prints(".\n");
    fixture.run(fixture.add_session());
    fixture.measure();
    fixture.gate.close();
    (void)fixture.get("/monitor");
    fixture.world.settle();
    BOOST_TEST_REQUIRE(fixture.gate.is_awaited());
    async::TaskGroup::cancel(looking);
    fixture.world.settle();
    BOOST_TEST(!ended.has_value());
    fixture.gate.open();
    fixture.world.settle();
    BOOST_TEST_REQUIRE(ended.has_value());
    BOOST_TEST((ended->error().code() == asio::error::operation_aborted));
}

BOOST_AUTO_TEST_CASE(nobody_looks_at_simulators_for_nobody)
{
    Ended ended; // declared first: the destructor of the fixture ends the measurement, which writes here
    Fixture fixture;
    fixture.tasks.spawn(look_at_processes(*fixture.endpoints, ended));
    fixture.processes.expect().prints(".\n").consumes(150, 2'000'000);
    auto& session = fixture.add_session();
    fixture.run(session);
    fixture.measure();
    fixture.measure();
    BOOST_TEST(!session.row().cpu.has_value());
    (void)fixture.get("/monitor"); // now somebody looks at the page
    fixture.world.settle();
    BOOST_TEST(session.row().cpu.value() == 150);
}

// Sampling a process tree occupies a thread for a moment: sampling all of many trees would occupy it for a
// second.
BOOST_AUTO_TEST_CASE(of_many_simulators_25_are_looked_at_in_a_second_and_then_the_next)
{
    Ended ended;
    Fixture fixture({}, 30);
    fixture.tasks.spawn(look_at_processes(*fixture.endpoints, ended));
    for (int i = 0; i < 30; ++i) {
        fixture.processes.expect().prints(".\n").consumes(10, 1);
        fixture.run(fixture.add_session());
    }
    fixture.world.advance(1s);
    auto const looked = [&fixture] {
        return std::count_if(fixture.sessions.begin(), fixture.sessions.end(),
                             [](auto const& entry) { return entry.second->row().cpu.has_value(); });
    };
    BOOST_TEST(looked() == 0);
    fixture.watch();
    BOOST_TEST(looked() == 25);
    fixture.measure();
    BOOST_TEST(looked() == 30);
}

BOOST_AUTO_TEST_SUITE_END()
