#include "core/pages/monitor_sample_fixture.hpp"
#include "unit_test.hpp"

#include "core/pages/simulation_board.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace webots_cloud::monitor_test;
using namespace std::chrono_literals;

// Protocol section 9.3.
BOOST_AUTO_TEST_SUITE(simulation_board)

namespace {

std::vector<MachineFigure> const seats{{"capacity", 10}};

} // namespace

BOOST_AUTO_TEST_CASE(the_pages_texts_carry_every_series)
{
    SimulationBoard board;
    board.take(sample(), 12.5, TimePoint(1h), wall);
    SimulationRow row;
    row.id = 4;
    row.world = "a\"b.wbt";
    row.state = "running";
    row.age = 65s;
    auto const update = board.update({row}, seats);
    BOOST_TEST(update == R"({"now":1700000000,"load":12.5,"count":1,"capacity":10,"simulations":[)"
                         R"({"id":4,"world":"a\"b.wbt","state":"running","age":65}],)"
                         R"("point":[3,1,12.34,50,7,2,66.66,0,81.25,1.235,0],)"
                         R"("dayPoint":[3,1,12.3,50,7,2,66.7,0,81.2,1.2,0]})");
    BOOST_TEST(board.update({row}, {{"capacity", 10}, {"sent", 1.26, 1}})
                   .find(R"("capacity":10,"sent":1.3,"simulations")") != std::string::npos);
    row.staged = true;
    BOOST_TEST(board.update({row}, seats).find(R"("capacity":10,"staged":1,"simulations":[)") !=
               std::string::npos);
    row.process = 77;
    row.cpu = 99.96;
    row.memory = 12.34;
    auto const snapshot = board.snapshot({row}, seats);
    BOOST_TEST(snapshot.find(R"("process":77,"cpu":100,"memory":12.3})") != std::string::npos);
    BOOST_TEST(snapshot.find(R"("spacing":1,"series":[{"name":"Webots running","history":[3]})") !=
               std::string::npos);
    for (auto const name : MonitorSample::names())
        BOOST_TEST(snapshot.find(name) != std::string::npos, name);
    BOOST_TEST(
        snapshot.find(R"("day":{"last":0,"spacing":60,"series":[{"name":"Webots running","history":[3]})") !=
        std::string::npos);
    BOOST_TEST(snapshot.find("about") == std::string::npos);
    board.describe(R"({"title":"Lab 7"})");
    BOOST_TEST(board.snapshot({row}, seats).find(R"(,"about":{"title":"Lab 7"},)") != std::string::npos);
    board.take(sample(), 12.5, TimePoint(1h) + 1s, wall);
    BOOST_TEST(board.update({row}, seats).find("dayPoint") == std::string::npos, "the minute is not over");
}

BOOST_AUTO_TEST_CASE(texts_are_bounded_however_much_runs)
{
    SimulationBoard board;
    for (int i = 0; i < 2000; ++i)
        board.take(sample(), 12.5, TimePoint(1h), wall);
    SimulationRow row;
    row.world = short_world(std::string(100'000, 'x') + "/worlds/arena.wbt");
    row.state = "fetching the project";
    BOOST_TEST(row.world.size() <= 200u);
    BOOST_TEST(row.world.ends_with("/worlds/arena.wbt"));
    std::vector<SimulationRow> const rows(10'000, row);
    BOOST_TEST(board.snapshot(rows, seats).size() < 120'000u);
    BOOST_TEST(board.snapshot(rows, seats).find("\"count\":10000,") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(what_a_process_tree_uses_is_a_share_of_one_processor)
{
    BOOST_TEST(process_cpu_percent(1s, 2s, 4s) == 25);
    BOOST_TEST(process_cpu_percent(1s, 9s, 4s) == 200);
    BOOST_TEST(process_cpu_percent(2s, 1s, 4s) ==
               0); // a process has ended, and its time is no longer counted
    BOOST_TEST(process_cpu_percent(1s, 2s, 0s) == 0);
}

BOOST_AUTO_TEST_SUITE_END()
