#include "unit_test.hpp"

#include "core/pages/monitor_sample.hpp"
#include "core/pages/simulation_board.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

// Protocol section 9.2.
BOOST_AUTO_TEST_SUITE(monitor_sample)

namespace {

constexpr WallTime wall(1'700'000'000s);

MonitorSample sample()
{
    MonitorSample sample;
    sample.running = 3;
    sample.idle = 1;
    sample.cpu = 12.34;
    sample.memory = 50;
    sample.gpu_compute = 7;
    sample.gpu_memory_controller = 2;
    sample.gpu_memory = 66.66;
    sample.disk = 81.25;
    sample.sent = 1.23456;
    sample.received = 0.0004;
    return sample;
}

} // namespace

BOOST_AUTO_TEST_CASE(the_csv_is_as_it_has_always_been)
{
    BOOST_TEST(monitor_csv_header() == "Timestamp, Webots running, Webots idle, CPU load, CPU memory, GPU "
                                       "load compute, GPU load memory, GPU memory, "
                                       "Swap, Disk, Network sent, Network received\n");
    BOOST_TEST(monitor_csv_line(wall, sample()) ==
               "1700000000, 3, 1, 12.3, 50.0, 7.0, 2.0, 66.7, 0.0, 81.3, 1.235, 0.0\n");
}

BOOST_AUTO_TEST_CASE(figures_are_the_difference_of_two_looks)
{
    HostSample before;
    before.cpu_busy = 100;
    before.cpu_total = 1000;
    before.bytes_sent = 1'000'000;
    before.bytes_received = 9'000'000;
    HostSample after;
    after.cpu_busy = 150;
    after.cpu_total = 1200;
    after.memory_used = 40;
    after.swap_used = 5;
    after.disk_used = 60;
    after.bytes_sent = 6'000'000;
    after.bytes_received = 8'000'000; // less than before: an interface was removed
    auto const figures = machine_figures(before, after, 2s);
    BOOST_TEST(figures.cpu == 25);
    BOOST_TEST(figures.memory == 40);
    BOOST_TEST(figures.swap == 5);
    BOOST_TEST(figures.disk == 60);
    BOOST_TEST(figures.sent == 2.5);
    BOOST_TEST(figures.received == 0);
    BOOST_TEST(figures.gpu_compute == 0);
    BOOST_TEST(machine_figures(before, after, 0s).sent == 0);
    after.gpu.emplace();
    after.gpu->compute = 70;
    BOOST_TEST(machine_figures(before, after, 2s).gpu_compute == 70);
}

BOOST_AUTO_TEST_CASE(looks_are_on_whole_seconds_and_no_second_has_two)
{
    BOOST_TEST((until_next_second(wall) == 1s));
    BOOST_TEST((until_next_second(wall + 250ms) == 750ms));
    BOOST_TEST((until_next_second(wall - 1ms) == 1001ms));
    // A sample taken a little early belongs to the second that it was meant for.
    BOOST_TEST(monitor_csv_line(wall - 1ms, sample()).starts_with("1700000000,"));
    BOOST_TEST(monitor_csv_line(wall + 800ms, sample()).starts_with("1700000000,"));
}

BOOST_AUTO_TEST_CASE(the_pages_texts_carry_every_series)
{
    SimulationBoard board;
    board.take(sample(), 12.5, TimePoint(1h), wall);
    SimulationRow row;
    row.id = 4;
    row.world = "a\"b.wbt";
    row.state = "running";
    row.age = 65s;
    auto const update = board.update({row}, 10);
    BOOST_TEST(update == R"({"now":1700000000,"load":12.5,"count":1,"capacity":10,"simulations":[)"
                         R"({"id":4,"world":"a\"b.wbt","state":"running","age":65}],)"
                         R"("point":[3,1,12.34,50,7,2,66.66,0,81.25,1.235,0],)"
                         R"("dayPoint":[3,1,12.3,50,7,2,66.7,0,81.2,1.2,0]})");
    row.staged = true;
    BOOST_TEST(board.update({row}, 10).find(R"("capacity":10,"staged":1,"simulations":[)") !=
               std::string::npos);
    row.process = 77;
    row.cpu = 99.96;
    row.memory = 12.34;
    auto const snapshot = board.snapshot({row}, 10);
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
    BOOST_TEST(board.snapshot({row}, 10).find(R"(,"about":{"title":"Lab 7"},)") != std::string::npos);
    board.take(sample(), 12.5, TimePoint(1h) + 1s, wall);
    BOOST_TEST(board.update({row}, 10).find("dayPoint") == std::string::npos, "the minute is not over");
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
    BOOST_TEST(board.snapshot(rows, 10'000).size() < 120'000u);
    BOOST_TEST(board.snapshot(rows, 10'000).find("\"count\":10000,") != std::string::npos);
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
