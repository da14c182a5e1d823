#include "unit_test.hpp"

#include "core/simulation/output_budget.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::OutputBudget;

BOOST_AUTO_TEST_SUITE(output_budget)

namespace {

TimePoint const start = TimePoint() + 1h;

/// How many of `count` lines are passed on.
int passed(OutputBudget& budget, int count, TimePoint now)
{
    int taken = 0;
    for (int i = 0; i < count; ++i)
        taken += budget.take_line(now) ? 1 : 0;
    return taken;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_simulator_that_prints_moderately_loses_nothing)
{
    OutputBudget budget;
    BOOST_TEST(passed(budget, 2000, start) == 2000); // its start
    for (int second = 1; second <= 60; ++second) {
        BOOST_TEST(passed(budget, 500, start + second * 1s) == 500);
        BOOST_TEST((budget.read(50'000, start + second * 1s) == start + second * 1s));
    }
    BOOST_TEST((budget.notice_due() == TimePoint::max()));
    BOOST_TEST(!budget.take_notice(start + 60s).has_value());
}

BOOST_AUTO_TEST_CASE(lines_beyond_the_budget_are_counted_and_told_after_a_second_and_then_once_a_minute)
{
    OutputBudget budget;
    BOOST_TEST(passed(budget, 10'000, start) == 2000);
    BOOST_TEST((budget.notice_due() == start + 1s));
    BOOST_TEST(passed(budget, 10'000, start + 1s) == 500);
    BOOST_TEST(budget.take_notice(start + 1s).value() ==
               "17500 lines were left out: more than 500 a second were printed");
    BOOST_TEST((budget.notice_due() == TimePoint::max()));
    BOOST_TEST(passed(budget, 501, start + 2s) == 500);
    BOOST_TEST((budget.notice_due() == start + 61s));
    BOOST_TEST(budget.take_notice(start + 61s).value() ==
               "1 line was left out: more than 500 a second were printed");
    BOOST_TEST(passed(budget, 3000, start + 10min) == 2000);
    BOOST_TEST((budget.notice_due() == start + 10min + 1s));
}

BOOST_AUTO_TEST_CASE(bytes_beyond_the_budget_are_read_later)
{
    OutputBudget budget;
    BOOST_TEST((budget.read(4'000'000, start) == start));
    BOOST_TEST((budget.read(16'000, start) == start + 16ms));
    BOOST_TEST((budget.read(16'000, start + 16ms) == start + 32ms));
    BOOST_TEST((budget.read(16'000, start + 1h) == start + 1h));
}

BOOST_AUTO_TEST_CASE(heartbeats_without_end_are_thinned_out)
{
    OutputBudget budget;
    int taken = 0;
    for (int i = 0; i < 1000; ++i)
        taken += budget.take_heartbeat(start) ? 1 : 0;
    BOOST_TEST(taken == 20);
    BOOST_TEST(budget.take_heartbeat(start + 5s));
}

BOOST_AUTO_TEST_SUITE_END()
