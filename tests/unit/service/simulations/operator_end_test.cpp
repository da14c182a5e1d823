// The operator ends a simulation: `POST /api/end`.
#include "simulation_fixture.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol section 13.4.
BOOST_AUTO_TEST_SUITE(operator_end)

namespace {

constexpr auto start_message =
    R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","reconnect":true}})";
constexpr auto sentence = "loading: Error: The operator has ended this simulation.";

struct Fixture : SimulationFixture
{
    explicit Fixture(int max_simulations = 2)
        : SimulationFixture(simulation_service_setup(30s), max_simulations)
    {}

    HttpResponse end(std::string_view query, bool is_operator = true, std::string_view method = "POST")
    {
        IncomingRequest request;
        request.method = method;
        request.path = "/api/end";
        request.query = query;
        request.is_operator = is_operator;
        auto answer = std::get<HttpResponse>(service.respond(request));
        world.settle();
        return answer;
    }

    testing::LoopbackChannel& start() { return say({}, start_message); }

    testing::LoopbackChannel& run_one()
    {
        processes.expect().prints(".\n");
        auto& browser = start();
        BOOST_TEST(browser.was_told("webots:"));
        return browser;
    }

    bool shows(std::string const& line)
    {
        return ("\n" + get("/metrics").text()).find("\n" + line + "\n") != std::string::npos;
    }
};

} // namespace

BOOST_AUTO_TEST_CASE(a_simulation_that_runs_is_ended_and_its_browser_told_who_did)
{
    Fixture fixture;
    auto& other = fixture.run_one();
    auto& browser = fixture.run_one();
    auto const answer = fixture.end("simulation=2");
    BOOST_TEST(answer.status == 200);
    BOOST_TEST(answer.text() == "ending");
    BOOST_TEST(browser.sent.back() == sentence);
    BOOST_TEST(browser.close_code.value() == 0);
    fixture.world.advance(2s);
    BOOST_TEST(fixture.service.sessions() == 1u);
    BOOST_TEST(fixture.log.contains("[2] The operator ends this simulation"));
    BOOST_TEST(!other.close_code.has_value());
    fixture.leave(browser); // nobody waits for it
    BOOST_TEST(fixture.say({}, R"({"reconnect":"token2"})")
                   .was_told("loading: Error: This simulation has ended. Please start it again."));
    BOOST_TEST(fixture.shows("webots_starts_total{result=\"ready\",reason=\"\"} 2"));
    fixture.leave(other);
}

BOOST_AUTO_TEST_CASE(one_that_is_being_fetched_is_ended_and_its_place_free)
{
    Fixture fixture(1);
    fixture.source.delay = 5s;
    auto& browser = fixture.start();
    BOOST_TEST(fixture.end("simulation=1").status == 200);
    BOOST_TEST(browser.sent.back() == sentence);
    BOOST_TEST(fixture.source.fetching == 0);
    BOOST_TEST(fixture.shows("webots_starts_total{result=\"failed\",reason=\"refused\"} 1"));
    BOOST_TEST(fixture.shows("webots_starts_total{result=\"abandoned\",reason=\"\"} 0"));
    fixture.source.delay = {};
    fixture.leave(fixture.run_one());
}

BOOST_AUTO_TEST_CASE(one_whose_world_is_being_loaded_is_ended)
{
    Fixture fixture;
    fixture.processes.expect().prints("loading\n");
    auto& browser = fixture.start();
    BOOST_TEST(fixture.end("simulation=1").status == 200);
    BOOST_TEST(browser.sent.back() == sentence);
    fixture.world.advance(2s);
    BOOST_TEST(fixture.service.sessions() == 0u);
}

BOOST_AUTO_TEST_CASE(one_that_waits_for_its_browser_is_ended_at_once)
{
    Fixture fixture;
    fixture.lose(fixture.run_one());
    BOOST_TEST(fixture.service.sessions() == 1u);
    BOOST_TEST(fixture.end("simulation=1").status == 200);
    fixture.world.advance(2s);
    BOOST_TEST(fixture.service.sessions() == 0u);
    BOOST_TEST(!fixture.log.contains("has not returned"));
}

BOOST_AUTO_TEST_CASE(whoever_has_taken_it_over_is_told)
{
    Fixture fixture;
    fixture.lose(fixture.run_one());
    auto& second = fixture.say({}, R"({"reconnect":"token1"})");
    BOOST_TEST(fixture.end("simulation=1").status == 200);
    BOOST_TEST(second.sent.back() == sentence);
}

BOOST_AUTO_TEST_CASE(a_fetch_for_later_is_ended_as_a_simulation_is)
{
    Fixture fixture;
    fixture.source.delay = 5s;
    auto& page = fixture.say(
        {}, R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","fetch_only":true}})");
    BOOST_TEST(fixture.end("simulation=1").status == 200);
    BOOST_TEST(page.sent.back() == sentence);
    BOOST_TEST(fixture.shows("webots_prefetches_total{result=\"failed\",reason=\"refused\"} 1"));
}

BOOST_AUTO_TEST_CASE(a_simulation_ends_once)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").stubborn();
    auto& browser = fixture.start();
    BOOST_TEST(fixture.end("simulation=1").status == 200);
    auto const again = fixture.end("simulation=1");
    BOOST_TEST(again.status == 410);
    BOOST_TEST(again.text() == "There is no simulation 1 any more.");
    fixture.world.advance(10s);
    BOOST_TEST(fixture.end("simulation=1").status == 410);
    BOOST_TEST(std::count(browser.sent.begin(), browser.sent.end(), sentence) == 1);
}

BOOST_AUTO_TEST_CASE(only_the_operator_ends_simulations_and_only_by_a_request_that_is_meant)
{
    Fixture fixture;
    auto& browser = fixture.run_one();
    BOOST_TEST(fixture.end("simulation=1", false).status == 404);
    BOOST_TEST(fixture.end("simulation=1", false, "GET").status == 404);
    BOOST_TEST(fixture.end("simulation=1", true, "GET").status == 405);
    for (auto const* query :
         {"", "simulation", "simulation=", "simulation=x", "simulation=1x", "simulation=-1", "simulation=+1",
          "simulation= 1", "simulation=99999999999999999999", "1", "simulation=1&simulation=2"}) {
        auto const answer = fixture.end(query);
        BOOST_TEST(answer.status == 400, query);
        BOOST_TEST(answer.text() == "Expected the number of a simulation, as in /api/end?simulation=3.");
    }
    BOOST_TEST(fixture.end("simulation=2").status == 410);
    BOOST_TEST(!browser.close_code.has_value());
    fixture.leave(browser);
}

BOOST_AUTO_TEST_SUITE_END()
