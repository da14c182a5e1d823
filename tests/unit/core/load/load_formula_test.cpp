#include "unit_test.hpp"

#include "core/load/load_formula.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

// Protocol section 4.2.
BOOST_AUTO_TEST_SUITE(load_formula)

BOOST_AUTO_TEST_CASE(processor_load_is_the_share_of_busy_ticks)
{
    HostSample before;
    before.cpu_busy = 100;
    before.cpu_total = 1000;
    auto after = before;
    after.cpu_busy += 30;
    after.cpu_total += 120;
    BOOST_TEST(cpu_percent(before, after) == 25);
    BOOST_TEST(cpu_percent(before, before) == 0);
    BOOST_TEST(cpu_percent(after, before) == 0);
}

BOOST_AUTO_TEST_CASE(of_the_machine_and_the_share_of_a_control_group_the_fuller_one_counts)
{
    HostSample before;
    before.cpu_total = 1000;
    before.share_total = 1'000'000;
    auto after = before;
    after.cpu_total += 100;
    after.cpu_busy += 30;
    after.share_total += 500'000;
    after.share_busy += 450'000;
    BOOST_TEST(cpu_percent(before, after) == 90);
    after.share_busy = 0;
    BOOST_TEST(cpu_percent(before, after) == 30);
    before.share_total = 0; // the limit has just come
    after.share_busy = 10'000'000;
    BOOST_TEST(cpu_percent(before, after) == 30);
}

BOOST_AUTO_TEST_CASE(the_reference_formula_hides_full_memory_and_the_strict_one_does_not)
{
    HostSample sample;
    sample.memory_used = 96;
    BOOST_TEST(load_of(LoadFormula::reference, 10, sample) == 32);
    BOOST_TEST(load_of(LoadFormula::strict, 10, sample) == 96);
}

BOOST_AUTO_TEST_CASE(graphics_processors_count)
{
    HostSample sample;
    GpuSample gpu;
    gpu.compute = 70;
    gpu.memory_controller = 90;
    gpu.memory_used = 80;
    sample.gpu = gpu;
    BOOST_TEST(load_of(LoadFormula::reference, 10, sample) == 70);
    BOOST_TEST(load_of(LoadFormula::strict, 10, sample) == 80);
    sample.gpu->memory_used = 0;
    BOOST_TEST(load_of(LoadFormula::strict, 10, sample) == 70);
}

BOOST_AUTO_TEST_CASE(the_reference_formula_takes_the_mean_of_three_kinds_of_memory)
{
    HostSample sample;
    sample.swap_used = 30;
    sample.memory_used = 60;
    sample.gpu.emplace();
    sample.gpu->memory_controller = 90;
    BOOST_TEST(load_of(LoadFormula::reference, 0, sample) == 60);
    BOOST_TEST(load_of(LoadFormula::reference, 61, sample) == 61);
}

BOOST_AUTO_TEST_CASE(the_average_is_of_the_last_five)
{
    MovingAverage average;
    BOOST_TEST(average.value() == 0);
    average.add(10);
    BOOST_TEST(average.value() == 10);
    for (int i = 0; i < 5; ++i)
        average.add(20);
    BOOST_TEST(average.value() == 20);
}

BOOST_AUTO_TEST_SUITE_END()
