#include "refusal_sentences.hpp"
#include "simulation_fixture.hpp"

#include "core/gallery/world_list.hpp"

#include <webots_cloud/load_report.hpp>
#include <webots_cloud/testing/fixed_picture_taker.hpp>
#include <webots_cloud/testing/fixed_simulator_talk.hpp>
#include <webots_cloud/testing/fixed_world_finder.hpp>
#include <webots_cloud/testing/memory_text_files.hpp>

#include <csignal>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol sections 4.1, 6, 9.1 and 13.
BOOST_AUTO_TEST_SUITE(simulation_service)

namespace {

constexpr auto start_message =
    R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"mjpeg"}})";

constexpr auto returning_start =
    R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","reconnect":true,"heartbeat":true}})";

constexpr auto init_message =
    R"({ "init" : [ "https://w.org", "robots", "a.wbt", "", "", "", "", "", "" ] })";

struct Fixture : SimulationFixture
{
    explicit Fixture(Duration grace = {}, int max_simulations = 2)
        : SimulationFixture(simulation_service_setup(grace), max_simulations)
    {}

    using SimulationFixture::SimulationFixture;

    testing::LoopbackChannel& start(std::string message = start_message)
    {
        return say("", std::move(message));
    }

    testing::LoopbackChannel& reconnect(std::string const& token)
    {
        return start(R"({"reconnect":")" + token + R"("})");
    }
};

using Texts = std::vector<std::string>;

std::string list_of_worlds(SimulationFixture& fixture)
{
    return fixture.get("/worlds").shared->text;
}

} // namespace

// Protocol 4.1.2 steps 1, 6, 7 and 10 to 13, 4.1.3, 9.1; quirks Q8 and Q32.
BOOST_AUTO_TEST_CASE(the_happy_path_is_two_frames_and_then_heartbeats)
{
    Fixture fixture;
    fixture.processes.expect().prints("noise\n").after(2s).prints(".\n").after(5s).prints(".\n");
    auto& browser = fixture.start();
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600"}), boost::test_tools::per_element());
    fixture.world.advance(2s);
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600", "webots:ws://host.org:2001"}),
               boost::test_tools::per_element());
    fixture.world.advance(5s);
    BOOST_TEST(browser.sent.back() == ".");
    BOOST_TEST(!browser.close_code.has_value());
    auto const& argv = fixture.processes.started().front().argv;
    BOOST_TEST(argv == (Texts{"/opt/webots/webots", "--batch", "--mode=pause", "--port=2001",
                              "--heartbeat=5000", "--stream=mjpeg", "/instances/1/project/worlds/a.wbt"}),
               boost::test_tools::per_element());
    fixture.leave(browser);
    BOOST_TEST(fixture.log.contains("[1] New client"));
    BOOST_TEST(
        fixture.log.contains("Starting simulation from https://github.com/o/r/blob/main/worlds/a.wbt"));
    BOOST_TEST(fixture.log.contains("[1] Webots [1001] started: \"/opt/webots/webots --batch"));
    BOOST_TEST(fixture.log.contains("Webots world is loaded, ready to receive connections"));
    BOOST_TEST(fixture.log.contains("[1] Webots [1001] was killed"));
    BOOST_TEST(fixture.log.contains("[1] Client disconnected"));
}

BOOST_AUTO_TEST_CASE(what_a_simulator_prints_is_kept_in_a_log_of_its_own_but_for_heartbeats)
{
    Fixture fixture;
    fixture.processes.expect().prints("loading\n.\n.\nreal-time\nlast words").exits(1);
    auto& browser = fixture.start();
    BOOST_TEST(fixture.logs.lines[1] == (Texts{"Output of https://github.com/o/r/blob/main/worlds/a.wbt",
                                               "loading", "real-time", "last words"}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.log.contains("[1] What Webots prints is in 1.log"));
    BOOST_TEST(browser.close_code.has_value());
}

// One client must not keep the event loop from the others. Half a minute with sanitizers, under which
// hostile_output floods the real server.
BOOST_AUTO_TEST_CASE(
    of_a_simulator_that_prints_without_end_a_part_is_passed_on_and_its_state_is_known_all_the_same,
    *boost::unit_test::enable_if<!is_sanitized>())
{
    Fixture fixture;
    std::string const flood(16'000, '\n');
    auto& script = fixture.processes.expect();
    script.prints(flood + "one word\n");
    for (int i = 0; i < 1000; ++i)
        script.prints(flood);
    script.prints(".\nreal-time\n" + flood).after(100s).prints("last words\n").after(1s).exits(1);
    auto& browser = fixture.start();
    // 16 MB, of which 4 may come at once and the rest at 1 MB a second
    fixture.world.advance(10s);
    BOOST_TEST(!browser.was_told("webots:"));
    BOOST_TEST(browser.was_told("loading: Of what the simulator prints "));
    BOOST_TEST(std::count_if(browser.sent.begin(), browser.sent.end(), [](std::string const& text) {
                   return text.starts_with("loading: Of what");
               }) == 1);
    fixture.world.advance(5s);
    BOOST_TEST(browser.was_told("webots:"));
    auto const& lines = fixture.logs.lines[1];
    BOOST_TEST(lines.size() < 2000u + 500u * 16);
    BOOST_TEST(fixture.get("/monitor").text().find("\"state\":\"running\"") != std::string::npos);
    fixture.world.advance(200s);
    BOOST_TEST(fixture.log.contains("[1] Of what the simulator prints "));
    BOOST_TEST((std::find(lines.begin(), lines.end(), "last words") != lines.end()));
    auto const notices = std::count_if(lines.begin(), lines.end(), [](std::string const& line) {
        return line.starts_with('[') &&
               line.ends_with(" lines were left out: more than 500 a second were printed]");
    });
    BOOST_TEST(notices == 2); // after a second, and a minute after that
    BOOST_TEST(browser.close_code.has_value());
}

BOOST_AUTO_TEST_CASE(heartbeats_without_end_reach_the_browser_in_moderation)
{
    Fixture fixture;
    std::string beats;
    for (int i = 0; i < 1000; ++i)
        beats += ".\nreal-time\npause\n";
    fixture.processes.expect().prints(".\n").after(1s).prints(beats).after(5s).prints(".\n");
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    auto const told = browser.sent.size();
    BOOST_TEST(std::count(browser.sent.begin(), browser.sent.end(), ".") == 20);
    fixture.world.advance(5s);
    BOOST_TEST(browser.sent.size() == told + 1);
    fixture.leave(browser);
}

// A simulator that never stops printing has a time limit as every other.
BOOST_AUTO_TEST_CASE(a_simulator_that_prints_without_end_is_ended_at_its_time_limit)
{
    Fixture fixture;
    auto& script = fixture.processes.expect();
    script.prints(".\n");
    for (int i = 0; i < 700; ++i)
        script.after(1s).prints(std::string(1'000'000, 'x'));
    auto& browser = fixture.start();
    fixture.world.advance(601s);
    BOOST_TEST(browser.sent.back() == error_line(core::Refused::time_limit, {{"seconds", "600"}}));
}

// Protocol sections 5.2 and 6.2.
BOOST_AUTO_TEST_CASE(init_is_answered_with_the_address_alone_and_then_heartbeats)
{
    Fixture fixture;
    fixture.processes.expect().prints("noise\nopen\n").after(5s).prints(".\n");
    auto& browser = fixture.start(init_message);
    BOOST_TEST(browser.sent == (Texts{"webots:ws://host.org:2001"}), boost::test_tools::per_element());
    fixture.world.advance(5s);
    BOOST_TEST(browser.sent == (Texts{"webots:ws://host.org:2001", "."}), boost::test_tools::per_element());
    auto const& process = fixture.processes.started().front();
    BOOST_TEST(process.argv ==
                   (Texts{"/opt/webots/webots", "--batch", "--mode=pause", "--minimize", "--no-rendering",
                          "--stream=\"port=2001;monitorActivity;controllerEdit\"",
                          "/instances/1/project/worlds/a.wbt"}),
               boost::test_tools::per_element());
    std::pair<std::string, std::string> const sandbox("WEBOTS_FIREJAIL_CONTROLLERS", "1");
    BOOST_TEST(std::count(process.environment.begin(), process.environment.end(), sandbox) == 1);
    BOOST_TEST(process.set_user_id);
    BOOST_TEST(fixture.log.contains("Starting simulation from https://w.org/robots/worlds/a.wbt"));
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(init_needs_no_allowed_repository_but_a_server_that_is_not_draining)
{
    Fixture fixture;
    auto setup = simulation_service_setup();
    setup.config.repositories.allowed.clear();
    fixture.service.apply(setup.config);
    fixture.processes.expect().prints("open\n");
    auto& first = fixture.start(init_message);
    BOOST_TEST(first.sent.back() == "webots:ws://host.org:2001");
    fixture.service.drain(false);
    auto& second = fixture.start(init_message);
    BOOST_TEST(second.sent.back().starts_with("loading: Error: This simulation server is about to stop."));
    fixture.leave(first);
}

BOOST_AUTO_TEST_CASE(an_init_that_fails_says_why_and_closes)
{
    Fixture fixture;
    auto& missing = fixture.start(R"({"init":["https://w.org","other","a.wbt"]})");
    BOOST_TEST(missing.sent == (Texts{"loading: Error: a.wbt does not exist."}),
               boost::test_tools::per_element());
    BOOST_TEST(missing.close_code.has_value());
    auto& wrong = fixture.start(R"({"init":["https://w.org","../other","a.wbt"]})");
    BOOST_TEST(wrong.sent == (Texts{"loading: Error: Wrong message: \"../other\" is no name of a project."}),
               boost::test_tools::per_element()); // and the adapter closes
    BOOST_TEST(fixture.browsings.size() == 0u);
}

BOOST_AUTO_TEST_CASE(a_server_without_websites_refuses_init_in_words)
{
    Fixture fixture;
    ProjectFetcher without(project_fetcher_params(), {Forge("https://github.com", fixture.source)},
                           fixture.log.logger());
    SimulationService service(simulation_service_setup().config, simulation_service_setup().facts, without,
                              fixture.launcher, fixture.metrics, fixture.world.clock, fixture.log.logger());
    testing::LoopbackChannel browser(fixture.world.executor());
    ChannelInfo info;
    info.path = "/client";
    fixture.browsings.spawn(service.serve_websocket(std::move(info), browser));
    fixture.world.settle();
    browser.browser_says(init_message);
    fixture.world.settle();
    BOOST_TEST(browser.sent ==
                   (Texts{"loading: Error: This simulation server runs no projects of websites."}),
               boost::test_tools::per_element());
}

// Protocol 4.1.2 step 13, 6.5.
BOOST_AUTO_TEST_CASE(the_browser_may_leave_at_any_moment_and_nothing_stays)
{
    for (int seconds = 0; seconds < 12; ++seconds) {
        Fixture fixture;
        fixture.source.delay = 3s;
        fixture.processes.expect()
            .stubborn()
            .after(3s)
            .prints(".\n")
            .after(2s)
            .prints("real-time\n")
            .after(2s)
            .exits(1);
        auto& browser = fixture.start();
        fixture.world.advance(std::chrono::seconds(seconds));
        fixture.leave(browser);
        fixture.world.advance(2s); // the grace of a program that ignores SIGTERM
    }
}

BOOST_AUTO_TEST_CASE(a_project_that_arrives_although_its_browser_has_left_is_removed)
{
    Fixture fixture;
    fixture.source.finishes = true;
    fixture.source.delay = 3s;
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    fixture.leave(browser);
    fixture.world.advance(3s);
    BOOST_TEST(fixture.processes.started().empty());
}

// Protocol 4.1.4, 6.5; quirk Q7.
BOOST_AUTO_TEST_CASE(when_webots_quits_the_browser_is_told_and_the_socket_closed)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(1s).exits(0);
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(browser.sent.back() == error_line(core::Refused::quit));
    BOOST_TEST(browser.close_code.value() == 0);
    BOOST_TEST(fixture.log.contains("[1] Webots [1001] exited"));
}

// Protocol 6.5; quirks Q7 and Q15.
BOOST_AUTO_TEST_CASE(a_crash_before_ready_is_told_with_the_error_that_webots_printed)
{
    Fixture fixture;
    fixture.processes.expect().prints("starting\nError: no display\nTry 'webots --help'.").exits(1);
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(browser.sent.back() ==
               error_line(core::Refused::ended_early_saying,
                          {{"how", "it exited with status 1"}, {"words", "Error: no display"}}));
    BOOST_TEST(browser.close_code.has_value());
}

// Protocol 6.5; quirk Q7.
BOOST_AUTO_TEST_CASE(a_crash_after_ready_is_told)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(1s).crashes(SIGSEGV);
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(browser.sent.back() ==
               error_line(core::Refused::crashed, {{"how", "it was ended by signal 11"}}));
}

BOOST_AUTO_TEST_CASE(a_simulator_that_never_gets_ready_is_ended_in_time)
{
    Fixture fixture;
    fixture.processes.expect().prints("loading\n").stubborn();
    auto& browser = fixture.start();
    fixture.world.advance(302s);
    BOOST_TEST(browser.sent.back() == error_line(core::Refused::not_loaded, {{"seconds", "300"}}));
}

// Protocol 4.1.3 shutdownTimeout, 6.1 timeout, 6.5.
BOOST_AUTO_TEST_CASE(the_time_limit_ends_a_simulation_however_busy)
{
    Fixture fixture;
    auto& script = fixture.processes.expect();
    for (int i = 0; i < 200; ++i)
        script.after(5s).prints(".\n");
    auto& browser = fixture.start();
    fixture.world.advance(601s);
    BOOST_TEST(browser.sent.back() == error_line(core::Refused::time_limit, {{"seconds", "600"}}));
}

// Protocol 4.3.
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
    BOOST_TEST(deaf.sent.back() == error_line(core::Refused::no_port, {{"seconds", "300"}}));
    fixture.leave(moved);
}

// Protocol 4.3; quirk Q9.
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
    BOOST_TEST(fixture.log.contains("Port 2001 is already in use."));
    BOOST_TEST(fixture.log.contains("[2] Too many open connections (>2)"));
    fixture.leave(first);
}

// Protocol 4.1.2 step 4, 4.3: a place is taken first.
BOOST_AUTO_TEST_CASE(a_full_server_says_so_before_it_fetches)
{
    Fixture fixture;
    fixture.source.delay = 5s;
    auto& first = fixture.start();
    auto& second = fixture.start();
    for (auto const* message : {start_message, init_message}) {
        auto& third = fixture.start(message);
        BOOST_TEST(
            third.sent ==
                (Texts{"loading: Error: Too many open connections (>2): this simulation server is full. "
                       "Please try again later."}),
            boost::test_tools::per_element());
        BOOST_TEST(third.close_code.has_value());
    }
    BOOST_TEST(fixture.source.fetching == 2);
    fixture.leave(first);
    auto& fourth = fixture.start();
    BOOST_TEST(fourth.sent.empty());
    BOOST_TEST(fixture.source.fetching == 2);
    fixture.leave(second);
    fixture.leave(fourth);
}

BOOST_AUTO_TEST_CASE(starts_that_fail_take_no_place_from_others)
{
    Fixture fixture;
    for (auto const* url :
         {"https://github.com/o/r/blob/main/worlds/b.wbt", "https://github.com/o/r/blob/main/b.wbt",
          "https://github.com/x/r/blob/main/worlds/a.wbt"})
        for (int i = 0; i < 3; ++i)
            fixture.start(std::string(R"({"start":{"url":")") + url + R"("}})");
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.start();
    BOOST_TEST(browser.was_told("webots:"));
    fixture.leave(browser);
}

// Protocol 13: `/readyz`.
BOOST_AUTO_TEST_CASE(a_full_server_is_not_ready_until_a_simulation_ends)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n");
    fixture.processes.expect().prints(".\n");
    auto& first = fixture.start();
    BOOST_TEST(fixture.get("/readyz").status == 200);
    auto& second = fixture.start();
    BOOST_TEST(fixture.get("/readyz").status == 503);
    BOOST_TEST(fixture.get("/readyz").body.find("full") != std::string::npos);
    fixture.leave(first);
    BOOST_TEST(fixture.get("/readyz").status == 200);
    fixture.leave(second);
}

BOOST_AUTO_TEST_CASE(what_keeps_simulations_apart_and_is_missing_is_said_everywhere)
{
    Fixture good;
    BOOST_TEST(good.get("/readyz").body == "ready");
    BOOST_TEST(good.get("/metrics").body.find("webots_simulations_isolated 1\n") != std::string::npos);
    auto setup = simulation_service_setup();
    setup.facts.isolation_warning = "Nobody & nothing.";
    Fixture fixture(std::move(setup));
    auto const ready = fixture.get("/readyz");
    BOOST_TEST(ready.status == 200);
    BOOST_TEST(ready.body == "ready, but: Nobody &amp; nothing.");
    BOOST_TEST(fixture.get("/monitor").text().find("\"Nobody & nothing.\"") != std::string::npos);
    BOOST_TEST(fixture.get("/metrics").body.find("webots_simulations_isolated 0\n") != std::string::npos);
}

// Protocol 4.1.2 step 10; quirk Q15. The reason stands where the reference has the command, which says
// nothing to browsers.
BOOST_AUTO_TEST_CASE(a_simulator_that_can_not_be_run_is_told)
{
    Fixture fixture;
    auto& browser = fixture.start();
    BOOST_TEST(browser.sent == (Texts{error_line(core::Refused::not_started,
                                                 {{"why", "/opt/webots/webots is not in the script"}})}),
               boost::test_tools::per_element());
    BOOST_TEST(browser.close_code.has_value());
}

// Protocol 6.1; quirk Q22: the Webots that is installed decides what it calls that mode, not the world.
BOOST_AUTO_TEST_CASE(either_word_for_the_scene_mode_starts_either_webots_without_rendering)
{
    for (std::string const world : {"new", "old"})
        for (std::string const mode : {"x3d", "w3d"}) {
            Fixture fixture;
            fixture.source.add("o/r", "old.wbt", "#VRML_SIM R2022b utf8");
            fixture.source.add("o/r", "new.wbt", "#VRML_SIM R2025a utf8");
            fixture.processes.expect().prints(".\n");
            auto& browser = fixture.start(R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/)" +
                                          world + R"(.wbt","mode":")" + mode + R"("}})");
            auto const& argv = fixture.processes.started().front().argv;
            for (std::string const option : {"--stream", "--minimize", "--no-rendering"})
                BOOST_TEST(std::count(argv.begin(), argv.end(), option) == 1,
                           world << " " << mode << " " << option);
            fixture.leave(browser);
        }
}

// Protocol 4.1.1 malformed, 4.1.2 steps 2, 3, 5, 8 and 13; quirk Q6.
BOOST_AUTO_TEST_CASE(a_start_that_fails_says_why)
{
    struct Case
    {
        char const* message;
        std::string answer;
    };
    for (auto const& [message, answer] : {
             Case{R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/b.wbt"}})",
                  "loading: Error: b.wbt does not exist."},
             Case{R"({"start":{"url":"https://github.com/o/r/blob/b.wbt"}})",
                  "loading: Error: Wrong Webots simulation URL"},
             Case{R"({"start":{"url":"https://github.com/o/r/blob/main/b.wbt"}})",
                  error_line(core::Refused::address_not_in_worlds, {{"world", "b.wbt"}})},
             Case{R"({"start":{"url":"https://github.com/o/r/tree/main/p"}})",
                  "loading: Error: Wrong Webots simulation URL: it leads to a folder. "},
             Case{R"({"start":{"url":"https://evil.org/o/r/blob/main/worlds/a.wbt"}})",
                  "loading: Error: Unsupported URL protocol: "},
             Case{R"({"start":{"url":"https://github.com/x/r/blob/main/worlds/a.wbt"}})",
                  "loading: Error: Docker not enabled: "},
             Case{R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"x --y"}})",
                  "loading: Error: Unsupported client mode: x --y"},
             Case{"{", "loading: Error: Wrong message: "},
             Case{R"({"start":{}})", "loading: Error: Wrong message: "},
         }) {
        Fixture fixture;
        auto& browser = fixture.start(message);
        BOOST_TEST(browser.was_told(answer), message
                                                 << " was answered with "
                                                 << (browser.sent.empty() ? "nothing" : browser.sent.back()));
        BOOST_TEST(fixture.browsings.size() == 0u, message); // so the adapter closes the socket
    }
}

// Protocol 4.1.2, strict order: the forge (step 2), the policy (3), the grammar (5).
BOOST_AUTO_TEST_CASE(of_several_reasons_to_refuse_a_start_the_first_is_told)
{
    struct Case
    {
        char const* url;
        char const* answer;
    };
    for (auto const& [url, answer] :
         {Case{"https://evil.org/x/r/raw", "loading: Error: Unsupported URL protocol: "},
          Case{"https://github.com/x/r/raw", "loading: Error: Docker not enabled: "},
          Case{"https://github.com/o/r/raw", "loading: Error: Wrong Webots simulation URL"}}) {
        Fixture fixture;
        auto& browser = fixture.start(std::string(R"({"start":{"url":")") + url + R"("}})");
        BOOST_TEST(browser.was_told(answer), url << " was answered with " << browser.sent.back());
        auto const logged = "[1] " + std::string(answer).substr(std::string_view("loading: Error: ").size());
        BOOST_TEST(fixture.log.contains(logged), logged);
    }
}

// Quirk Q13.
BOOST_AUTO_TEST_CASE(a_second_start_on_one_socket_is_refused_and_harms_nobody)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.start();
    browser.browser_says(start_message);
    browser.browser_says("{}");
    fixture.world.settle();
    BOOST_TEST(
        browser.sent.back().starts_with("loading: Error: This connection has started a simulation already"));
    BOOST_TEST(fixture.processes.started().size() == 1u);
    BOOST_TEST(!browser.close_code.has_value());
    fixture.leave(browser);
}

// Protocol 4.1; quirk Q30.
BOOST_AUTO_TEST_CASE(a_socket_that_starts_nothing_is_dropped_in_time)
{
    Fixture fixture;
    auto& browser = fixture.connect();
    fixture.world.advance(15s);
    browser.browser_says("{}");
    fixture.world.advance(14s);
    BOOST_TEST(browser.sent.empty()); // until it asks for something
    fixture.world.advance(1s);
    BOOST_TEST(browser.sent.back().starts_with("loading: Error: No simulation was asked for in time"));
}

// Protocol 4.1.3: the order, with the progress of a slow fetch before everything that the reference says.
BOOST_AUTO_TEST_CASE(a_slow_start_is_told_in_the_order_that_browsers_rely_on)
{
    Fixture fixture;
    fixture.source.delay = 700ms;
    fixture.processes.expect().prints("noise\n").after(2s).prints(".\n").after(5s).prints(".\n");
    auto& browser = fixture.start();
    fixture.world.advance(8s);
    BOOST_TEST(browser.sent == (Texts{"loading: Receiving objects 40% (12.3 MB)", "shutdownTimeout: 600",
                                      "webots:ws://host.org:2001", "."}),
               boost::test_tools::per_element());
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(what_is_to_be_known_of_a_project_is_said_before_it_starts)
{
    Fixture fixture;
    fixture.source.notice = "The forge can't be reached. Starting from the cache.";
    fixture.processes.expect().prints("loading\n");
    auto& browser = fixture.start();
    BOOST_TEST_REQUIRE(browser.sent.size() > 1u);
    BOOST_TEST(browser.sent[0] == "loading: The forge can't be reached. Starting from the cache.");
    BOOST_TEST(browser.sent[1] == "shutdownTimeout: 600");
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(slow_fetches_show_their_progress_and_hold_up_no_other)
{
    Fixture fixture(Duration::zero(), 3);
    fixture.source.delay = 2s;
    auto& first = fixture.start();
    auto& second = fixture.start();
    fixture.world.advance(600ms);
    BOOST_TEST(first.sent == (Texts{"loading: Receiving objects 40% (12.3 MB)"}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.source.fetching == 2);
    for (auto* browser : {&second, &first})
        fixture.leave(*browser);
}

BOOST_AUTO_TEST_CASE(large_files_have_a_progress_of_their_own)
{
    Fixture fixture;
    fixture.source.delay = 2s;
    fixture.source.large_files = true;
    auto& browser = fixture.start();
    fixture.world.advance(600ms);
    BOOST_TEST(browser.sent == (Texts{"loading: Receiving large files 28% (4.5 MB)"}),
               boost::test_tools::per_element());
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(who_waits_for_other_fetches_is_told_so)
{
    Fixture fixture;
    fixture.source.delay = 2s;
    fixture.source.waits = true;
    auto& browser = fixture.start();
    fixture.world.advance(600ms);
    BOOST_TEST(browser.sent == (Texts{"loading: Waiting for other projects to be fetched (12.3 MB)"}),
               boost::test_tools::per_element());
    fixture.leave(browser);
}

// Protocol 4.2, 13.
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
    std::pair<std::string_view, std::string_view> const accept[] = {
        {"Accept", "application/json, text/plain;q=0.5"}};
    request.headers = accept;
    auto const report =
        parse_load_report(std::get<HttpResponse>(fixture.service.respond(request)).body).value();
    BOOST_TEST(report.load == 25);
    BOOST_TEST(report.sessions.value() == 1);
    BOOST_TEST(report.starting.value() == 1);
    BOOST_TEST(report.capacity.value() == 2);
    BOOST_TEST(report.memory.value() == 12.5);
    BOOST_TEST(report.arrivals.value() == 1);
    fixture.leave(browser);
}

// The session server releases the reservations of browsers whose start failed.
BOOST_AUTO_TEST_CASE(load_counts_who_came_whose_start_failed_and_who_left_since_the_server_is_up)
{
    Fixture fixture;
    auto const counters = [&fixture] {
        IncomingRequest request;
        request.method = "GET";
        request.path = "/load";
        std::pair<std::string_view, std::string_view> const accept[] = {{"Accept", "application/json"}};
        request.headers = accept;
        auto const report =
            parse_load_report(std::get<HttpResponse>(fixture.service.respond(request)).body).value();
        return std::array<std::int64_t, 3>{report.arrivals.value(), report.failed.value(),
                                           report.departures.value()};
    };
    BOOST_TEST((counters() == std::array<std::int64_t, 3>{0, 0, 0}));
    fixture.processes.expect().prints("starting\nError: no display").exits(1);
    fixture.processes.expect().prints("loading\n");
    auto& failing = fixture.start();
    fixture.world.advance(5s);
    BOOST_TEST((counters() == std::array<std::int64_t, 3>{1, 1, 1}));
    auto& leaving = fixture.start();
    fixture.world.advance(5s);
    BOOST_TEST((counters() == std::array<std::int64_t, 3>{2, 1, 1}));
    fixture.leave(leaving); // before it was ready
    BOOST_TEST((counters() == std::array<std::int64_t, 3>{2, 2, 2}));
    fixture.leave(failing);
}

// Section 4: the routes.
BOOST_AUTO_TEST_CASE(each_path_answers_what_it_always_did_and_nobody_else_may_ask_from_a_page)
{
    struct Row
    {
        char const* method;
        char const* path;
        bool upgrade;
        int status; ///< 101: a WebSocket.
    };
    Fixture fixture;
    for (auto const& [method, path, upgrade, status] :
         {Row{"GET", "/load", false, 200},      Row{"GET", "/monitor", false, 200},
          Row{"GET", "/monitor", true, 101},    Row{"GET", "/client", true, 101},
          Row{"GET", "/client", false, 400},    Row{"POST", "/client", false, 405},
          Row{"POST", "/load", false, 405},     Row{"POST", "/monitor", false, 405},
          Row{"GET", "/", false, 200},          Row{"GET", "/session", false, 404},
          Row{"GET", "//load", false, 404},     Row{"HEAD", "/", false, 200},
          Row{"GET", "/client/", true, 404},    Row{"GET", "/metrics", false, 200},
          Row{"GET", "/livez", false, 200},     Row{"GET", "/readyz", false, 200},
          Row{"HEAD", "/load", false, 200},     Row{"HEAD", "/monitor", false, 200},
          Row{"HEAD", "/metrics", false, 200},  Row{"HEAD", "/livez", false, 200},
          Row{"HEAD", "/readyz", false, 200},   Row{"HEAD", "/client", false, 405},
          Row{"HEAD", "/api/drain", false, 404}}) {
        IncomingRequest request;
        request.method = method;
        request.path = path;
        request.upgrade = upgrade;
        auto const answer = fixture.service.respond(request);
        auto const* response = std::get_if<HttpResponse>(&answer);
        BOOST_TEST((response ? response->status : 101) == status, method << " " << path);
        if (response)
            for (auto const& [name, value] : response->headers)
                BOOST_TEST(!name.starts_with("Access-Control"), path);
    }
}

// Protocol 4.2: the formula of the newest reference, where the operator wants it.
BOOST_AUTO_TEST_CASE(the_load_is_that_of_the_configured_formula)
{
    for (bool const strict : {true, false}) {
        auto setup = simulation_service_setup();
        setup.config.reference_load = !strict;
        Fixture fixture(setup);
        fixture.metrics.cpu = 10;
        fixture.metrics.next.memory_used = 96;
        fixture.world.advance(1s);
        BOOST_TEST(fixture.get("/load").body == (strict ? "96.0" : "32.0"));
    }
}

// Protocol 4.2.
BOOST_AUTO_TEST_CASE(load_is_the_mean_of_the_last_five_seconds)
{
    Fixture fixture;
    fixture.metrics.cpu = 100;
    fixture.world.advance(5s);
    BOOST_TEST(fixture.service.load() == 100);
    fixture.metrics.cpu = 0;
    fixture.world.advance(2s);
    BOOST_TEST(fixture.service.load() == 60);
    fixture.world.advance(3s);
    BOOST_TEST(fixture.service.load() == 0);
}

// Starting the server itself makes a small machine busy for a moment, which must not refuse anybody.
BOOST_AUTO_TEST_CASE(the_moment_of_the_start_is_no_load)
{
    testing::World world;
    world.advance(700ms); // looks come on whole seconds
    testing::ScriptedProcesses processes(world.clock);
    testing::RecordingLog log;
    testing::FixedMetrics metrics;
    ProjectFetcher fetcher(project_fetcher_params(), {}, log.logger());
    SimulationLauncher launcher(simulation_launcher_setup(2).config, simulation_launcher_setup(2).facts,
                                processes, world.clock, log.logger());
    SimulationService service(simulation_service_setup().config, simulation_service_setup().facts, fetcher,
                              launcher, metrics, world.clock, log.logger());
    async::TaskGroup tasks(world.executor());
    tasks.spawn(run(service));
    metrics.cpu = 100;
    world.advance(400ms);
    BOOST_TEST(service.load() == 0);
    metrics.cpu = 40;
    world.advance(1s);
    BOOST_TEST(service.load() == 40); // averaged since the start
    tasks.cancel_all();
    world.run(tasks.join());
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
    auto const first = std::get<HttpResponse>(fixture.service.respond(request));
    BOOST_TEST((std::get<HttpResponse>(fixture.service.respond(request)).shared ==
                first.shared)); // made once a second
    fixture.world.advance(1s);  // now its usage is sampled
    auto const page = std::get<HttpResponse>(fixture.service.respond(request)).text();
    BOOST_TEST(page.find("\"cpu\":50,") != std::string::npos);
    BOOST_TEST(page.find("\"memory\":12.3,") != std::string::npos);
    BOOST_TEST(page.find("\"log\":\"1.log\"") != std::string::npos);
    BOOST_TEST(page.find("https://github.com/o/r/blob/main/worlds/a.wbt") != std::string::npos);
    BOOST_TEST(page.find("\"state\":\"running\"") != std::string::npos);
    fixture.leave(browser);
}

// Protocol 6.4; quirk Q21.
BOOST_AUTO_TEST_CASE(what_webots_prints_of_its_mode_makes_a_simulation_idle_or_running)
{
    Fixture fixture;
    auto& script = fixture.processes.expect().prints(".\n");
    std::vector<std::pair<char const*, char const*>> const lines{
        {"real-time\n", "running"}, {"pause\n", "idle"},       {"fast\n", "running"}, {"pause\n", "idle"},
        {"step\n", "running"},      {"step\npause\n", "idle"}, {"noise\n", "idle"}};
    for (auto const& [line, state] : lines)
        script.after(1s).prints(line);
    auto& browser = fixture.start();
    for (auto const& [line, state] : lines) {
        fixture.world.advance(1s);
        auto const cell = "\"state\":\"" + std::string(state) + "\"";
        BOOST_TEST(fixture.get("/monitor").text().find(cell) != std::string::npos, line);
    }
    fixture.leave(browser);
}

// Protocol 9.2: counts of browsers; those without a simulator are idle.
BOOST_AUTO_TEST_CASE(the_monitor_log_counts_browsers_whose_simulation_runs_and_the_others)
{
    Texts lines;
    auto hooks = simulation_service_hooks();
    hooks.monitor_log = [&](std::string line) { lines.push_back(std::move(line)); };
    Fixture fixture(simulation_service_setup(), hooks);
    fixture.processes.expect().prints(".\nreal-time\n");
    fixture.processes.expect().prints(".\n");
    auto& running = fixture.start();
    auto& idle = fixture.start();
    auto& undecided = fixture.connect();
    fixture.world.advance(1s);
    BOOST_TEST_REQUIRE(lines.size() == 1u);
    BOOST_TEST(lines[0].find(", 1, 2, ") == lines[0].find(','), lines[0]);
    for (auto* browser : {&running, &idle, &undecided})
        fixture.leave(*browser);
    fixture.world.advance(1s);
    BOOST_TEST_REQUIRE(lines.size() == 2u);
    BOOST_TEST(lines[1].find(", 0, 0, ") == lines[1].find(','), lines[1]);
}

BOOST_AUTO_TEST_CASE(who_watches_the_monitor_gets_everything_once_and_then_a_point_a_second)
{
    Fixture fixture;
    fixture.world.advance(3s);
    testing::LoopbackChannel watcher(fixture.world.executor());
    ChannelInfo info;
    info.path = "/monitor";
    fixture.browsings.spawn(fixture.service.serve_websocket(std::move(info), watcher));
    fixture.world.settle();
    BOOST_TEST(watcher.sent.size() == 1u);
    BOOST_TEST(watcher.sent[0].find("\"series\"") != std::string::npos);
    fixture.processes.expect().prints(".\n").consumes(150, 1'000'000);
    auto& browser = fixture.start();
    fixture.world.advance(2s);
    BOOST_TEST(watcher.sent.size() == 3u);
    BOOST_TEST(watcher.sent[2].find("\"series\"") == std::string::npos);
    BOOST_TEST(watcher.sent[2].find("\"state\":\"idle\",\"age\":2,\"log\":\"1.log\",\"process\":1001,\"cpu\":"
                                    "150,\"memory\":1,\"processes\":1}") != std::string::npos,
               watcher.sent[2]);
    BOOST_TEST(fixture.service.sessions() == 1u); // a monitor page is none
    fixture.leave(browser);
    fixture.leave(watcher);
}

// One client must not keep the event loop from the others.
BOOST_AUTO_TEST_CASE(all_who_come_to_watch_within_a_second_get_one_text_and_miss_nothing)
{
    Fixture fixture;
    fixture.world.advance(3s);
    testing::LoopbackChannel first(fixture.world.executor());
    testing::LoopbackChannel second(fixture.world.executor());
    testing::LoopbackChannel third(fixture.world.executor());
    auto const watch = [&](testing::LoopbackChannel& watcher) {
        ChannelInfo info;
        info.path = "/monitor";
        fixture.browsings.spawn(fixture.service.serve_websocket(std::move(info), watcher));
        fixture.world.settle();
    };
    watch(first);
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.start();
    watch(second); // a snapshot made anew would list the simulation
    BOOST_TEST(second.sent.at(0) == first.sent.at(0));
    fixture.world.advance(1s);
    BOOST_TEST(second.sent.back().find("\"process\":1001") != std::string::npos, second.sent.back());
    watch(third);
    BOOST_TEST(third.sent.at(0).find("\"process\":1001") != std::string::npos, third.sent.at(0));
    for (auto* const each : {&browser, &first, &second, &third})
        fixture.leave(*each);
}

// Protocol 13: `/metrics`.
BOOST_AUTO_TEST_CASE(figures_count_starts_by_how_they_ended)
{
    Fixture fixture(Duration::zero(), 3);
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
    for (auto const* line :
         {"webots_start_stage_seconds_count{stage=\"fetch\"} 2\n",
          "webots_start_stage_seconds_count{stage=\"launch\"} 2\n", "webots_event_loop_lag_max_seconds 0\n",
          "webots_starts_total{result=\"ready\",reason=\"\"} 1\n",
          "webots_starts_total{result=\"abandoned\",reason=\"\"} 1\n",
          "webots_starts_total{result=\"failed\",reason=\"not_found\"} 1\n",
          "webots_start_stage_seconds_bucket{stage=\"ready\",le=\"1\"} 0\n",
          "webots_start_stage_seconds_bucket{stage=\"ready\",le=\"2.5\"} 1\n",
          "webots_start_stage_seconds_sum{stage=\"ready\"} 2\n", "webots_simulations{state=\"idle\"} 1\n"})
        BOOST_TEST(figures.find(line) != std::string::npos, line << " is not in\n" << figures);
    fixture.leave(ready);
}

// A page of this second that was made before the simulation began showed nothing of it.
BOOST_AUTO_TEST_CASE(whoever_has_been_told_of_a_simulation_finds_it_on_the_monitor_at_once)
{
    Fixture fixture(30s);
    auto const shows = [&fixture](std::string_view text) {
        return fixture.get("/monitor").text().find(text) != std::string::npos;
    };
    BOOST_TEST(!shows("a.wbt"));
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.start(returning_start);
    BOOST_TEST(browser.was_told("webots:"));
    BOOST_TEST(shows("worlds/a.wbt"));
    BOOST_TEST(shows("\"state\":\"idle\""));
    fixture.lose(browser);
    BOOST_TEST(shows("waiting for its browser"));
    auto& again = fixture.reconnect("token1");
    fixture.leave(again);
    BOOST_TEST(fixture.service.sessions() == 0u);
    BOOST_TEST(!shows("a.wbt"));
    // Refusals, which cost nothing, have no page made.
    auto const page = fixture.get("/monitor").shared;
    (void)fixture.start(R"({"start":{"url":"https://github.com/x/r/blob/main/worlds/a.wbt"}})");
    BOOST_TEST((fixture.get("/monitor").shared == page));
}

BOOST_AUTO_TEST_CASE(a_drained_server_takes_nothing_new_and_ends_with_its_last_simulation_if_asked)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n");
    auto& running = fixture.start();
    auto const ask = [&](std::string_view method, std::string_view path, std::string_view query,
                         bool is_operator) {
        IncomingRequest request;
        request.method = method;
        request.path = path;
        request.query = query;
        request.is_operator = is_operator;
        return std::get<HttpResponse>(fixture.service.respond(request));
    };
    BOOST_TEST(ask("GET", "/readyz", "", false).status == 200);
    BOOST_TEST(ask("GET", "/api/drain", "", true).status == 405);
    BOOST_TEST(ask("HEAD", "/api/drain", "exit", true).status == 405);
    BOOST_TEST(ask("POST", "/api/drain", "", false).status == 404);
    BOOST_TEST(ask("GET", "/api/drain", "", false).status == 404);
    BOOST_TEST(ask("POST", "/api/drain", "of", true).status == 400);
    BOOST_TEST(ask("POST", "/api/drain", "exit=1", true).body ==
               "Expected /api/drain, /api/drain?exit or /api/drain?off.");
    BOOST_TEST(ask("GET", "/readyz", "", false).status == 200);
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

// Protocol section 4.1.1, item 1.
BOOST_AUTO_TEST_CASE(reset_controller_puts_a_file_of_the_project_back_and_says_so)
{
    Fixture fixture;
    fixture.source.files = {"controllers/walk/walk.py"};
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.start();
    browser.browser_says(R"({"reset controller":"walk/walk.py"})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == "reset controller: walk/walk.py");
    BOOST_TEST(fixture.source.restored == (Texts{"/instances/1/project/controllers/walk/walk.py"}),
               boost::test_tools::per_element());
    browser.browser_says(R"({"reset controller":"walk/run.py"})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == "loading: Error: The project has no file controllers/walk/run.py.");
    browser.browser_says(R"({"reset controller":"walk/../../worlds/a.wbt"})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back().starts_with("loading: Error: Wrong message: "));
    BOOST_TEST(fixture.source.restored.size() == 1u);
    BOOST_TEST(!browser.close_code.has_value()); // the simulation goes on
    fixture.leave(browser);
}

namespace {

constexpr auto start_with_editor =
    R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","edit":true,"reconnect":true}})";
constexpr auto program_path = "/instances/1/project/controllers/walk/walk.py";

/// A server whose visitors may change programs, and what is in their folders.
struct ProgramsFixture
{
    explicit ProgramsFixture(bool allowed = true, LauncherSetup launching = simulation_launcher_setup(2))
        : fixture(setup(allowed), hooks(), std::move(launching))
    {
        files.texts[program_path] = "go";
        fixture.source.files = {"controllers/walk/walk.py"};
        fixture.processes.expect().prints(".\n");
    }

    static ServiceSetup setup(bool allowed)
    {
        auto made = simulation_service_setup(30s);
        made.config.allow_edit = allowed;
        return made;
    }

    SimulationServiceHooks hooks()
    {
        auto made = simulation_service_hooks();
        made.program_files = &files;
        return made;
    }

    testing::MemoryTextFiles files;
    Fixture fixture;
};

/// The same, with a compiler, and a controller in C.
struct CompiledFixture : ProgramsFixture
{
    CompiledFixture() : ProgramsFixture(true, launching())
    {
        files.texts["/instances/1/project/controllers/fly/fly.c"] = "int main() {}";
    }

    static LauncherSetup launching()
    {
        auto setup = simulation_launcher_setup(2);
        setup.facts.compiler.make = "/usr/bin/make";
        setup.facts.compiler.home = "/opt/webots";
        return setup;
    }
};

} // namespace

// Protocol 13.19.
BOOST_AUTO_TEST_CASE(a_page_with_an_editor_changes_the_programs_of_its_simulation)
{
    ProgramsFixture programs;
    auto& fixture = programs.fixture;
    auto& browser = fixture.start(start_with_editor);
    BOOST_TEST(browser.was_told(R"(files: [{"path":"walk/walk.py","changed":false}])"));
    browser.browser_says(R"({"read":"walk/walk.py"})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == R"(file: {"path":"walk/walk.py","text":"go"})");
    programs.files.texts[program_path] = "what the simulation writes is never read";
    browser.browser_says(R"({"write":{"path":"walk/walk.py","text":"stop"}})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == R"(file: {"path":"walk/walk.py","saved":true})");
    BOOST_TEST(programs.files.texts[program_path] == "stop");
    browser.browser_says(R"({"original":"walk/walk.py"})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == R"(file: {"path":"walk/walk.py","original":"go"})");
    fixture.lose(browser);
    auto& again = fixture.reconnect("token1");
    BOOST_TEST(again.was_told(R"(files: [{"path":"walk/walk.py","changed":true}])"));
    again.browser_says(R"({"reset controller":"walk/walk.py"})");
    again.browser_says(R"({"read":"walk/walk.py"})");
    fixture.world.settle();
    BOOST_TEST(again.sent.back() == R"(file: {"path":"walk/walk.py","text":"go"})");
    fixture.leave(again);
}

BOOST_AUTO_TEST_CASE(a_page_with_an_editor_is_told_the_lesson_of_its_world)
{
    for (auto const& [file, told] :
         {std::pair(R"({"title":"Move"})", R"(lesson: {"title":{"":"Move"},"about":{},"steps":[]})"),
          std::pair("{", "stderr:worlds/a.lesson.json is left out: It is no JSON object.")}) {
        ProgramsFixture programs;
        programs.files.texts["/instances/1/project/worlds/a.lesson.json"] = file;
        auto& browser = programs.fixture.start(start_with_editor);
        BOOST_TEST(browser.was_told(told));
        programs.fixture.lose(browser);
        auto& again = programs.fixture.reconnect("token1");
        BOOST_TEST(again.was_told(told));
        programs.fixture.leave(again);
    }
}

BOOST_AUTO_TEST_CASE(a_program_that_cannot_be_written_is_refused_and_the_simulation_goes_on)
{
    ProgramsFixture programs;
    auto& fixture = programs.fixture;
    auto& browser = fixture.start(start_with_editor);
    browser.browser_says(R"({"write":{"path":"run/run.py","text":"x"}})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back().starts_with(R"(file: {"path":"run/run.py","error":)"));
    programs.files.fuse = testing::Fuse(1);
    browser.browser_says(R"({"write":{"path":"walk/walk.py","text":"x"}})");
    browser.browser_says(R"({"read":"walk/walk.py"})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == R"(file: {"path":"walk/walk.py","text":"go"})");
    BOOST_TEST(
        browser.sent.at(browser.sent.size() - 2).starts_with(R"(file: {"path":"walk/walk.py","error":)"));
    BOOST_TEST(!browser.close_code.has_value());
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(programs_are_changed_only_where_the_operator_allows_it_and_the_page_has_an_editor)
{
    for (bool const allowed : {false, true}) {
        ProgramsFixture programs(allowed);
        programs.files.texts["/instances/1/project/worlds/a.lesson.json"] = "{}";
        auto& fixture = programs.fixture;
        auto& browser = allowed ? fixture.start() : fixture.start(start_with_editor);
        BOOST_TEST(!browser.was_told("files:"));
        BOOST_TEST(!browser.was_told("lesson:"));
        browser.browser_says(R"({"write":{"path":"walk/walk.py","text":"x"}})");
        fixture.world.settle();
        BOOST_TEST(browser.sent.back().find(R"("code":"not-editable")") != std::string::npos);
        BOOST_TEST(programs.files.texts[program_path] == "go");
        fixture.leave(browser);
    }
}

// Protocol 13.19.
BOOST_AUTO_TEST_CASE(a_controller_in_c_is_compiled_where_there_is_a_compiler)
{
    CompiledFixture compiled;
    auto& fixture = compiled.fixture;
    auto& browser = fixture.start(start_with_editor);
    BOOST_TEST(browser.was_told(R"(compiles: ["fly"])"));
    fixture.processes.expect().prints("fly.c:3:1: error: no\n/opt/webots/m: no\n").exits(2);
    browser.browser_says(R"({"compile":"fly"})");
    fixture.world.settle();
    BOOST_TEST(fixture.processes.started().back().argv.at(3) == "/instances/1/project/controllers/fly");
    BOOST_TEST(browser.sent.back().starts_with(
        R"(compiled: {"controller":"fly","output":"fly.c:3:1: error: no\n$WEBOTS_HOME/m: no","error":)"));
    BOOST_TEST(browser.sent.back().find(R"("code":"not-compiled")") != std::string::npos);
    fixture.processes.expect().prints("# linking fly\n").exits(0);
    browser.browser_says(R"({"compile":"fly"})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == R"(compiled: {"controller":"fly","output":"# linking fly"})");
    browser.browser_says(R"({"compile":"walk"})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back().find(R"("code":"no-compiler")") != std::string::npos);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_compiler_that_does_not_end_is_ended_and_the_page_is_answered_meanwhile)
{
    CompiledFixture compiled;
    auto& fixture = compiled.fixture;
    auto& browser = fixture.start(start_with_editor);
    fixture.processes.expect().prints(std::string(30'000, '"')).after(1h);
    browser.browser_says(R"({"compile":"fly"})");
    fixture.world.settle();
    browser.browser_says(R"({"read":"walk/walk.py"})");
    browser.browser_says(R"({"compile":"fly"})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.at(browser.sent.size() - 2) == R"(file: {"path":"walk/walk.py","text":"go"})");
    BOOST_TEST(browser.sent.back().find(R"("code":"not-saved")") != std::string::npos); // one at a time
    BOOST_TEST(fixture.processes.alive() == 2);
    fixture.world.advance(30s);
    BOOST_TEST(browser.sent.back().find(R"("code":"compiled-too-long")") != std::string::npos);
    BOOST_TEST(browser.sent.back().size() < 64u * 1024);
    BOOST_TEST(fixture.processes.alive() == 1);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_compiler_that_prints_without_end_is_ended)
{
    CompiledFixture compiled;
    auto& fixture = compiled.fixture;
    auto& browser = fixture.start(start_with_editor);
    auto& script = fixture.processes.expect();
    for (int i = 0; i < 40; ++i)
        script.prints(std::string(65'536, 'x'));
    script.after(1h);
    browser.browser_says(R"({"compile":"fly"})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back().find(R"("code":"not-compiled")") != std::string::npos);
    BOOST_TEST(fixture.processes.alive() == 1);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(nothing_is_compiled_for_a_page_that_has_left)
{
    CompiledFixture compiled;
    auto& fixture = compiled.fixture;
    auto& browser = fixture.start(start_with_editor);
    fixture.processes.expect().after(1h);
    browser.browser_says(R"({"compile":"fly"})");
    fixture.world.settle();
    BOOST_TEST(fixture.processes.alive() == 2);
    fixture.lose(browser);
    BOOST_TEST(fixture.processes.alive() == 1); // the simulation waits
    auto& again = fixture.reconnect("token1");
    fixture.processes.expect().exits(0);
    again.browser_says(R"({"compile":"fly"})");
    fixture.world.settle();
    BOOST_TEST(again.sent.back() == R"(compiled: {"controller":"fly","output":""})");
    fixture.leave(again);
}

BOOST_AUTO_TEST_CASE(without_a_compiler_nothing_is_compiled)
{
    ProgramsFixture programs;
    programs.files.texts["/instances/1/project/controllers/fly/fly.c"] = "";
    auto& browser = programs.fixture.start(start_with_editor);
    BOOST_TEST(!browser.was_told("compiles:"));
    browser.browser_says(R"({"compile":"fly"})");
    programs.fixture.world.settle();
    BOOST_TEST(browser.sent.back().find(R"("code":"no-compiler")") != std::string::npos);
    programs.fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(without_a_project_there_is_no_controller_to_reset)
{
    Fixture fixture;
    fixture.source.delay = 5s;
    auto& idle = fixture.start(R"({"reset controller":"walk/walk.py"})");
    BOOST_TEST(idle.sent.back() ==
               "loading: Error: No simulation was started: there is no controller to reset.");
    idle.sent.clear();
    idle.browser_says(R"({"compile":"walk"})");
    fixture.world.settle();
    BOOST_TEST(idle.was_told("loading: Error: No simulation was started"));
    auto& early = fixture.start();
    early.browser_says(R"({"reset controller":"walk/walk.py"})");
    fixture.world.settle();
    BOOST_TEST(early.sent.back().starts_with("loading: Error: The project is still being fetched"));
    fixture.leave(early);
    fixture.leave(idle);
}

// Protocol 4.1.4.
BOOST_AUTO_TEST_CASE(without_a_grace_no_token_is_given_and_a_lost_browser_ends_its_simulation)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.start();
    BOOST_TEST(!browser.was_told("reconnectToken:"));
    fixture.lose(browser);
    BOOST_TEST(fixture.service.sessions() == 0u);
    BOOST_TEST(fixture.log.contains(
        "[1] The simulation has lost its browser: the peer can't be reached; it is ended at once, "
        "since there is no \"reconnectGrace\""));
}

// Protocol 4.1.4, 13.10.
BOOST_AUTO_TEST_CASE(who_can_return_is_waited_for_when_its_page_is_left_and_others_are_not)
{
    ServiceSetup setup = simulation_service_setup();
    setup.config.reconnect_grace = std::nullopt;
    Fixture fixture(std::move(setup));
    for (int i = 0; i < 4; ++i)
        fixture.processes.expect().prints(".\n");
    auto& old = fixture.start();
    BOOST_TEST(!old.was_told("reconnectToken:"));
    old.browser_leaves(1001);
    fixture.world.settle();
    BOOST_TEST(fixture.service.sessions() == 0u);
    fixture.lose(fixture.start());
    BOOST_TEST(fixture.service.sessions() == 0u);

    auto& page = fixture.start(returning_start);
    page.browser_leaves(1001);
    fixture.world.advance(29s);
    BOOST_TEST(fixture.log.contains("[3] The simulation has lost its browser: its page was left or reloaded "
                                    "(close code 1001); it may return for "
                                    "30.0 s"));
    auto& back = fixture.reconnect("token1");
    BOOST_TEST(back.was_told("webots:"));
    auto& elsewhere = fixture.reconnect("token1");
    BOOST_TEST((back.close_code == std::uint16_t{4001}));
    elsewhere.browser_leaves(1000);
    fixture.world.settle();
    BOOST_TEST(fixture.service.sessions() == 0u);
}

// Protocol 4.1.3.
BOOST_AUTO_TEST_CASE(who_asks_for_heartbeats_hears_one_every_second_and_others_none)
{
    Fixture fixture(30s);
    fixture.processes.expect().prints(".\n");
    fixture.processes.expect().prints(".\n");
    auto& old = fixture.start();
    auto& page = fixture.start(returning_start);
    BOOST_TEST(page.sent.front() == "heartbeat: 1");
    BOOST_TEST(!old.was_told("heartbeat:"));
    auto const told = old.sent.size();
    auto const count = [](auto const& browser) {
        return std::count(browser.sent.begin(), browser.sent.end(), std::string("."));
    };
    fixture.world.advance(4500ms);
    BOOST_TEST(count(page) >= 4);
    BOOST_TEST(old.sent.size() == told);
    fixture.lose(page);
    auto& back = fixture.reconnect("token2");
    fixture.world.advance(2500ms);
    BOOST_TEST(back.sent.front() == "heartbeat: 1");
    BOOST_TEST(count(back) >= 2);
    fixture.leave(back);
    fixture.leave(old);
}

// Protocol 4.1.1, 4.1.3.
BOOST_AUTO_TEST_CASE(a_browser_extends_its_simulation_as_far_as_the_operator_allows)
{
    auto launching = simulation_launcher_setup(2);
    launching.config.extendable = 500s;
    Fixture fixture(simulation_service_setup(30s), std::move(launching));
    fixture.processes.expect().prints(".\n");
    auto& browser =
        fixture.start(R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","extend":true}})");
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600", "extendable: 500", "webots:ws://host.org:2001",
                                      "reconnectToken: token1"}),
               boost::test_tools::per_element());
    fixture.world.advance(100s);
    browser.sent.clear();
    browser.browser_says(R"({"extend":300})");
    browser.browser_says(R"({"extend":300})");
    browser.browser_says(R"({"extend":300})");
    fixture.world.settle();
    BOOST_TEST(browser.sent ==
                   (Texts{"shutdownTimeout: 800", "extendable: 200", "shutdownTimeout: 1000", "extendable: 0",
                          "loading: Error: The time of this simulation can't be extended any more."}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.lines("The browser has extended the simulation by 300 s") == 1);
    fixture.lose(browser);
    auto& back = fixture.reconnect("token1");
    BOOST_TEST(back.sent.front() == "shutdownTimeout: 1000");
    fixture.world.advance(999s);
    BOOST_TEST(fixture.service.sessions() == 1u);
    fixture.world.advance(2s);
    BOOST_TEST(back.was_told(error_line(core::Refused::time_limit, {{"seconds", "1100"}})));
    BOOST_TEST(fixture.service.sessions() == 0u);
}

BOOST_AUTO_TEST_CASE(without_the_operators_leave_nothing_is_extended_and_nobody_told)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n");
    auto& browser =
        fixture.start(R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","extend":true}})");
    BOOST_TEST(!browser.was_told("extendable:"));
    browser.browser_says(R"({"extend":300})");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() ==
               "loading: Error: The time of this simulation can't be extended any more.");
    fixture.leave(browser);
    auto& early = fixture.start(R"({"extend":300})");
    BOOST_TEST(early.sent.back() == "loading: Error: No simulation was started: there is none to extend.");
    fixture.leave(early);
}

BOOST_AUTO_TEST_CASE(a_lost_browser_returns_within_the_grace_and_finds_its_simulation)
{
    Fixture fixture(30s);
    fixture.processes.expect().prints(".\n").after(100s).prints(".\n");
    auto& browser = fixture.start();
    BOOST_TEST(browser.sent ==
                   (Texts{"shutdownTimeout: 600", "webots:ws://host.org:2001", "reconnectToken: token1"}),
               boost::test_tools::per_element());
    fixture.world.advance(50s);
    fixture.lose(browser);
    fixture.world.advance(29s);
    BOOST_TEST(fixture.service.sessions() == 1u);
    auto& back = fixture.reconnect("token1");
    BOOST_TEST(back.sent ==
                   (Texts{"shutdownTimeout: 521", "webots:ws://host.org:2001", "reconnectToken: token1"}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.browsings.size() == 1u); // the old conversation is over
    fixture.world.advance(60s);
    BOOST_TEST(back.sent.back() == ".");
    fixture.lose(back); // a second time
    fixture.world.advance(29s);
    auto& again = fixture.reconnect("token1");
    BOOST_TEST(again.was_told("webots:"));
    fixture.leave(again);
    BOOST_TEST(fixture.service.sessions() == 0u);
    BOOST_TEST(fixture.processes.started().size() == 1u);
}

BOOST_AUTO_TEST_CASE(after_the_grace_the_simulation_is_ended_and_the_token_worthless)
{
    Fixture fixture(30s);
    fixture.processes.expect().prints(".\n");
    fixture.lose(fixture.start());
    BOOST_TEST(fixture.log.contains("[1] The simulation has lost its browser: "));
    BOOST_TEST(fixture.log.contains("; it may return for 30.0 s"));
    BOOST_TEST(!fixture.log.contains("has not returned"));
    fixture.world.advance(30s);
    BOOST_TEST(fixture.log.contains("[1] The browser has not returned: the simulation is ended"));
    BOOST_TEST(fixture.processes.alive() == 0);
    BOOST_TEST(fixture.service.sessions() == 0u);
    auto& late = fixture.reconnect("token1");
    BOOST_TEST(late.sent.back() == "loading: Error: This simulation has ended. Please start it again.");
    BOOST_TEST(fixture.browsings.size() == 0u);
}

BOOST_AUTO_TEST_CASE(
    a_browser_that_closes_is_believed_and_one_that_is_lost_before_ready_has_nothing_to_return_to)
{
    Fixture fixture(30s);
    fixture.processes.expect().prints(".\n");
    fixture.processes.expect().prints("loading\n");
    fixture.leave(fixture.start());
    BOOST_TEST(fixture.service.sessions() == 0u);
    fixture.lose(fixture.start());
    BOOST_TEST(fixture.service.sessions() == 0u);
}

BOOST_AUTO_TEST_CASE(a_return_over_a_connection_that_only_the_browser_knows_to_be_dead_takes_over)
{
    Fixture fixture(30s);
    fixture.processes.expect().prints(".\n");
    auto& dead = fixture.start();
    auto& back = fixture.reconnect("token1");
    BOOST_TEST(back.was_told("webots:"));
    BOOST_TEST(dead.close_code.has_value());
    fixture.leave(back);
}

BOOST_AUTO_TEST_CASE(of_two_returns_at_once_one_gets_the_simulation)
{
    Fixture fixture(30s);
    fixture.processes.expect().prints(".\n");
    fixture.lose(fixture.start());
    auto& first = fixture.connect();
    auto& second = fixture.connect();
    first.browser_says(R"({"reconnect":"token1"})");
    second.browser_says(R"({"reconnect":"token1"})");
    fixture.world.settle();
    BOOST_TEST(first.was_told("webots:"));
    BOOST_TEST(second.was_told("loading: Error: This simulation has ended."));
    BOOST_TEST(fixture.service.sessions() == 1u);
    fixture.leave(first);
}

BOOST_AUTO_TEST_CASE(wrong_tokens_find_nothing)
{
    Fixture fixture(30s);
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.start();
    for (auto const* token : {"", "token", "token11", "TOKEN1"}) {
        auto& stranger = fixture.reconnect(token);
        BOOST_TEST(stranger.was_told("loading: Error: This simulation has ended."), token);
    }
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_simulation_that_ends_while_nobody_watches_is_cleaned_up_at_once)
{
    Fixture fixture(300s);
    fixture.processes.expect().prints(".\n").after(20s).crashes(SIGSEGV);
    fixture.lose(fixture.start());
    fixture.world.advance(20s);
    BOOST_TEST(fixture.service.sessions() == 0u);
    BOOST_TEST(
        fixture.log.contains(sentence(core::Refused::crashed, {{"how", "it was ended by signal 11"}})));
}

BOOST_AUTO_TEST_CASE(a_server_that_stops_waits_for_no_browser)
{
    Fixture fixture(300s);
    fixture.processes.expect().prints(".\n");
    fixture.lose(fixture.start());
    BOOST_TEST(fixture.service.sessions() == 1u);
    fixture.tasks.cancel_all();
    fixture.world.settle();
    BOOST_TEST(fixture.service.sessions() == 0u);
}

BOOST_AUTO_TEST_CASE(the_browser_may_be_lost_and_return_at_any_moment_and_nothing_stays)
{
    for (int seconds = 0; seconds < 14; ++seconds) {
        Fixture fixture(2s);
        fixture.processes.expect()
            .stubborn()
            .after(3s)
            .prints(".\n")
            .after(4s)
            .prints("real-time\n")
            .after(3s)
            .exits(1);
        auto& browser = fixture.start();
        fixture.world.advance(std::chrono::seconds(seconds));
        fixture.lose(browser);
        fixture.world.advance(1s);
        fixture.lose(fixture.reconnect("token1"));
        fixture.world.advance(5s);
    }
}

// A start, two resets of a controller and a reconnection: in the n-th run the n-th call of one seam fails.
int run_until_nothing_blows(testing::Fuse& (*fuse_of)(Fixture&), Duration grace)
{
    for (int call = 1;; ++call) {
        Fixture fixture(grace);
        fixture.source.files = {"controllers/walk/walk.py"};
        fuse_of(fixture) = testing::Fuse(call);
        fixture.processes.expect().prints(".\n");
        auto* browser = &fixture.start();
        std::vector<testing::LoopbackChannel*> conversations{browser};
        for (int i = 0; i < 2 && !browser->close_code; ++i) {
            browser->browser_says(R"({"reset controller":"walk/walk.py"})");
            fixture.world.settle();
        }
        if (grace > Duration::zero() && !browser->close_code) {
            fixture.lose(*browser);
            browser = conversations.emplace_back(&fixture.reconnect("token1"));
            BOOST_TEST(browser->was_told("webots:"));
        }
        std::ptrdiff_t errors = 0;
        for (auto const* each : conversations)
            errors += std::count_if(each->sent.begin(), each->sent.end(), [](std::string const& text) {
                return text.starts_with("loading: Error: ");
            });
        bool const blown = fuse_of(fixture).blown();
        bool const harmless = fixture.log.contains("Port 2001 is already in use."); // the next port was taken
        BOOST_TEST(errors == (blown && !harmless ? 1 : 0), "call " << call);
        if (!browser->close_code)
            fixture.leave(*browser);
        if (!blown)
            return call - 1;
    }
}

// Each fallible call of each seam fails in turn; the fixture checks that nothing is left behind.
BOOST_AUTO_TEST_CASE(whatever_fails_exactly_one_error_is_told_and_nothing_is_left)
{
    for (Duration const grace : {Duration::zero(), Duration(60s)}) {
        auto const source = [](Fixture& fixture) -> testing::Fuse& { return fixture.source.fuse; };
        auto const processes = [](Fixture& fixture) -> testing::Fuse& { return fixture.processes.fuse; };
        BOOST_TEST(run_until_nothing_blows(source, grace) == 3);    // fetch and two resets
        BOOST_TEST(run_until_nothing_blows(processes, grace) == 2); // a port and a program
    }
}

BOOST_AUTO_TEST_CASE(where_tickets_are_asked_for_each_starts_one_simulation)
{
    std::vector<std::string> shown;
    auto hooks = simulation_service_hooks();
    hooks.refuse_ticket = [&shown](std::string_view ticket) -> std::optional<Failure> {
        bool const is_new = std::find(shown.begin(), shown.end(), ticket) == shown.end();
        shown.emplace_back(ticket);
        if (ticket == "good" && is_new)
            return std::nullopt;
        return Failure(errc::refused, "No ticket.");
    };
    Fixture fixture(simulation_service_setup(30s), hooks);
    constexpr auto start = R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt"}})";
    for (auto const* path : {"/client", "/ticket/bad/client"}) {
        auto& stranger = fixture.connect("a", path);
        stranger.browser_says(start);
        fixture.world.settle();
        BOOST_TEST(stranger.sent == std::vector<std::string>{"loading: Error: No ticket."});
        BOOST_TEST(fixture.service.sessions() == 0u, path);
    }
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.connect("a", "/ticket/good/client");
    BOOST_TEST(shown.size() == 2u, "it counts when a simulation is asked for");
    browser.browser_says(start);
    fixture.world.settle();
    BOOST_TEST(browser.was_told("webots:"));
    // Its own token is enough for who lost the connection.
    fixture.lose(browser);
    auto& again = fixture.connect("a", "/ticket/good/client");
    again.browser_says(R"({"reconnect":"token1"})");
    fixture.world.settle();
    BOOST_TEST(again.was_told("webots:"));
    BOOST_TEST(shown.size() == 3u);
    fixture.leave(again);
}

BOOST_AUTO_TEST_CASE(where_no_tickets_are_asked_for_they_mean_nothing)
{
    Fixture fixture(simulation_service_setup());
    IncomingRequest request;
    request.method = "GET";
    request.upgrade = true;
    for (auto const* path : {"/ticket/any/client", "/client"}) {
        request.path = path;
        BOOST_TEST(std::holds_alternative<AcceptWebSocket>(fixture.service.respond(request)), path);
    }
    for (auto const* path : {"/ticket/any/load", "/ticket/client", "/ticket", "/ticket/a/b/client"})
        BOOST_TEST(fixture.get(path).status == 404, path);
}

BOOST_AUTO_TEST_CASE(worlds_that_may_run_are_listed_and_looked_for_again)
{
    testing::FixedWorldFinder finder;
    auto const add = [&finder](std::string url) {
        auto& found = finder.worlds.emplace_back();
        found.forge = "local:";
        found.world = ListedWorld(std::move(url));
    };
    add("local:/o/r/blob/main/worlds/a.wbt");
    add("local:/private/r/blob/main/worlds/b.wbt");
    auto hooks = simulation_service_hooks();
    hooks.world_finder = &finder;
    auto setup = simulation_service_setup();
    setup.config.repositories.allowed = {"local:/o"};
    setup.config.repositories.share_idle_time = 0;
    SimulationFixture fixture(setup, std::move(hooks));
    BOOST_TEST(list_of_worlds(fixture) == R"({"worlds":[{"url":"local:/o/r/blob/main/worlds/a.wbt"}]})");
    add("local:/o/r/blob/main/worlds/c.wbt");
    fixture.world.advance(31s);
    BOOST_TEST(finder.looked == 2);
    BOOST_TEST(list_of_worlds(fixture).find("c.wbt") != std::string::npos);
    setup.config.repositories.allowed = {"local:/private"};
    fixture.service.apply(setup.config);
    BOOST_TEST(list_of_worlds(fixture) ==
               R"({"worlds":[{"url":"local:/private/r/blob/main/worlds/b.wbt"}]})");
}

namespace {

struct PictureFixture
{
    PictureFixture() : fixture(simulation_service_setup(), with_taker(taker, talk), 3, ProcessLimits(), true)
    {
        talk.answers = {"real-time"};
    }

    static SimulationServiceHooks with_taker(testing::FixedPictureTaker& taker,
                                             testing::FixedSimulatorTalk& talk)
    {
        auto hooks = simulation_service_hooks();
        hooks.picture_taker = &taker;
        hooks.simulator_talk = &talk;
        return hooks;
    }

    bool has_picture()
    {
        bool const is_listed = list_of_worlds(fixture).find(key) != std::string::npos;
        auto const answer = fixture.get("/worlds/picture/" + key);
        BOOST_TEST(answer.status == (is_listed ? 200 : 404));
        return is_listed;
    }

    std::string const key = core::picture_key("https://github.com/o/r/blob/main/worlds/a.wbt");
    testing::FixedPictureTaker taker;
    testing::FixedSimulatorTalk talk;
    SimulationFixture fixture;
};

constexpr auto start_of_pictures =
    R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"mjpeg","size":"640x360","run":true}})";

std::string const good_picture = "\xff\xd8\xff" + std::string(3000, 'x');

} // namespace

BOOST_AUTO_TEST_CASE(the_first_good_picture_of_a_world_is_kept)
{
    PictureFixture pictures;
    auto& fixture = pictures.fixture;
    fixture.processes.expect().prints(".\nreal-time\n");
    auto& browser = fixture.say("", start_of_pictures);
    fixture.world.advance(7s);
    BOOST_TEST(!pictures.has_picture()); // it was asked too early
    BOOST_TEST_REQUIRE(pictures.taker.asked.size() == 1u);
    BOOST_TEST(pictures.taker.asked.front().port == 2001);
    pictures.taker.picture = "\xff\xd8\xff of one colour";
    fixture.world.advance(2s);
    BOOST_TEST(!pictures.has_picture());
    pictures.taker.picture = good_picture;
    fixture.world.advance(2s);
    BOOST_TEST(pictures.has_picture());
    auto const asked = pictures.taker.asked.size();
    fixture.world.advance(60s);
    BOOST_TEST(pictures.taker.asked.size() == asked);
    fixture.leave(browser);
    fixture.world.advance(60s);
    BOOST_TEST(pictures.has_picture());
}

BOOST_AUTO_TEST_CASE(a_simulation_that_shows_nothing_is_not_asked_for_ever)
{
    PictureFixture pictures;
    auto& fixture = pictures.fixture;
    fixture.processes.expect().prints(".\nreal-time\n");
    auto& browser = fixture.say("", start_of_pictures);
    fixture.world.advance(300s);
    BOOST_TEST(pictures.taker.asked.size() == 8u);
    BOOST_TEST(!pictures.has_picture());
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(projects_of_websites_and_scenes_have_no_pictures)
{
    PictureFixture pictures;
    pictures.taker.picture = good_picture;
    auto& fixture = pictures.fixture;
    fixture.processes.expect().prints(".\nreal-time\n");
    fixture.processes.expect().prints(".\nreal-time\n");
    auto& website = fixture.say("", init_message);
    auto& scene = fixture.say("", R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt"}})");
    fixture.world.advance(60s);
    BOOST_TEST(pictures.taker.asked.empty());
    fixture.leave(website);
    fixture.leave(scene);
}

BOOST_AUTO_TEST_CASE(no_picture_is_fetched_that_the_simulator_was_not_asked_for)
{
    PictureFixture pictures;
    pictures.taker.picture = good_picture;
    auto& fixture = pictures.fixture;
    fixture.processes.expect().prints(".\nreal-time\n");
    fixture.processes.expect().prints(".\nreal-time\n");
    auto& without_size = fixture.say("", start_message);
    pictures.talk.answers.clear();
    auto& unanswered = fixture.say("", start_of_pictures);
    fixture.world.advance(60s);
    BOOST_TEST(pictures.taker.asked.empty());
    fixture.leave(without_size);
    fixture.leave(unanswered);
}

BOOST_AUTO_TEST_SUITE_END()
