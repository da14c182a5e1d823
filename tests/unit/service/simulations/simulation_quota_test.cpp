// How much of a simulation server one client may use.
#include "refusal_sentences.hpp"
#include "simulation_fixture.hpp"

#include <csignal>

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(simulation_quota)

namespace {

constexpr auto start_message = R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt"}})";
constexpr auto refusal = "loading: Error: Your network has ";

ServiceSetup quota_setup(std::size_t max_of_a_client)
{
    auto setup = simulation_service_setup(30s);
    setup.config.simulations_per_address = static_cast<int>(max_of_a_client);
    return setup;
}

ServiceSetup silence_setup(std::size_t max_of_all, std::size_t max_of_a_client)
{
    auto setup = quota_setup(0);
    setup.config.max_silent = max_of_all;
    setup.config.silent_per_address = max_of_a_client;
    return setup;
}

struct Fixture : SimulationFixture
{
    explicit Fixture(std::size_t max_of_a_client) : Fixture(quota_setup(max_of_a_client)) {}
    explicit Fixture(ServiceSetup setup) : SimulationFixture(std::move(setup), 10) {}

    testing::LoopbackChannel& start(std::string const& client) { return say(client, start_message); }

    /// A simulation that runs.
    testing::LoopbackChannel& run_one(std::string const& client)
    {
        processes.expect().prints(".\n");
        auto& browser = start(client);
        BOOST_TEST(browser.was_told("webots:"));
        return browser;
    }
};

using Texts = std::vector<std::string>;

/// Ways in which a start of the client "a" can end.
std::pair<std::string, void (*)(Fixture&)> const ends[] = {
    {"the repository is refused",
     [](Fixture& f) {
         BOOST_TEST(f.say("a", R"({"start":{"url":"https://github.com/x/r/blob/main/worlds/a.wbt"}})")
                        .was_told("loading: Error: "));
     }},
    {"the address is wrong",
     [](Fixture& f) {
         BOOST_TEST(f.say("a", R"({"start":{"url":"https://github.com/o/r"}})").was_told("loading: Error: "));
     }},
    {"the world does not exist",
     [](Fixture& f) {
         BOOST_TEST(f.say("a", R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/b.wbt"}})")
                        .was_told("loading: Error: b.wbt does not exist."));
     }},
    {"the browser leaves during the fetch",
     [](Fixture& f) {
         f.source.delay = 5s;
         f.leave(f.start("a"));
         f.source.delay = {};
     }},
    {"the browser is lost during a fetch that can't be stopped",
     [](Fixture& f) {
         f.source.delay = 5s;
         f.source.finishes = true;
         f.lose(f.start("a"));
         f.world.advance(5s);
         f.source.delay = {};
     }},
    {"the simulator can't be started",
     [](Fixture& f) {
         BOOST_TEST(f.start("a").was_told(error_line(core::Refused::not_started, {{"why", ""}})));
     }},
    {"the browser leaves while the world is loaded",
     [](Fixture& f) {
         f.processes.expect().stubborn();
         f.leave(f.start("a"));
         f.world.advance(2s);
     }},
    {"the simulator crashes before it is ready",
     [](Fixture& f) {
         f.processes.expect().prints("x\n").exits(1);
         BOOST_TEST(f.start("a").close_code.has_value());
     }},
    {"the simulator never gets ready",
     [](Fixture& f) {
         f.processes.expect().prints("x\n");
         f.start("a");
         f.world.advance(302s);
     }},
    {"the simulator crashes",
     [](Fixture& f) {
         f.processes.expect().prints(".\n").after(1s).crashes(SIGSEGV);
         f.start("a");
         f.world.advance(1s);
     }},
    {"its time is over",
     [](Fixture& f) {
         f.run_one("a");
         f.world.advance(602s);
     }},
    {"the browser leaves", [](Fixture& f) { f.leave(f.run_one("a")); }},
    {"the browser is lost and does not return",
     [](Fixture& f) {
         f.lose(f.run_one("a"));
         f.world.advance(31s);
     }},
    {"the simulator ends while nobody watches",
     [](Fixture& f) {
         f.processes.expect().prints(".\n").after(5s).exits(0);
         f.lose(f.start("a"));
         f.world.advance(5s);
     }},
    {"the browser returns from elsewhere and leaves",
     [](Fixture& f) {
         f.lose(f.run_one("a"));
         f.leave(f.say("b", R"({"reconnect":"token1"})"));
     }},
    {"another conversation takes it over, twice, and is lost",
     [](Fixture& f) {
         f.run_one("a");
         f.say("a", R"({"reconnect":"token1"})");
         f.lose(f.say("a", R"({"reconnect":"token1"})"));
         f.world.advance(31s);
     }},
    {"the server is drained",
     [](Fixture& f) {
         auto& browser = f.run_one("a");
         f.service.drain(false);
         BOOST_TEST(f.start("a").was_told("loading: Error: This simulation server is about to stop."));
         f.leave(browser);
         IncomingRequest request;
         request.method = "POST";
         request.path = "/api/drain";
         request.query = "off";
         request.is_operator = true;
         (void)f.service.respond(request);
     }},
    {"the server stops while a lost browser is waited for",
     [](Fixture& f) {
         f.lose(f.run_one("a"));
         f.tasks.cancel_all();
         f.world.settle();
     }},
    {"the server stops during the fetch",
     [](Fixture& f) {
         f.source.delay = 5s;
         auto& browser = f.start("a");
         f.tasks.cancel_all();
         f.world.settle();
         BOOST_TEST(browser.was_told("loading: Error: This simulation server is being stopped."));
         f.leave(browser);
         f.source.delay = {};
     }},
};

} // namespace

BOOST_AUTO_TEST_CASE(a_client_over_its_limit_is_told_what_to_raise_and_others_have_room)
{
    Fixture fixture(2);
    fixture.source.delay = 5s;
    auto& fetching = fixture.start("203.0.113.7");
    fixture.source.delay = {};
    auto& running = fixture.run_one("203.0.113.7");
    auto& refused = fixture.start("203.0.113.7");
    BOOST_TEST(
        refused.sent ==
            (Texts{"loading: Error: Your network has 2 simulations on this server already, and may not "
                   "have more. Please end one of them, or try again later. Its operator can raise "
                   "\"simulationsPerAddress\"."}),
        boost::test_tools::per_element());
    BOOST_TEST(refused.close_code.has_value());
    auto& other = fixture.run_one("203.0.113.8");
    fixture.leave(fetching);
    auto& next = fixture.run_one("203.0.113.7");
    for (auto* const browser : {&running, &other, &next})
        fixture.leave(*browser);
}

BOOST_AUTO_TEST_CASE(without_a_limit_and_without_a_client_nobody_is_refused)
{
    for (auto const& [most, client] : {std::pair<std::size_t, std::string>{0, "a"}, {1, ""}}) {
        Fixture fixture(most);
        std::vector<testing::LoopbackChannel*> running;
        for (int i = 0; i < 5; ++i)
            running.push_back(&fixture.run_one(client));
        for (auto* const browser : running)
            fixture.leave(*browser);
    }
}

BOOST_AUTO_TEST_CASE(however_a_start_ends_its_place_comes_back_once)
{
    for (auto const& [how, end] : ends) {
        BOOST_TEST_CONTEXT(how)
        {
            Fixture fixture(1);
            end(fixture);
            BOOST_TEST(fixture.service.sessions() == 0u);
            auto& next = fixture.run_one("a");
            BOOST_TEST(fixture.start("a").was_told(refusal), "the place came back twice");
            fixture.leave(next);
        }
    }
}

BOOST_AUTO_TEST_CASE(a_simulation_that_waits_for_its_browser_counts)
{
    Fixture fixture(1);
    fixture.lose(fixture.run_one("a"));
    fixture.world.advance(29s);
    BOOST_TEST(fixture.start("a").was_told(refusal));
    auto& back = fixture.say("b", R"({"reconnect":"token1"})");
    BOOST_TEST(back.was_told("webots:"));
    BOOST_TEST(fixture.start("a").was_told(refusal), "it is still whose it was");
    fixture.leave(fixture.run_one("b"));
    fixture.leave(back);
}

BOOST_AUTO_TEST_CASE(the_limit_can_be_raised_while_simulations_run)
{
    Fixture fixture(1);
    auto& first = fixture.run_one("a");
    BOOST_TEST(fixture.start("a").was_told(refusal));
    fixture.service.apply(quota_setup(2).config);
    auto& second = fixture.run_one("a");
    BOOST_TEST(fixture.start("a").was_told(refusal));
    fixture.service.apply(quota_setup(1).config);
    fixture.leave(first);
    BOOST_TEST(fixture.start("a").was_told(refusal), "the second runs on");
    fixture.leave(second);
    fixture.leave(fixture.run_one("a"));
}

BOOST_AUTO_TEST_CASE(a_world_has_a_limit_whoever_starts_it)
{
    auto setup = quota_setup(0);
    setup.config.simulations_per_world = 1;
    Fixture fixture(setup);
    auto& first = fixture.run_one("a");
    BOOST_TEST(fixture.start("b").was_told(
        "loading: Error: This world runs here as often as this server allows (1)."));
    for (auto const* link : {"https://github.com/o/r/blob/main/worlds/a.wbt?raw=1",
                             "https://github.com/o/r/tree/m%61in/worlds/a.wbt#L1",
                             "https://raw.githubusercontent.com/o/r/refs/heads/main/worlds/a.wbt"}) {
        auto const text = std::string(R"({"start":{"url":")") + link + "\"}}";
        BOOST_TEST(fixture.say("b", text).was_told(
                       "loading: Error: This world runs here as often as this server allows (1)."),
                   link);
    }
    fixture.leave(first);
    fixture.leave(fixture.run_one("b"));
}

BOOST_AUTO_TEST_CASE(the_log_names_the_key_once_for_each_client)
{
    Fixture fixture(1);
    auto& first = fixture.run_one("203.0.113.7");
    for (int i = 0; i < 20; ++i)
        fixture.start("203.0.113.7");
    BOOST_TEST(fixture.lines(
                   "More than 1 simulations of 203.0.113.7 are refused: see \"simulationsPerAddress\"") == 1);
    BOOST_TEST(fixture.log.contains("[1] New client (203.0.113.7)"));
    fixture.leave(first);
    auto& other = fixture.run_one("b");
    fixture.start("b");
    BOOST_TEST(fixture.lines(" are refused: see ") == 2);
    fixture.leave(other);
}

BOOST_AUTO_TEST_CASE(sockets_that_start_nothing_make_room_for_those_that_come)
{
    Fixture fixture(silence_setup(3, 3));
    auto& first = fixture.connect("a");
    auto& second = fixture.connect("b");
    auto& third = fixture.connect("c");
    BOOST_TEST(!first.close_code.has_value());
    auto& running = fixture.run_one("d");
    BOOST_TEST(
        first.sent ==
            (Texts{"loading: Error: Too many connections wait here for their start: please start again."}),
        boost::test_tools::per_element());
    BOOST_TEST(first.close_code.has_value());
    BOOST_TEST(fixture.log.contains(
        "More than 3 connections, or 3 of one address, start nothing: the oldest, [1], is closed"));
    auto& fourth = fixture.connect("e"); // a running simulation does not count as silent
    BOOST_TEST(!second.close_code.has_value());
    third.browser_says(start_message); // a late start is accepted too
    fixture.processes.expect().prints(".\n");
    fixture.world.settle();
    BOOST_TEST(third.was_told("webots:"));
    for (auto* const browser : {&second, &third, &fourth, &running})
        fixture.leave(*browser);
}

BOOST_AUTO_TEST_CASE(a_client_with_too_many_idle_sockets_takes_no_room_from_others)
{
    Fixture fixture(silence_setup(10, 2));
    auto& other = fixture.connect("other");
    auto& first = fixture.connect("greedy");
    std::vector<testing::LoopbackChannel*> idle;
    for (int i = 0; i < 20; ++i)
        idle.push_back(&fixture.connect("greedy"));
    BOOST_TEST(first.close_code.has_value());
    BOOST_TEST(!other.close_code.has_value());
    BOOST_TEST(std::count_if(idle.begin(), idle.end(),
                             [](auto const* b) { return !b->close_code.has_value(); }) == 2);
    fixture.world.advance(31s); // these are closed at their deadline
    BOOST_TEST(fixture.browsings.size() == 0u);
}

BOOST_AUTO_TEST_SUITE_END()
