#include "service/run.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"

#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/scripted_http.hpp>
#include <webots_cloud/testing/world.hpp>

#include <limits>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol section 3, in virtual time.
BOOST_AUTO_TEST_SUITE(load_monitor)

namespace {

/// A monitor that runs; at its end it is cancelled, and no task or timer may be left.
struct Fixture
{
    explicit Fixture(std::vector<std::string> const& servers, LoadMonitorParams params = LoadMonitorParams())
        : http(world.clock), monitor(LoadMonitor::make(params, http, world.clock).value()),
          tasks(world.executor())
    {
        monitor.set_servers(servers);
    }

    ~Fixture()
    {
        world.run(tasks.end());
        BOOST_TEST(world.clock.pending() == 0u);
    }

    void start()
    {
        tasks.spawn(run(monitor));
        world.settle();
    }

    std::vector<LoadEvent> events() { return world.run(monitor.next_events()).value(); }

    std::size_t polls_of(std::string const& url) const
    {
        std::size_t count = 0;
        for (auto const& request : http.requests())
            count += request.url == url ? 1 : 0;
        return count;
    }

    testing::World world;
    testing::ScriptedHttp http;
    LoadMonitor monitor;
    async::TaskGroup tasks;
};

} // namespace

BOOST_AUTO_TEST_CASE(every_server_is_polled_at_once_and_then_every_interval)
{
    Fixture fixture({"a:2000", "b:2000"});
    fixture.http.expect("GET http://a:2000/load").reply(200, "1.5").always();
    fixture.http.expect("GET http://b:2000/load").reply(200, "2.5").always();
    fixture.start();
    BOOST_TEST(fixture.http.requests().size() == 2u);
    BOOST_TEST(fixture.events().size() == 2u);
    fixture.world.advance(5s);
    BOOST_TEST(fixture.polls_of("http://a:2000/load") == 2u);
    fixture.world.advance(50s);
    BOOST_TEST(fixture.polls_of("http://a:2000/load") == 12u);
    BOOST_TEST(fixture.polls_of("http://b:2000/load") == 12u);
    BOOST_TEST(fixture.monitor.servers().back().report.load == 2.5);
}

BOOST_AUTO_TEST_CASE(polls_of_many_servers_are_spread_over_the_interval)
{
    std::vector<std::string> servers;
    for (int i = 0; i < 100; ++i)
        servers.push_back("s" + std::to_string(i) + ":2000");
    Fixture fixture(servers);
    for (auto const& server : servers)
        fixture.http.expect("GET http://" + server + "/load").reply(200, "1").always();
    fixture.start();
    for (int tenth = 0; tenth < 50; ++tenth) {
        auto const before = fixture.http.requests().size();
        fixture.world.advance(100ms);
        BOOST_TEST(fixture.http.requests().size() - before <= 4u); // 2 on average
    }
}

BOOST_AUTO_TEST_CASE(one_black_hole_delays_nobody)
{
    Fixture fixture({"hole:2000", "good:2000"});
    fixture.http.expect("GET http://hole:2000/load").hang().always();
    fixture.http.expect("GET http://good:2000/load").reply(200, "1").always();
    fixture.start();
    BOOST_TEST(fixture.events().front().server.address == "good:2000");
    fixture.world.advance(20s);
    BOOST_TEST(fixture.polls_of("http://good:2000/load") == 5u);
    auto const hole = fixture.monitor.servers().front();
    BOOST_TEST((hole.state == ServerState::down));
}

BOOST_AUTO_TEST_CASE(unknown_is_not_idle)
{
    Fixture fixture({"hole:2000"});
    fixture.http.expect("GET http://hole:2000/load").hang().always();
    fixture.start();
    BOOST_TEST((fixture.monitor.servers().front().state == ServerState::unknown));
    fixture.world.advance(5s);
    auto const events = fixture.events();
    BOOST_TEST_REQUIRE(events.size() == 1u);
    BOOST_TEST((events[0].transition == LoadTransition::too_slow));
}

BOOST_AUTO_TEST_CASE(anything_but_a_good_answer_is_a_failed_poll)
{
    Fixture fixture({"a:2000"});
    fixture.http.expect("GET http://a:2000/load").reply(200, "3");
    fixture.http.expect("GET http://a:2000/load").reply(503, "1");
    fixture.http.expect("GET http://a:2000/load").reply(200, "4");
    fixture.http.expect("GET http://a:2000/load").reply(302, "1");
    fixture.http.expect("GET http://a:2000/load").reply(200, "5");
    fixture.http.expect("GET http://a:2000/load").reply(200, "nonsense");
    fixture.http.expect("GET http://a:2000/load").reply(200, "97");
    fixture.http.expect("GET http://a:2000/load").fail(errc::unreachable);
    fixture.http.expect("GET http://a:2000/load").hang().always();
    fixture.start();
    using enum LoadTransition;
    std::vector<LoadTransition> seen;
    while (seen.size() < 9)
        for (auto const& event : fixture.events())
            seen.push_back(event.transition);
    std::vector<LoadTransition> const expected{none,           not_responding, working_again,
                                               not_responding, working_again,  not_responding,
                                               working_again,  not_responding, none};
    BOOST_TEST((seen == expected));
    BOOST_TEST(fixture.monitor.servers().front().report.load == 97);
}

BOOST_AUTO_TEST_CASE(servers_come_and_go_while_it_runs)
{
    Fixture fixture({"a:2000", "b:2000"});
    for (auto const* name : {"a", "b", "c"})
        fixture.http.expect(std::string("GET http://") + name + ":2000/load").reply(200, "1").always();
    fixture.start();
    fixture.world.advance(10s);
    fixture.monitor.set_servers({"c:2000", "a:2000"});
    fixture.world.settle();
    auto const polls_of_b = fixture.polls_of("http://b:2000/load");
    auto const polls_of_a = fixture.polls_of("http://a:2000/load");
    BOOST_TEST(fixture.polls_of("http://c:2000/load") == 1u);
    fixture.world.advance(10s);
    BOOST_TEST(fixture.polls_of("http://b:2000/load") == polls_of_b);
    BOOST_TEST(fixture.polls_of("http://a:2000/load") == polls_of_a + 2);
    BOOST_TEST(fixture.monitor.servers().front().address == "c:2000");
}

BOOST_AUTO_TEST_CASE(it_polls_the_machines_of_the_fleet_that_it_follows)
{
    Fixture fixture({});
    for (auto const* name : {"a", "b"})
        fixture.http.expect(std::string("GET http://") + name + ":2000/load").reply(200, "1").always();
    Fleet fleet;
    fleet.put(ServerSpec("b:2000"));
    fixture.monitor.follow(fleet);
    fixture.start();
    fleet.put(ServerSpec("a:2000"), "b:2000");
    fixture.world.settle();
    BOOST_TEST(fixture.polls_of("http://a:2000/load") == 1u);
    BOOST_TEST(fixture.polls_of("http://b:2000/load") == 1u);
    BOOST_TEST(fixture.monitor.servers().front().address == "a:2000");
    fleet.drain("a:2000", true);
    BOOST_TEST((fixture.monitor.find("a:2000")->state == ServerState::up), "what is known of it stays");
    fleet.remove("b:2000");
    fixture.world.advance(10s);
    BOOST_TEST(fixture.polls_of("http://b:2000/load") == 1u);
    BOOST_TEST(fixture.polls_of("http://a:2000/load") > 1u);
}

BOOST_AUTO_TEST_CASE(single_servers_come_and_go_while_it_runs)
{
    Fixture fixture({});
    Fleet fleet;
    fixture.monitor.follow(fleet);
    fleet.set({ServerSpec("a:2000"), ServerSpec("c:2000")});
    for (auto const* name : {"a", "b", "c"})
        fixture.http.expect(std::string("GET http://") + name + ":2000/load").reply(200, "1").always();
    fixture.start();
    fleet.put(ServerSpec("b:2000"), "c:2000");
    fixture.world.settle();
    BOOST_TEST(fixture.polls_of("http://b:2000/load") == 1u);
    std::string order;
    for (auto const& server : fixture.monitor.servers())
        order += server.address + " ";
    BOOST_TEST(order == "a:2000 b:2000 c:2000 ");
    auto const* const known = fixture.monitor.find("c:2000");
    fleet.put(ServerSpec("c:2000"), "a:2000");
    fixture.world.settle();
    BOOST_TEST(fixture.polls_of("http://c:2000/load") == 1u, "it is polled in its turn");
    BOOST_TEST(&fixture.monitor.servers().front() == known);
    BOOST_TEST((known->state == ServerState::up));
    fleet.remove("a:2000");
    fleet.remove("a:2000");
    BOOST_TEST(!fixture.monitor.find("a:2000"));
    fixture.world.advance(10s);
    BOOST_TEST(fixture.polls_of("http://a:2000/load") == 1u);
    BOOST_TEST(fixture.polls_of("http://b:2000/load") == 3u);
}

BOOST_AUTO_TEST_CASE(a_poll_asks_for_the_json_of_our_own_servers_and_takes_the_bare_number_of_others)
{
    LoadMonitorParams params;
    params.tls = true;
    Fixture fixture({"a/2000"}, params);
    fixture.http.expect("GET https://a/2000/load").reply(200, R"({"load":7,"sessions":2})").always();
    fixture.start();
    auto const& headers = fixture.http.requests().front().headers;
    BOOST_TEST((headers.front() ==
                std::pair<std::string, std::string>("Accept", "application/json, text/plain;q=0.5")));
    BOOST_TEST(fixture.monitor.servers().front().report.sessions.value() == 2);
}

BOOST_AUTO_TEST_CASE(a_machine_behind_the_gateway_is_polled_inside)
{
    LoadMonitorParams params;
    params.tls = true;
    Fixture fixture({}, params);
    Fleet fleet;
    fixture.monitor.follow(fleet);
    fixture.http.expect("GET http://10.0.0.2:2000/load").reply(200, "7").always();
    fixture.http.expect("GET http://10.0.0.3:2000/load").reply(200, "8").always();
    ServerSpec server("sim.example.org/2000");
    server.internal_address = "10.0.0.2:2000";
    fleet.put(server);
    fixture.start();
    BOOST_TEST(fixture.monitor.servers().front().address == "sim.example.org/2000");
    BOOST_TEST(fixture.monitor.servers().front().report.load == 7);
    server.internal_address = "10.0.0.3:2000"; // it moves
    fleet.put(server);
    fixture.world.advance(10s);
    BOOST_TEST(fixture.monitor.servers().front().report.load == 8);
    fixture.http.expect("GET https://sim2.example.org:2000/load").reply(200, "9").always();
    server.internal_address = "wss://sim2.example.org:2000";
    fleet.put(server);
    fixture.world.advance(10s);
    BOOST_TEST(fixture.monitor.servers().front().report.load == 9);
}

BOOST_AUTO_TEST_CASE(a_certificate_may_be_for_a_name_that_several_machines_share)
{
    Fixture fixture({});
    Fleet fleet;
    fixture.monitor.follow(fleet);
    fixture.http.expect("GET https://sim.test:2000/load").reply(200, "7").always();
    ServerSpec server("10.0.0.2:2000");
    server.internal_address = "https://10.0.0.2:2000";
    server.internal_name = "sim.test";
    fleet.put(server);
    fixture.start();
    BOOST_TEST(fixture.monitor.servers().front().report.load == 7);
    BOOST_TEST(fixture.http.requests().back().address == "10.0.0.2");
}

// A name server could point us at other services.
BOOST_AUTO_TEST_CASE(what_answers_without_our_counters_may_be_taken_for_another_service)
{
    Fixture fixture({});
    Fleet fleet;
    fixture.monitor.follow(fleet);
    fixture.http.expect("GET http://10.0.0.2:2000/load").reply(200, "7");
    fixture.http.expect("GET http://10.0.0.2:2000/load")
        .reply(200,
               R"({"load":8,"sessions":0,"starting":0,"capacity":9,"arrivals":0,"failed":0,"departures":0})")
        .always();
    ServerSpec server("10.0.0.2:2000");
    server.internal_address = "10.0.0.2:2000";
    server.has_own_path = true;
    fleet.put(server);
    fixture.start();
    BOOST_TEST(fixture.monitor.servers().front().problem == "it is not a simulation server of webots_cloud");
    fixture.world.advance(6s);
    BOOST_TEST(fixture.monitor.servers().front().report.load == 8);
}

BOOST_AUTO_TEST_CASE(the_totals_follow_every_poll_and_every_change_of_the_list)
{
    Fixture fixture({"a:2000", "b:2000", "c:2000"});
    fixture.http.expect("GET http://a:2000/load").reply(200, "1.5").always();
    fixture.http.expect("GET http://b:2000/load").fail(errc::unreachable).always();
    fixture.http.expect("GET http://c:2000/load").hang().always();
    LoadTotals expected;
    expected.unknown = 3;
    BOOST_TEST((fixture.monitor.totals() == expected));
    fixture.start();
    expected.unknown = expected.up = expected.down = 1;
    expected.load = 1.5;
    BOOST_TEST((fixture.monitor.totals() == expected));
    fixture.monitor.set_servers({"a:2000"});
    expected.unknown = expected.down = 0;
    BOOST_TEST((fixture.monitor.totals() == expected));
}

BOOST_AUTO_TEST_CASE(new_parameters_hold_from_each_servers_next_poll_on)
{
    Fixture fixture({"a:2000"});
    fixture.http.expect("GET http://a:2000/load").reply(200, "50").always();
    fixture.http.expect("GET https://a:2000/load").reply(200, "50").always();
    fixture.start();
    fixture.world.advance(10s);
    LoadMonitorParams next;
    next.interval = 1s;
    next.threshold = 40;
    next.timeout = 2s;
    next.tls = true;
    BOOST_TEST(fixture.monitor.apply(next).has_value());
    fixture.events();
    fixture.world.advance(20s);
    BOOST_TEST(fixture.polls_of("https://a:2000/load") >= 15u);
    BOOST_TEST((fixture.http.requests().back().timeout == 2s));
    BOOST_TEST((fixture.events().back().transition == LoadTransition::none)); // was above already
    next.interval = Duration::zero();
    BOOST_TEST((fixture.monitor.apply(next).error() == errc::invalid_argument));
}

BOOST_AUTO_TEST_CASE(one_more_poll_comes_at_once_and_moves_no_other)
{
    Fixture fixture({"a:2000", "b:2000"});
    Fixture other({"a:2000", "b:2000"});
    for (Fixture* const each : {&fixture, &other}) {
        each->http.expect("GET http://a:2000/load").reply(200, "1");
        each->http.expect("GET http://a:2000/load").reply(200, "2").always();
        each->http.expect("GET http://b:2000/load").reply(200, "1").always();
        each->start();
        each->events();
        each->world.advance(1s);
    }
    fixture.monitor.poll_now("a:2000");
    fixture.world.settle();
    BOOST_TEST(fixture.events().front().server.report.load == 2);
    for (int tenth = 0; tenth != 200; ++tenth) {
        BOOST_TEST(fixture.polls_of("http://a:2000/load") == other.polls_of("http://a:2000/load") + 1);
        BOOST_TEST(fixture.polls_of("http://b:2000/load") == other.polls_of("http://b:2000/load"));
        fixture.world.advance(100ms);
        other.world.advance(100ms);
    }
    BOOST_TEST(other.polls_of("http://a:2000/load") >= 5u);
}

BOOST_AUTO_TEST_CASE(no_second_poll_begins_while_one_is_in_flight)
{
    Fixture fixture({"a:2000"});
    fixture.http.expect("GET http://a:2000/load").after(2s).reply(200, "1");
    fixture.http.expect("GET http://a:2000/load").after(4500ms).reply(200, "2");
    fixture.http.expect("GET http://a:2000/load").after(1s).reply(200, "3").always();
    fixture.start();
    fixture.monitor.poll_now("a:2000");
    fixture.world.settle();
    BOOST_TEST(fixture.polls_of("http://a:2000/load") == 1u);
    fixture.world.advance(3s);
    fixture.monitor.poll_now("a:2000"); // answers after 7.5 s
    fixture.monitor.poll_now("a:2000");
    fixture.world.settle();
    BOOST_TEST(fixture.polls_of("http://a:2000/load") == 2u);
    fixture.world.advance(3500ms); // that of 5 s has come back, the other one has not
    fixture.monitor.poll_now("a:2000");
    fixture.world.settle();
    BOOST_TEST(fixture.polls_of("http://a:2000/load") == 3u);
    fixture.world.advance(1s);
    BOOST_TEST(fixture.monitor.servers().front().report.load == 2);
}

BOOST_AUTO_TEST_CASE(a_poll_of_a_server_that_is_not_listed_or_not_watched_yet_does_nothing)
{
    Fixture fixture({"a:2000"});
    fixture.http.expect("GET http://a:2000/load").reply(200, "1").always();
    fixture.monitor.poll_now("a:2000");
    fixture.world.settle();
    BOOST_TEST(fixture.http.requests().empty());
    fixture.start();
    fixture.monitor.poll_now("b:2000");
    fixture.world.settle();
    BOOST_TEST(fixture.http.requests().size() == 1u);
}

BOOST_AUTO_TEST_CASE(the_answer_of_a_server_that_has_left_the_list_is_dropped)
{
    Fixture fixture({"a:2000"});
    fixture.http.expect("GET http://a:2000/load").reply(200, "1");
    fixture.http.expect("GET http://a:2000/load").after(2s).reply(200, "2");
    fixture.start();
    fixture.events();
    fixture.world.advance(1s);
    fixture.monitor.poll_now("a:2000");
    fixture.world.settle();
    fixture.monitor.set_servers({});
    fixture.world.advance(5s);
    BOOST_TEST(fixture.monitor.servers().empty());
    BOOST_TEST(fixture.polls_of("http://a:2000/load") == 2u);
}

BOOST_AUTO_TEST_CASE(it_is_not_made_with_unusable_parameters)
{
    testing::World world;
    testing::ScriptedHttp http(world.clock);
    LoadMonitorParams params;
    params.interval = Duration::zero();
    BOOST_TEST((LoadMonitor::make(params, http, world.clock).error() == errc::invalid_argument));
    params = LoadMonitorParams();
    params.timeout = -1s;
    BOOST_TEST((LoadMonitor::make(params, http, world.clock).error() == errc::invalid_argument));
    params = LoadMonitorParams();
    for (auto const threshold : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        params.threshold = threshold;
        BOOST_TEST((LoadMonitor::make(params, http, world.clock).error() == errc::invalid_argument));
    }
    BOOST_TEST(http.requests().empty());
}

BOOST_AUTO_TEST_CASE(a_server_that_is_listed_twice_is_polled_once)
{
    Fixture fixture({"a:2000", "a:2000"});
    fixture.http.expect("GET http://a:2000/load").reply(200, "1").always();
    fixture.start();
    BOOST_TEST(fixture.polls_of("http://a:2000/load") == 1u);
    BOOST_TEST(fixture.monitor.servers().size() == 1u);
    fixture.monitor.set_servers({"b:2000", "a:2000", "b:2000"});
    fixture.http.expect("GET http://b:2000/load").reply(200, "2").always();
    fixture.world.settle();
    BOOST_TEST(fixture.polls_of("http://b:2000/load") == 1u);
    BOOST_TEST(fixture.monitor.servers().back().report.load == 1);
}

BOOST_AUTO_TEST_SUITE_END()
