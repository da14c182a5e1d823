#include "run.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"

#include <webots_cloud/load_report.hpp>
#include <webots_cloud/simulation_service.hpp>
#include <webots_cloud/testing/fixed_metrics.hpp>
#include <webots_cloud/testing/loopback_channel.hpp>
#include <webots_cloud/testing/memory_project_source.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/scripted_processes.hpp>
#include <webots_cloud/testing/world.hpp>

#include <csignal>

using namespace webots_cloud;
using namespace std::chrono_literals;

namespace {

constexpr auto start_message = R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"mjpeg"}})";


SimulationServiceParams service_params()
{
    SimulationServiceParams params;
    params.server = "host.org";
    params.ssl = false;
    params.port_rewrite = false;
    params.allowed_repositories = {"https://github.com/o"};
    return params;
}

SimulationLauncherParams launcher_params()
{
    SimulationLauncherParams params;
    params.webots = "/opt/webots/webots";
    params.most_simulations = 2;
    params.timeout = 600s;
    params.start_timeout = 300s;
    return params;
}

ProjectFetcherParams fetcher_params()
{
    ProjectFetcherParams params;
    params.instances = "/instances";
    params.parallel = 2;
    return params;
}

/// A whole simulation server on fakes. At its end nothing may be left: no process, port, directory, task or timer.
struct Fixture
{
    Fixture() :
        processes(world.clock), source(world.clock),
        fetcher(fetcher_params(), {Forge("https://github.com", source)}, log.logger()),
        launcher(launcher_params(), processes, world.clock, log.logger()),
        service(service_params(), fetcher, launcher, metrics, world.clock, log.logger()), tasks(world.executor())
    {
        source.add("o/r", "a.wbt");
        tasks.spawn(run(service));
        world.settle();
    }

    ~Fixture()
    {
        tasks.cancel_all();
        world.run(tasks.join());
        BOOST_TEST(browsings.size() == 0u);
        BOOST_TEST(processes.alive() == 0);
        BOOST_TEST(processes.held() == 0u);
        BOOST_TEST(launcher.running() == 0u);
        BOOST_TEST(source.directories().empty());
        BOOST_TEST(service.sessions() == 0u);
        BOOST_TEST(world.clock.pending() == 0u);
    }

    testing::LoopbackChannel& connect()
    {
        browsers.push_back(std::make_unique<testing::LoopbackChannel>(world.executor()));
        ChannelInfo info;
        info.path = "/client";
        browsings.spawn(service.converse(std::move(info), *browsers.back()));
        world.settle();
        return *browsers.back();
    }

    testing::LoopbackChannel& start(std::string message = start_message)
    {
        auto& browser = connect();
        browser.browser_says(std::move(message));
        world.settle();
        return browser;
    }

    void leave(testing::LoopbackChannel& browser)
    {
        browser.browser_leaves();
        world.settle();
    }

    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedProcesses processes;
    testing::MemoryProjectSource source;
    testing::FixedMetrics metrics;
    ProjectFetcher fetcher;
    SimulationLauncher launcher;
    SimulationService service;
    std::vector<std::unique_ptr<testing::LoopbackChannel>> browsers;
    async::TaskGroup tasks;
    async::TaskGroup browsings{world.executor()};
};

using Texts = std::vector<std::string>;

} // namespace

// Protocol sections 4.1 and 6.
BOOST_AUTO_TEST_SUITE(simulation_service)

BOOST_AUTO_TEST_CASE(the_happy_path_is_two_frames_and_then_heartbeats)
{
    Fixture fixture;
    fixture.processes.expect().prints("noise\n").after(2s).prints(".\n").after(5s).prints(".\n");
    auto& browser = fixture.start();
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600"}), boost::test_tools::per_element());
    fixture.world.advance(2s);
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600", "webots:ws://host.org:2001"}), boost::test_tools::per_element());
    fixture.world.advance(5s);
    BOOST_TEST(browser.sent.back() == ".");
    auto const& argv = fixture.processes.started().front().argv;
    BOOST_TEST(argv == (Texts{"/opt/webots/webots", "--batch", "--mode=pause", "--port=2001", "--heartbeat=5000",
                              "--stream=mjpeg", "/instances/1/project/worlds/a.wbt"}),
               boost::test_tools::per_element());
    fixture.leave(browser);
    BOOST_TEST(fixture.log.contains("[1] New client"));
    BOOST_TEST(fixture.log.contains("Starting simulation from https://github.com/o/r/blob/main/worlds/a.wbt"));
    BOOST_TEST(fixture.log.contains("[1] Webots [1001] started: \"/opt/webots/webots --batch"));
    BOOST_TEST(fixture.log.contains("Webots world is loaded, ready to receive connections"));
    BOOST_TEST(fixture.log.contains("[1] Webots [1001] was killed"));
    BOOST_TEST(fixture.log.contains("[1] Client disconnected"));
}

BOOST_AUTO_TEST_CASE(the_browser_may_leave_at_any_moment_and_nothing_stays)
{
    for (int seconds = 0; seconds < 12; ++seconds) {
        Fixture fixture;
        fixture.source.delay = 3s;
        fixture.processes.expect().stubborn().after(3s).prints(".\n").after(2s).prints("real-time\n").after(2s).exits(1);
        auto& browser = fixture.start();
        fixture.world.advance(std::chrono::seconds(seconds));
        fixture.leave(browser);
        fixture.world.advance(2s); // the grace of the stubborn
    }
}

BOOST_AUTO_TEST_CASE(when_webots_quits_the_browser_is_told_and_the_socket_closed)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(1s).exits(0);
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(browser.sent.back() == "loading: Error: Webots has quit.");
    BOOST_TEST(browser.close_code.value() == 0);
}

BOOST_AUTO_TEST_CASE(a_crash_before_ready_is_told_with_webots_last_words)
{
    Fixture fixture;
    fixture.processes.expect().prints("starting\nError: no display").exits(1);
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(browser.sent.back() ==
               "loading: Error: Unable to start Webots: it exited with status 1 before the world was loaded: Error: no display");
    BOOST_TEST(browser.close_code.has_value());
}

BOOST_AUTO_TEST_CASE(a_crash_after_ready_is_told)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(1s).crashes(SIGSEGV);
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(browser.sent.back() == "loading: Error: Webots has quit unexpectedly: it was ended by signal 11.");
}

BOOST_AUTO_TEST_CASE(a_simulator_that_never_gets_ready_is_ended_in_time)
{
    Fixture fixture;
    fixture.processes.expect().prints("loading\n").stubborn();
    auto& browser = fixture.start();
    fixture.world.advance(302s);
    BOOST_TEST(browser.sent.back() == "loading: Error: Webots did not load the world within 300 s.");
}

BOOST_AUTO_TEST_CASE(the_time_limit_ends_a_simulation_however_busy)
{
    Fixture fixture;
    auto& script = fixture.processes.expect();
    for (int i = 0; i < 200; ++i)
        script.after(5s).prints(".\n");
    auto& browser = fixture.start();
    fixture.world.advance(601s);
    BOOST_TEST(browser.sent.back() == "loading: Error: The simulation reached its time limit of 600 s.");
}

BOOST_AUTO_TEST_CASE(only_a_port_that_webots_really_opened_is_announced)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").listens({2004});
    fixture.processes.expect().prints(".\n").listens({});
    auto& moved = fixture.start();
    BOOST_TEST(moved.was_told("webots:ws://host.org:2004"));
    auto& deaf = fixture.start();
    BOOST_TEST(!deaf.was_told("webots:"));
    fixture.world.advance(301s);
    BOOST_TEST(deaf.sent.back() == "loading: Error: Webots loaded the world but opened no port within 300 s.");
    fixture.leave(moved);
}

BOOST_AUTO_TEST_CASE(ports_in_use_are_skipped_and_exhaustion_is_told)
{
    Fixture fixture;
    fixture.processes.taken = {2001};
    fixture.processes.expect().prints(".\n");
    auto& first = fixture.start();
    BOOST_TEST(first.was_told("webots:ws://host.org:2002"));
    auto& second = fixture.start();
    BOOST_TEST(second.was_told("loading: Error: Too many open connections (>2)"));
    BOOST_TEST(second.close_code.has_value());
    fixture.leave(first);
}

BOOST_AUTO_TEST_CASE(a_start_that_fails_says_why)
{
    struct Case
    {
        char const* message;
        char const* answer;
    };
    for (auto const& [message, answer] : {
             Case{R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/b.wbt"}})", "loading: Error: b.wbt does not exist."},
             Case{R"({"start":{"url":"https://github.com/o/r/blob/main/b.wbt"}})", "loading: Error: Wrong Webots simulation URL"},
             Case{R"({"start":{"url":"https://evil.org/o/r/blob/main/worlds/a.wbt"}})", "loading: Error: Unsupported URL protocol: "},
             Case{R"({"start":{"url":"https://github.com/x/r/blob/main/worlds/a.wbt"}})", "loading: Error: Docker not enabled: "},
             Case{R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"x --y"}})",
                  "loading: Error: Unsupported client mode: x --y"},
             Case{"{", "loading: Error: Wrong message: "},
             Case{R"({"start":{}})", "loading: Error: Wrong message: "},
         }) {
        Fixture fixture;
        auto& browser = fixture.start(message);
        BOOST_TEST(browser.was_told(answer), message << " was answered with " << (browser.sent.empty() ? "nothing" : browser.sent.back()));
        BOOST_TEST(fixture.browsings.size() == 0u, message); // so the adapter closes the socket
    }
}

BOOST_AUTO_TEST_CASE(a_second_start_on_one_socket_is_refused_and_harms_nobody)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.start();
    browser.browser_says(start_message);
    browser.browser_says("{}");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back().starts_with("loading: Error: This connection has started a simulation already"));
    BOOST_TEST(fixture.processes.started().size() == 1u);
    BOOST_TEST(!browser.close_code.has_value());
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_socket_that_starts_nothing_is_dropped_in_time)
{
    Fixture fixture;
    auto& browser = fixture.connect();
    browser.browser_says("{}");
    fixture.world.advance(30s);
    BOOST_TEST(browser.sent.back().starts_with("loading: Error: No simulation was asked for in time"));
}

BOOST_AUTO_TEST_CASE(slow_fetches_show_their_progress_and_wait_their_turn)
{
    Fixture fixture;
    fixture.source.delay = 2s;
    auto& first = fixture.start();
    auto& second = fixture.start();
    auto& third = fixture.start();
    fixture.world.advance(600ms);
    BOOST_TEST(first.sent == (Texts{"loading: Receiving objects 40% (12.3 MB)"}), boost::test_tools::per_element());
    BOOST_TEST(fixture.source.fetching == 2);
    BOOST_TEST(fixture.fetcher.waiting() == 1u);
    for (auto* browser : {&second, &third, &first})
        fixture.leave(*browser);
    BOOST_TEST(fixture.source.most_fetching == 2);
}

BOOST_AUTO_TEST_CASE(load_is_a_bare_float_and_json_for_those_who_ask)
{
    Fixture fixture;
    fixture.metrics.cpu = 25;
    fixture.metrics.next.memory_used = 12.5;
    fixture.processes.expect().prints("loading\n");
    auto& browser = fixture.start();
    fixture.world.advance(5s);
    IncomingRequest request;
    request.method = "GET";
    request.path = "/load";
    BOOST_TEST(std::get<HttpResponse>(fixture.service.respond(request)).body == "25.0");
    std::pair<std::string_view, std::string_view> const accept[] = {{"Accept", "application/json, text/plain;q=0.5"}};
    request.headers = accept;
    auto const report = parse_load_report(std::get<HttpResponse>(fixture.service.respond(request)).body).value();
    BOOST_TEST(report.load == 25);
    BOOST_TEST(report.sessions.value() == 1);
    BOOST_TEST(report.starting.value() == 1);
    BOOST_TEST(report.capacity.value() == 2);
    BOOST_TEST(report.memory.value() == 12.5);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(the_monitor_lists_what_runs)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\nreal-time\n").consumes(50, 12'300'000);
    auto& browser = fixture.start();
    fixture.world.advance(10s);
    IncomingRequest request;
    request.method = "GET";
    request.path = "/monitor";
    auto const page = std::get<HttpResponse>(fixture.service.respond(request)).body;
    BOOST_TEST(page.find("data-label=\"CPU\">50.0%</td>") != std::string::npos);
    BOOST_TEST(page.find("data-label=\"memory\">12.3 MB</td>") != std::string::npos);
    BOOST_TEST(page.find("https://github.com/o/r/blob/main/worlds/a.wbt") != std::string::npos);
    BOOST_TEST(page.find("<td data-label=\"state\">running</td>") != std::string::npos);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(who_watches_the_monitor_gets_everything_once_and_then_a_point_a_second)
{
    Fixture fixture;
    fixture.world.advance(3s);
    testing::LoopbackChannel watcher(fixture.world.executor());
    ChannelInfo info;
    info.path = "/monitor";
    fixture.browsings.spawn(fixture.service.converse(std::move(info), watcher));
    fixture.world.settle();
    BOOST_TEST(watcher.sent.size() == 1u);
    BOOST_TEST(watcher.sent[0].find("\"series\"") != std::string::npos);
    fixture.processes.expect().prints(".\n").consumes(150, 1'000'000);
    auto& browser = fixture.start();
    fixture.world.advance(2s);
    BOOST_TEST(watcher.sent.size() == 3u);
    BOOST_TEST(watcher.sent[2].find("\"series\"") == std::string::npos);
    BOOST_TEST(watcher.sent[2].find("\"state\":\"idle\",\"age\":2,\"process\":1001,\"cpu\":150,\"memory\":1}") !=
               std::string::npos, watcher.sent[2]);
    BOOST_TEST(fixture.service.sessions() == 1u); // a watcher is none
    fixture.leave(browser);
    fixture.leave(watcher);
}

BOOST_AUTO_TEST_CASE(figures_count_starts_by_how_they_ended)
{
    Fixture fixture;
    fixture.processes.expect().after(2s).prints(".\n");
    fixture.processes.expect();
    auto& ready = fixture.start();
    auto& abandoned = fixture.start();
    fixture.start(R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/b.wbt"}})");
    fixture.world.advance(2s);
    fixture.leave(abandoned);
    IncomingRequest request;
    request.method = "GET";
    request.path = "/metrics";
    auto const figures = std::get<HttpResponse>(fixture.service.respond(request)).body;
    for (auto const* line : {"webots_starts_total{result=\"ready\",reason=\"\"} 1\n",
                             "webots_starts_total{result=\"abandoned\",reason=\"\"} 1\n",
                             "webots_starts_total{result=\"failed\",reason=\"not_found\"} 1\n",
                             "webots_start_stage_seconds_sum{stage=\"ready\"} 2\n", "webots_simulations{state=\"idle\"} 1\n"})
        BOOST_TEST(figures.find(line) != std::string::npos, line << " is not in\n" << figures);
    fixture.leave(ready);
}

BOOST_AUTO_TEST_CASE(a_drained_server_takes_nothing_new_and_ends_with_its_last_simulation_if_asked)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n");
    auto& running = fixture.start();
    auto const ask = [&](std::string_view method, std::string_view path, std::string_view query, bool local) {
        IncomingRequest request;
        request.method = method;
        request.path = path;
        request.query = query;
        request.from_loopback = local;
        return std::get<HttpResponse>(fixture.service.respond(request));
    };
    BOOST_TEST(ask("GET", "/readyz", "", false).status == 200);
    BOOST_TEST(ask("GET", "/api/drain", "", true).status == 405);
    BOOST_TEST(ask("POST", "/api/drain", "", false).status == 403);
    BOOST_TEST(ask("POST", "/api/drain", "exit", true).status == 200);
    BOOST_TEST(ask("GET", "/readyz", "", false).status == 503);
    auto& refused = fixture.start();
    BOOST_TEST(refused.sent.back().starts_with("loading: Error: This simulation server is about to stop."));
    std::pair<std::string_view, std::string_view> const accept[] = {{"Accept", "application/json"}};
    IncomingRequest load;
    load.method = "GET";
    load.path = "/load";
    load.headers = accept;
    BOOST_TEST(parse_load_report(std::get<HttpResponse>(fixture.service.respond(load)).body)->draining);
    fixture.world.advance(5s);
    BOOST_TEST(fixture.tasks.size() == 1u); // run() goes on
    fixture.leave(running);
    fixture.world.advance(1s);
    BOOST_TEST(fixture.tasks.size() == 0u);
}

// Every call of a seam fails in turn: exactly one error reaches the browser, and the fixture checks that nothing is left.
BOOST_AUTO_TEST_CASE(whatever_fails_one_error_is_told_and_nothing_is_left)
{
    int failures = 0;
    for (int call = 1;; ++call) {
        Fixture fixture;
        fixture.source.fuse = testing::Fuse(call);
        fixture.processes.fuse = testing::Fuse(call);
        fixture.processes.expect().prints(".\n");
        auto& browser = fixture.start();
        bool const blown = fixture.source.fuse.blown() || fixture.processes.fuse.blown();
        auto const errors = std::count_if(browser.sent.begin(), browser.sent.end(),
                                          [](std::string const& text) { return text.starts_with("loading: Error: "); });
        BOOST_TEST(errors == (browser.was_told("webots:") ? 0 : 1));
        if (!browser.close_code)
            fixture.leave(browser);
        if (!blown)
            break;
        ++failures;
    }
    BOOST_TEST(failures >= 2);
}

BOOST_AUTO_TEST_SUITE_END()
