// Simulations that are ready before anybody asks, in virtual time.
#include "simulation_fixture.hpp"

#include "core/text.hpp"

#include <webots_cloud/load_report.hpp>
#include <webots_cloud/testing/memory_text_files.hpp>

#include <csignal>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol section 4.1; the key "staged" is ours.
BOOST_AUTO_TEST_SUITE(stager)

namespace {

using Texts = std::vector<std::string>;

constexpr auto world = "https://github.com/o/r/blob/main/worlds/a.wbt";
constexpr auto start_message =
    R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"mjpeg"}})";
constexpr auto start_in_mode =
    R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"x3d"}})";
constexpr auto init_message = R"({"init":["https://w.org","robots","a.wbt"]})";

std::string stage_message_of(int count)
{
    return core::concat(R"({"stage":[{"url":")", world, R"(","mode":"mjpeg","count":)", std::to_string(count),
                        "}]}");
}

std::string staged_message_of(int ready, int taken)
{
    return core::concat(R"({"staged":[{"url":")", world, R"(","mode":"mjpeg","ready":)",
                        std::to_string(ready), R"(,"taken":)", std::to_string(taken), "}]}");
}

SimulationServiceConfig staging_config(int count, Duration max_age = 600s)
{
    auto config = simulation_service_setup().config;
    StagedWorldConfig staged;
    staged.url = world;
    staged.count = count;
    config.staged.push_back(staged);
    config.staged_max_age = max_age;
    return config;
}

/// A server that stages nothing until it is told to.
struct Fixture : SimulationFixture
{
    explicit Fixture(int max_simulations = 2, SimulationServiceHooks hooks = simulation_service_hooks())
        : SimulationFixture(simulation_service_setup(), std::move(hooks), max_simulations)
    {}

    void stage(SimulationServiceConfig config = staging_config(1))
    {
        service.apply(std::move(config));
        world.settle();
    }

    /// One is ready, and has process 1001.
    void stage_one()
    {
        processes.expect().prints(".\n");
        stage();
        BOOST_TEST(processes.started().size() == 1u);
        BOOST_TEST(ready() == 1);
    }

    testing::LoopbackChannel& start(std::string message = start_message, std::string const& client = {})
    {
        return say(client, std::move(message));
    }

    std::string figure(std::string_view name)
    {
        auto const text = "\n" + get("/metrics").text();
        auto const line = "\n" + std::string(name) + " ";
        auto const found = text.find(line);
        auto const begin = found + line.size();
        return found == std::string::npos ? std::string()
                                          : text.substr(begin, text.find('\n', begin) - begin);
    }

    int ready() { return std::stoi(figure("webots_simulations_staged")); }

    LoadReport report()
    {
        std::pair<std::string_view, std::string_view> const accept[] = {{"Accept", "application/json"}};
        IncomingRequest load;
        load.method = "GET";
        load.path = "/load";
        load.headers = accept;
        return parse_load_report(std::get<HttpResponse>(service.respond(load)).body).value();
    }
};

} // namespace

BOOST_AUTO_TEST_CASE(a_browser_gets_the_staged_simulation_at_once_and_the_next_one_is_made)
{
    Fixture fixture(3);
    fixture.stage_one();
    BOOST_TEST(fixture.log.contains("[1] Staging a simulation from https://github.com/o/r/blob/main"));
    fixture.world.advance(100s);
    fixture.source.delay = 5s;
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.start();
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600", "webots:ws://host.org:2001"}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.log.contains("[2] Gets the staged simulation 1"));
    BOOST_TEST(fixture.figure("webots_staged_taken_total") == "1");
    BOOST_TEST(fixture.service.sessions() == 1u);
    BOOST_TEST(fixture.ready() == 0);
    fixture.world.advance(5s);
    BOOST_TEST(fixture.processes.started().size() == 2u);
    BOOST_TEST(fixture.ready() == 1);
    fixture.leave(browser);
    BOOST_TEST(fixture.log.contains("[1] Webots [1001] was killed"));
}

// Any link to the world will do.
BOOST_AUTO_TEST_CASE(a_browser_gets_all_that_those_get_who_wait_for_the_start)
{
    Fixture fixture;
    fixture.source.notice = "A notice.";
    fixture.source.forbidden = {"secret"};
    fixture.stage_one();
    auto& browser = fixture.start(
        R"({"start":{"url":"https://github.com/o/r/raw/main/worlds/a.wbt","mode":"mjpeg","reconnect":true,"heartbeat":true}})");
    BOOST_TEST_REQUIRE(browser.sent.size() == 5u);
    BOOST_TEST(browser.sent[0] == "heartbeat: 1");
    BOOST_TEST(browser.sent[1] == "loading: A notice.");
    BOOST_TEST(browser.sent[2].find("secret") != std::string::npos);
    BOOST_TEST(browser.sent[3] == "shutdownTimeout: 600");
    BOOST_TEST(browser.sent[4] == "webots:ws://host.org:2001");
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(only_a_page_with_an_editor_is_told_what_there_is_to_change)
{
    testing::MemoryTextFiles files;
    files.texts["/instances/1/project/controllers/walk/walk.py"] = "go";
    files.texts["/instances/2/project/controllers/walk/walk.py"] = "go";
    auto hooks = simulation_service_hooks();
    hooks.program_files = &files;
    Fixture fixture(3, std::move(hooks));
    fixture.processes.expect().prints(".\n");
    fixture.processes.expect().prints(".\n");
    auto config = staging_config(1);
    config.allow_edit = true;
    fixture.stage(config);
    auto& without = fixture.start();
    BOOST_TEST(without.sent.back().starts_with("webots:"));
    auto& with = fixture.start(
        R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"mjpeg","edit":true}})");
    BOOST_TEST(with.sent.back().find("walk/walk.py") != std::string::npos);
    BOOST_TEST(fixture.figure("webots_staged_taken_total") == "2");
    fixture.leave(without);
    fixture.leave(with);
}

BOOST_AUTO_TEST_CASE(its_browser_may_return_to_it_as_to_others)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n");
    auto config = staging_config(1);
    config.reconnect_grace = 30s;
    fixture.stage(config);
    auto& browser = fixture.start();
    BOOST_TEST(browser.sent.back() == "reconnectToken: token1");
    fixture.lose(browser);
    fixture.world.advance(10s);
    auto& again = fixture.start(R"({"reconnect":"token1"})");
    BOOST_TEST(again.sent ==
                   (Texts{"shutdownTimeout: 590", "webots:ws://host.org:2001", "reconnectToken: token1"}),
               boost::test_tools::per_element());
    fixture.lose(again);
    fixture.world.advance(31s);
    BOOST_TEST(fixture.service.sessions() == 0u);
}

BOOST_AUTO_TEST_CASE(only_a_start_of_the_same_world_in_the_same_mode_gets_it)
{
    for (auto const* message :
         {init_message, start_in_mode,
          R"({"start":{"url":"https://github.com/o/r/blob/other/worlds/a.wbt","mode":"mjpeg"}})"}) {
        Fixture fixture(3);
        fixture.stage_one();
        fixture.processes.expect().prints(".\n");
        auto& browser = fixture.start(message);
        BOOST_TEST(browser.sent.back() == "webots:ws://host.org:2002");
        BOOST_TEST(fixture.ready() == 1);
        fixture.leave(browser);
    }
    Fixture fixture(3);
    fixture.stage_one();
    auto& page = fixture.start(
        R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","fetch_only":true}})");
    BOOST_TEST(page.was_told("fetched:"));
    BOOST_TEST(fixture.ready() == 1);
}

BOOST_AUTO_TEST_CASE(limits_and_rules_hold_for_who_takes_it_and_not_for_staged_ones)
{
    Fixture fixture(9);
    for (int i = 0; i < 4; ++i)
        fixture.processes.expect().prints(".\n");
    auto config = staging_config(3);
    config.simulations_per_address = 1;
    config.simulations_per_world = 2;
    fixture.stage(config);
    BOOST_TEST(fixture.ready() == 3);
    auto& first = fixture.start(start_message, "a");
    BOOST_TEST(first.was_told("webots:"));
    BOOST_TEST(fixture.start(start_message, "a").sent.back().starts_with("loading: Error: "));
    auto& second = fixture.start(start_message, "b");
    BOOST_TEST(second.was_told("webots:"));
    BOOST_TEST(fixture.start(start_message, "c").sent.back().starts_with("loading: Error: "));
    BOOST_TEST(fixture.figure("webots_staged_taken_total") == "2");
    fixture.leave(first);
    config.repositories.allowed.clear();
    config.repositories.share_idle_time = 0;
    fixture.stage(config);
    BOOST_TEST(fixture.start(start_message, "a").sent.back().starts_with("loading: Error: "));
    BOOST_TEST(fixture.figure("webots_staged_taken_total") == "2");
    fixture.leave(second);
}

BOOST_AUTO_TEST_CASE(others_are_told_of_no_simulation_and_of_all_places)
{
    Fixture fixture;
    fixture.metrics.host.cores = 2;
    fixture.metrics.host.memory_bytes = 1'000'000'000;
    fixture.stage_one();
    fixture.world.advance(1s);
    auto const report = fixture.report();
    BOOST_TEST(report.sessions.value() == 0);
    BOOST_TEST(report.starting.value() == 0);
    BOOST_TEST(report.capacity.value() == 2);
    BOOST_TEST(report.arrivals.value() == 0);
    BOOST_TEST(report.departures.value() == 0);
    BOOST_TEST(fixture.service.sessions() == 0u);
    BOOST_TEST(fixture.figure("webots_simulations{state=\"idle\"}") == "0");
    auto const page = fixture.get("/monitor").text();
    BOOST_TEST(page.find("\"state\":\"staged\"") != std::string::npos);
    BOOST_TEST(page.find("\"staged\":1,") != std::string::npos);
    auto& browser = fixture.start();
    BOOST_TEST(fixture.report().sessions.value() == 1);
    BOOST_TEST(fixture.report().arrivals.value() == 1);
    BOOST_TEST(fixture.figure("webots_starts_total{result=\"ready\",reason=\"\"}") == "1");
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_full_machine_gives_it_back_and_the_browser_gets_its_seat_when_it_has_ended)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").stubborn();
    fixture.stage();
    BOOST_TEST(fixture.ready() == 1);
    fixture.processes.expect().prints("open\n");
    auto& first = fixture.start(init_message);
    BOOST_TEST(first.was_told("webots:ws://host.org:2002"));
    fixture.processes.expect().prints("open\n");
    auto& second =
        fixture.start(init_message); // the staged one still ends: it had to when the first one came
    BOOST_TEST(!second.was_told("webots:"));
    BOOST_TEST(!second.close_code.has_value());
    fixture.world.advance(1500ms);
    BOOST_TEST(second.was_told("webots:ws://host.org:2001"));
    BOOST_TEST(fixture.ready() == 0);
    BOOST_TEST(fixture.start(init_message).was_told("loading: Error: Too many open connections (>2)"));
    fixture.leave(first);
    fixture.leave(second);
    fixture.processes.expect().prints(".\n");
    fixture.world.advance(2s);
    BOOST_TEST(fixture.ready() == 1);
}

BOOST_AUTO_TEST_CASE(who_waits_for_a_seat_may_leave)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").stubborn();
    fixture.stage();
    fixture.processes.expect().prints("open\n");
    auto& first = fixture.start(init_message);
    auto& second = fixture.start(init_message);
    fixture.leave(second);
    BOOST_TEST(fixture.processes.started().size() == 2u);
    fixture.leave(first);
}

BOOST_AUTO_TEST_CASE(a_machine_with_little_memory_gives_it_back)
{
    Fixture fixture;
    fixture.stage_one();
    fixture.metrics.next.memory_used = 95;
    fixture.world.advance(2s);
    BOOST_TEST(fixture.ready() == 0);
    BOOST_TEST(fixture.processes.alive() == 0);
}

BOOST_AUTO_TEST_CASE(a_server_that_drains_or_stages_other_worlds_gives_it_back)
{
    Fixture fixture;
    fixture.stage_one();
    fixture.service.drain(false);
    fixture.world.advance(1s);
    BOOST_TEST(fixture.processes.alive() == 0);
    BOOST_TEST(fixture.launcher.running() == 0u);
    BOOST_TEST(fixture.source.directories().empty());

    Fixture other;
    other.stage_one();
    other.stage(simulation_service_setup().config);
    BOOST_TEST(other.processes.alive() == 0);
}

BOOST_AUTO_TEST_CASE(a_drained_server_ends_although_something_was_staged)
{
    Fixture fixture;
    fixture.stage_one();
    fixture.service.drain(true);
    fixture.world.advance(2s);
    BOOST_TEST(fixture.tasks.size() == 0u);
}

BOOST_AUTO_TEST_CASE(one_that_is_fetched_or_loaded_is_given_back_as_well)
{
    Fixture fetching;
    fetching.source.delay = 5s;
    fetching.stage();
    BOOST_TEST(fetching.source.fetching == 1);
    fetching.service.drain(false);
    fetching.world.advance(1s);
    BOOST_TEST(fetching.source.fetching == 0);

    Fixture loading;
    loading.processes.expect().prints("loading\n");
    loading.stage();
    BOOST_TEST(loading.ready() == 0);
    loading.service.drain(false);
    loading.world.advance(1s);
    BOOST_TEST(loading.processes.alive() == 0);
    BOOST_TEST(!loading.log.contains("error"));
}

BOOST_AUTO_TEST_CASE(a_new_commit_and_age_have_it_replaced)
{
    Fixture fixture(4);
    fixture.stage_one();
    fixture.source.revision = "another";
    fixture.processes.expect().prints(".\n");
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.start(start_in_mode); // whose fetch shows that there is a new commit
    fixture.world.advance(1s);
    BOOST_TEST(fixture.processes.started().size() == 3u);
    BOOST_TEST(fixture.processes.alive() == 2);
    BOOST_TEST(fixture.ready() == 1);
    fixture.world.advance(590s);
    BOOST_TEST(fixture.processes.started().size() == 3u);
    fixture.processes.expect().prints(".\n");
    fixture.world.advance(12s);
    BOOST_TEST(fixture.processes.started().size() == 4u);
    BOOST_TEST(fixture.ready() == 1);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_changed_folder_has_it_replaced_before_anybody_asks)
{
    Fixture fixture;
    fixture.source.tells_revision = true;
    fixture.source.revision = "folder 1";
    fixture.stage_one();
    fixture.world.advance(60s);
    BOOST_TEST(fixture.processes.started().size() == 1u);
    fixture.processes.expect().prints(".\n");
    fixture.source.revision = "folder 2";
    fixture.world.advance(5s);
    BOOST_TEST(fixture.processes.started().size() == 2u);
    BOOST_TEST(fixture.ready() == 1);
    fixture.world.advance(60s);
    BOOST_TEST(fixture.processes.started().size() == 2u);
}

BOOST_AUTO_TEST_CASE(one_that_is_killed_or_ended_by_the_operator_is_replaced_later_and_later)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(10s).crashes(SIGKILL);
    fixture.stage();
    fixture.processes.expect().prints(".\n").after(10s).crashes(SIGKILL);
    fixture.world.advance(10s);
    BOOST_TEST(fixture.ready() == 0);
    BOOST_TEST(fixture.processes.started().size() == 1u);
    fixture.world.advance(2s);
    BOOST_TEST(fixture.processes.started().size() == 2u);
    BOOST_TEST(fixture.ready() == 1);
    fixture.processes.expect().prints(".\n");
    fixture.world.advance(10s);
    BOOST_TEST(fixture.processes.started().size() == 2u); // two seconds now
    fixture.world.advance(3s);
    BOOST_TEST(fixture.ready() == 1);

    IncomingRequest end;
    end.method = "POST";
    end.path = "/api/end";
    end.query = "simulation=3";
    end.is_operator = true;
    BOOST_TEST(std::get<HttpResponse>(fixture.service.respond(end)).status == 200);
    fixture.world.settle();
    BOOST_TEST(fixture.ready() == 0);
    BOOST_TEST(fixture.figure("webots_starts_total{result=\"failed\",reason=\"start_failed\"}") == "0");
}

BOOST_AUTO_TEST_CASE(a_world_that_fails_is_tried_seldom_and_counts_as_no_failed_start)
{
    Fixture fixture;
    auto config = staging_config(1);
    config.staged[0].url = "https://github.com/o/r/blob/main/worlds/missing.wbt";
    fixture.stage(config);
    fixture.world.advance(3600s);
    auto const tries = fixture.lines("Staging a simulation");
    BOOST_TEST(tries > 12);
    BOOST_TEST(tries < 25);
    BOOST_TEST(fixture.figure("webots_starts_total{result=\"failed\",reason=\"not_found\"}") == "0");
    BOOST_TEST(fixture.source.directories().empty());
}

// It ends at once, prints garbage and crashes, never loads and does not end when it is told to, dies when it
// is ready, or does not stay paused.
BOOST_AUTO_TEST_CASE(two_hundred_stagings_of_a_hostile_world_leave_nothing_and_no_seat_is_lost)
{
    constexpr std::size_t stagings = 200;
    Fixture fixture(3);
    for (std::size_t i = 0; i < stagings; ++i) {
        auto& script = fixture.processes.expect();
        switch (i % 5) {
        case 0:
            script.exits(1);
            break;
        case 1:
            script.prints(std::string(100'000, '\0') + "\xff\n\n").crashes(SIGSEGV);
            break;
        case 2:
            script.stubborn();
            break;
        case 3:
            script.prints(".\n").after(100ms).exits(0);
            break;
        default:
            script.prints(".\n").after(100ms).prints("real-time\n");
        }
    }
    fixture.stage();
    std::size_t minutes = 0;
    for (; fixture.processes.started().size() < stagings && minutes < 48 * 60; ++minutes) {
        fixture.world.advance(60s);
        BOOST_TEST_REQUIRE(fixture.processes.alive() <= 1);
    }
    BOOST_TEST(fixture.processes.started().size() == stagings);
    BOOST_TEST(minutes > stagings * 4); // five minutes apart after the first nine
    fixture.stage(simulation_service_setup().config);
    fixture.world.advance(2s);
    BOOST_TEST(fixture.processes.alive() == 0);
    BOOST_TEST(fixture.source.directories().empty());
    for (int i = 0; i < 3; ++i) {
        fixture.processes.expect().prints("open\n");
        BOOST_TEST(fixture.start(init_message).was_told("webots:"));
    }
    for (auto const& browser : fixture.browsers)
        browser->browser_leaves();
    fixture.world.settle();
}

BOOST_AUTO_TEST_CASE(a_world_that_does_not_stay_paused_is_not_staged)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(100ms).prints("real-time\n");
    fixture.stage();
    fixture.world.advance(900ms);
    BOOST_TEST(fixture.ready() == 0);
    BOOST_TEST(fixture.processes.alive() == 0);
    BOOST_TEST(fixture.log.contains("[1] The world does not stay paused"));
}

BOOST_AUTO_TEST_CASE(a_browser_that_leaves_in_the_moment_in_which_it_gets_it_leaves_nothing)
{
    Fixture fixture;
    fixture.stage_one();
    auto& browser = fixture.connect();
    browser.browser_says(start_message);
    browser.browser_leaves();
    fixture.world.settle();
    BOOST_TEST(fixture.processes.alive() == 0);
    BOOST_TEST(fixture.service.sessions() == 0u);
}

BOOST_AUTO_TEST_CASE(a_browser_that_comes_when_it_crashes_gets_another_one)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(10s).crashes(SIGKILL);
    fixture.stage();
    auto& browser = fixture.connect();
    auto& clock = fixture.world.clock;
    clock.move_to(clock.now() + 10s);
    while (clock.fire_next(clock.now())) // it has ended, and nobody knows yet
        ;
    fixture.processes.expect().prints(".\n");
    browser.browser_says(start_message);
    fixture.world.settle();
    BOOST_TEST(browser.was_told("webots:"));
    fixture.leave(browser);
}

// Protocol section 13.20.
BOOST_AUTO_TEST_CASE(a_session_server_has_simulations_staged_as_long_as_it_is_there)
{
    Fixture fixture(5);
    BOOST_TEST(fixture.report().staging.value() == 4); // one seat stays free
    for (int i = 0; i < 3; ++i)
        fixture.processes.expect().prints(".\n");
    auto& classes = fixture.say({}, stage_message_of(2));
    BOOST_TEST(fixture.ready() == 2);
    BOOST_TEST(classes.sent.back() == staged_message_of(2, 0));
    BOOST_TEST(fixture.report().sessions.value() == 0);

    auto& browser = fixture.start();
    BOOST_TEST(browser.was_told("webots:"));
    BOOST_TEST(classes.sent.back() == staged_message_of(1, 1));
    fixture.world.advance(5s);
    BOOST_TEST(fixture.ready() == 1); // the student's seat is used: no other one is made
    fixture.leave(browser);
    classes.browser_says(stage_message_of(2)); // it is free again
    fixture.world.settle();
    BOOST_TEST(fixture.ready() == 2);
    BOOST_TEST(classes.sent.back() == staged_message_of(2, 1));

    fixture.leave(classes);
    fixture.world.advance(2s);
    BOOST_TEST(fixture.processes.alive() == 0);
    BOOST_TEST(fixture.launcher.running() == 0u);
}

BOOST_AUTO_TEST_CASE(a_session_server_that_falls_silent_or_says_something_else_is_forgotten)
{
    Fixture fixture(5);
    for (int i = 0; i < 3; ++i)
        fixture.processes.expect().prints(".\n");
    auto& lost = fixture.say({}, stage_message_of(1));
    for (int i = 0; i < 3; ++i) {
        fixture.world.advance(20s);
        lost.browser_says(stage_message_of(1));
        fixture.world.settle();
        BOOST_TEST(fixture.ready() == 1);
    }
    fixture.world.advance(31s);
    BOOST_TEST(lost.close_code.has_value());
    BOOST_TEST(fixture.ready() == 0);

    auto& confused = fixture.say({}, stage_message_of(1));
    BOOST_TEST(fixture.ready() == 1);
    confused.browser_says(R"({"start":{"url":"u"}})");
    fixture.world.settle();
    BOOST_TEST(confused.close_code.has_value());
    BOOST_TEST(fixture.ready() == 0);

    auto& flood = fixture.say({}, stage_message_of(1));
    for (int i = 0; i < 50; ++i)
        flood.browser_says(stage_message_of(1));
    fixture.world.settle();
    BOOST_TEST(flood.close_code.has_value());
    fixture.world.advance(2s);
    BOOST_TEST(fixture.processes.alive() == 0);
}

BOOST_AUTO_TEST_CASE(session_servers_have_no_more_staged_than_the_operator_allows)
{
    Fixture fixture(9);
    for (int i = 0; i < 4; ++i)
        fixture.processes.expect().prints(".\n");
    auto config = staging_config(1);
    config.staged_for_classes = 3;
    fixture.stage(config);
    BOOST_TEST(fixture.report().staging.value() == 3);
    auto& first = fixture.say({}, stage_message_of(2));
    auto& second = fixture.say({}, stage_message_of(10'000));
    BOOST_TEST(fixture.ready() == 4); // with that of the configuration
    BOOST_TEST(first.sent.back() == staged_message_of(2, 0));
    BOOST_TEST(second.sent.back() == staged_message_of(2, 0)); // whose they are is not kept
    config.staged_for_classes = 0;
    fixture.stage(config);
    BOOST_TEST(fixture.ready() == 1);
    BOOST_TEST(!fixture.report().staging.has_value());
    BOOST_TEST(fixture.say({}, stage_message_of(1)).sent.back() ==
               "loading: Error: Wrong message: nothing more is staged here for classes.");
    fixture.leave(first);
    fixture.leave(second);
}

BOOST_AUTO_TEST_CASE(only_worlds_that_could_be_started_are_staged_for_classes)
{
    Fixture fixture(5);
    auto& classes = fixture.say(
        {},
        R"({"stage":[{"url":"https://elsewhere.org/o/r/blob/main/worlds/a.wbt","mode":"mjpeg","count":2},)"
        R"({"url":"https://github.com/other/r/blob/main/worlds/a.wbt","mode":"mjpeg","count":2},)"
        R"({"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"4d","count":2}]})");
    fixture.world.advance(5s);
    BOOST_TEST(fixture.processes.started().empty());
    BOOST_TEST(fixture.ready() == 0);
    fixture.leave(classes);
}

BOOST_AUTO_TEST_CASE(browsers_behind_a_session_server_and_those_without_a_ticket_have_nothing_staged)
{
    auto hooks = simulation_service_hooks();
    hooks.refuse_ticket = [](std::string_view ticket) {
        return ticket == "good" ? std::optional<Failure>() : Failure(errc::refused, "No ticket.");
    };
    Fixture fixture(5, std::move(hooks));
    BOOST_TEST(fixture.say({}, stage_message_of(1)).sent.back() == "loading: Error: No ticket.");
    ChannelInfo info;
    info.path = "/ticket/good/client";
    info.public_address = "wss://site.org/2000";
    auto& browser = fixture.connect_as(info);
    browser.browser_says(stage_message_of(1));
    fixture.world.settle();
    BOOST_TEST(browser.was_told("loading: Error: "));
    fixture.processes.expect().prints(".\n");
    auto& server = fixture.connect({}, "/ticket/good/client");
    server.browser_says(stage_message_of(1));
    fixture.world.settle();
    BOOST_TEST(fixture.ready() == 1);
    fixture.leave(server);
}

BOOST_AUTO_TEST_CASE(nothing_is_staged_while_a_browser_waits_for_its_start)
{
    Fixture fixture(4);
    fixture.processes.expect().prints("loading\n").after(20s).prints("open\n");
    auto& browser = fixture.start(init_message);
    fixture.processes.expect().prints(".\n");
    fixture.stage();
    fixture.world.advance(19s);
    BOOST_TEST(fixture.processes.started().size() == 1u);
    fixture.world.advance(2s);
    BOOST_TEST(fixture.ready() == 1);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_SUITE_END()
