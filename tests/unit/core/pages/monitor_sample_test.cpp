#include "core/pages/monitor_sample_fixture.hpp"
#include "unit_test.hpp"

#include "core/pages/monitor_sample.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace webots_cloud::monitor_test;
using namespace std::chrono_literals;

// Protocol section 9.2.
BOOST_AUTO_TEST_SUITE(monitor_sample)

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

BOOST_AUTO_TEST_SUITE_END()
