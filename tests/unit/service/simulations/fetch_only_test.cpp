// Starts that only fetch: `fetch_only`.
#include "simulation_fixture.hpp"

#include <webots_cloud/load_report.hpp>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol sections 4.1.1 to 4.1.4.
BOOST_AUTO_TEST_SUITE(fetch_only)

namespace {

std::string fetch_of(std::string const& world, std::string const& more = {})
{
    return R"({"start":{"url":"https://github.com/)" + world + R"(","mode":"mjpeg","fetch_only":true)" +
           more + "}}";
}

std::string const arena = "o/r/blob/main/worlds/a.wbt";

struct Fixture : SimulationFixture
{
    explicit Fixture(int max_simulations = 2)
        : SimulationFixture(simulation_service_setup(30s), max_simulations)
    {}

    testing::LoopbackChannel& fetch(std::string const& client = {},
                                    std::string const& message = fetch_of(arena))
    {
        return say(client, message);
    }

    LoadReport report()
    {
        std::pair<std::string_view, std::string_view> const accept[] = {{"Accept", "application/json"}};
        IncomingRequest load;
        load.method = "GET";
        load.path = "/load";
        load.headers = accept;
        return parse_load_report(std::get<HttpResponse>(service.respond(load)).body).value();
    }

    bool shows(std::string const& line)
    {
        return ("\n" + get("/metrics").text()).find("\n" + line + "\n") != std::string::npos;
    }
};

using Texts = std::vector<std::string>;

} // namespace

BOOST_AUTO_TEST_CASE(the_project_is_fetched_and_no_simulator_is_started)
{
    Fixture fixture;
    fixture.source.notice = "From the cache.";
    fixture.source.forbidden = {"textures/.GIT"};
    auto& page = fixture.fetch();
    BOOST_TEST(page.sent == (Texts{"loading: From the cache.",
                                   "stderr:\"textures/.GIT\" of the project is left out: its name could do "
                                   "harm here. Rename it.",
                                   "fetched:"}),
               boost::test_tools::per_element());
    BOOST_TEST(page.close_code.value() == 1000);
    BOOST_TEST(fixture.processes.started().empty());
    BOOST_TEST(fixture.source.directories().empty());
    BOOST_TEST(fixture.service.sessions() == 0u);
    BOOST_TEST(fixture.log.contains("[1] Fetching for later starts https://github.com/" + arena));
    BOOST_TEST(!fixture.log.contains("Starting simulation"));
    BOOST_TEST(fixture.log.contains("[1] Client disconnected"));
}

BOOST_AUTO_TEST_CASE(progress_is_told_as_of_a_start)
{
    Fixture fixture;
    fixture.source.delay = 2s;
    auto& page = fixture.fetch({}, fetch_of(arena, R"(,"heartbeat":true)"));
    fixture.world.advance(2s);
    BOOST_TEST(page.sent.front() == "heartbeat: 1");
    BOOST_TEST(page.was_told("loading: Receiving objects"));
    BOOST_TEST(page.sent.back() == "fetched:");
}

BOOST_AUTO_TEST_CASE(it_is_refused_where_a_start_would_be)
{
    Fixture fixture;
    for (auto const& [message, refusal] :
         {std::pair(fetch_of("x/r/blob/main/worlds/a.wbt"), "loading: Error: Docker not enabled"),
          std::pair(fetch_of("o/r"), "loading: Error: Wrong Webots simulation URL"),
          std::pair(fetch_of("o/r/blob/main/worlds/b.wbt"), "loading: Error: b.wbt does not exist.")}) {
        auto& page = fixture.fetch({}, message);
        BOOST_TEST(page.was_told(refusal), message);
        BOOST_TEST(!page.was_told("fetched:"), message);
        BOOST_TEST(page.close_code.value() == 0, message);
    }
    fixture.service.drain(false);
    BOOST_TEST(fixture.fetch().was_told("loading: Error: This simulation server is about to stop."));
    BOOST_TEST(fixture.processes.started().empty());
}

// Else a class that opens could take the machines from those who use them.
BOOST_AUTO_TEST_CASE(it_holds_a_place_while_it_fetches)
{
    Fixture fixture(1);
    fixture.source.delay = 5s;
    auto& first = fixture.fetch();
    BOOST_TEST(fixture.fetch().was_told("loading: Error: Too many open connections (>1)"));
    BOOST_TEST(fixture.report().capacity.value() == 0);
    fixture.world.advance(5s);
    BOOST_TEST(first.was_told("fetched:"));
    BOOST_TEST(fixture.report().capacity.value() == 1);
    auto& second = fixture.fetch();
    fixture.world.advance(5s);
    BOOST_TEST(second.was_told("fetched:"));
}

BOOST_AUTO_TEST_CASE(a_page_that_leaves_ends_the_fetch_and_nothing_is_left_of_it)
{
    for (bool const is_lost : {false, true}) {
        Fixture fixture(1);
        fixture.source.delay = 5s;
        auto& page = fixture.fetch({}, fetch_of(arena, R"(,"reconnect":true)"));
        is_lost ? fixture.lose(page) : fixture.leave(page);
        BOOST_TEST(fixture.source.fetching == 0);
        BOOST_TEST(fixture.service.sessions() == 0u);
        BOOST_TEST(fixture.shows("webots_prefetches_total{result=\"abandoned\",reason=\"\"} 1"));
        auto& next = fixture.fetch();
        fixture.world.advance(5s);
        BOOST_TEST(next.was_told("fetched:"));
    }
}

BOOST_AUTO_TEST_CASE(a_server_that_stops_says_so)
{
    Fixture fixture;
    fixture.source.delay = 5s;
    auto& page = fixture.fetch();
    fixture.tasks.cancel_all();
    fixture.world.settle();
    BOOST_TEST(page.was_told("loading: Error: This simulation server is being stopped."));
    fixture.leave(page);
}

// Session servers count who came: a fetch is nobody whom they sent.
BOOST_AUTO_TEST_CASE(it_is_counted_apart_from_starts)
{
    Fixture fixture(3);
    fixture.fetch();
    fixture.fetch({}, fetch_of("o/r/blob/main/worlds/b.wbt"));
    fixture.processes.expect().prints(".\n");
    auto& running = fixture.say({}, R"({"start":{"url":"https://github.com/)" + arena + R"("}})");
    BOOST_TEST(running.was_told("webots:"));
    fixture.source.delay = 5s;
    auto& fetching = fixture.fetch();
    auto const report = fixture.report();
    BOOST_TEST(report.sessions.value() == 1);
    BOOST_TEST(report.starting.value() == 0);
    BOOST_TEST(report.capacity.value() == 2);
    BOOST_TEST(report.arrivals.value() == 1);
    BOOST_TEST(report.failed.value() == 0);
    BOOST_TEST(report.departures.value() == 0);
    for (auto const* line :
         {"webots_simulations{state=\"starting\"} 0", "webots_simulations{state=\"idle\"} 1",
          "webots_starts_total{result=\"ready\",reason=\"\"} 1",
          "webots_starts_total{result=\"abandoned\",reason=\"\"} 0",
          "webots_start_stage_seconds_count{stage=\"fetch\"} 1",
          "webots_prefetches_total{result=\"fetched\",reason=\"\"} 1",
          "webots_prefetches_total{result=\"failed\",reason=\"not_found\"} 1",
          "webots_prefetches_total{result=\"abandoned\",reason=\"\"} 0"})
        BOOST_TEST(fixture.shows(line), line);
    BOOST_TEST(fixture.get("/monitor").text().find("\"state\":\"fetching for later\"") != std::string::npos);
    fixture.leave(running);
    fixture.leave(fetching);
}

BOOST_AUTO_TEST_SUITE_END()
