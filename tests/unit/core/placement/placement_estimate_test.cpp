#include "unit_test.hpp"

#include "core/placement/placement_estimate.hpp"

#include <webots_cloud/scheduler.hpp>

using namespace webots_cloud;
using namespace webots_cloud::placement;

BOOST_AUTO_TEST_SUITE(placement_estimate)

namespace {

TimePoint const start = TimePoint(std::chrono::hours(1));

/// Half an hour of reports, one every 5 s, while three sessions that cost `cost` each come and go; `disturb`
/// is added to the load.
template<class Disturbance>
double learned(double assumed, double cost, Disturbance disturb)
{
    SessionCost estimate(assumed);
    for (int time = 0; time <= 1800; time += 5) {
        int const sessions = time / 90 % 2 == 0 ? 1 : 4;
        estimate.learn(7 + cost * sessions + disturb(time), sessions, Seconds(5), true);
        estimate.combine(1, 60);
    }
    return estimate.value();
}

} // namespace

BOOST_AUTO_TEST_CASE(the_cost_of_a_session_is_learned_whatever_was_assumed)
{
    auto const quiet = [](int) { return 0.0; };
    for (double const assumed : {3.0, 12.0, 48.0})
        BOOST_TEST(learned(assumed, 12, quiet) == 12, boost::test_tools::tolerance(0.1));
}

BOOST_AUTO_TEST_CASE(noise_does_not_move_the_cost)
{
    RandomSource random(2);
    auto const noise = [&](int) { return 10 * (random.uniform() - 0.5); };
    BOOST_TEST(learned(12, 12, noise) == 12, boost::test_tools::tolerance(0.1));
}

BOOST_AUTO_TEST_CASE(a_minute_of_other_work_hardly_moves_the_cost)
{
    auto const compiler = [](int time) { return time >= 300 && time < 360 ? 60.0 : 0.0; };
    BOOST_TEST(learned(12, 12, compiler) == 12, boost::test_tools::tolerance(0.15));
}

BOOST_AUTO_TEST_CASE(many_sessions_at_once_tell_their_cost_by_the_load_itself)
{
    SessionCost estimate(12);
    estimate.weigh(5 + 40 * 1.5, 40, 40);
    estimate.combine(1, 60);
    BOOST_TEST(estimate.value() < 2);
    BOOST_TEST(estimate.value() > 1.5);
    estimate.weigh(50, 3, 3);
    estimate.combine(1, 300);
    BOOST_TEST(estimate.value() == 12);
}

BOOST_AUTO_TEST_CASE(machines_that_disagree_listen_less_to_the_fleet)
{
    FleetCost alike;
    FleetCost unlike;
    for (int report = 0; report != 300; ++report) {
        alike.learn({10, 10}, {1000, 1000}, start);
        bool const big = report % 2 == 0;
        unlike.learn({10, big ? 1.0 : 30.0}, {1000, big ? 100.0 : 3000.0}, start);
    }
    BOOST_TEST(alike.ratio() == 1, boost::test_tools::tolerance(1e-9));
    BOOST_TEST(alike.strength() == 300);
    BOOST_TEST(unlike.strength() < 60);
}

BOOST_AUTO_TEST_CASE(all_browsers_are_expected_until_some_never_came)
{
    ShowRate rate(0);
    AgeCounts unseen{};
    unseen[0] = 4;
    BOOST_TEST(rate.expected(unseen) == 4);
    AgeCounts came{};
    came[0] = 90;
    rate.record(came, 100);
    // With ten that are assumed, 100 of 200 came, all of them at once: few that are late will come.
    BOOST_TEST(rate.expected(unseen) == 2, boost::test_tools::tolerance(1e-9));
    AgeCounts late{};
    late[3] = 4;
    BOOST_TEST(rate.expected(late) == 4 * 10.0 / 110, boost::test_tools::tolerance(1e-9));
}

BOOST_AUTO_TEST_CASE(however_many_never_came_who_cannot_have_been_reported_counts_half)
{
    ShowRate rate(0.5);
    rate.record({}, 990);
    AgeCounts fresh{};
    fresh[0] = fresh[1] = 2;
    BOOST_TEST(rate.expected(fresh) == 2);
    AgeCounts old{};
    old[2] = 4;
    BOOST_TEST(rate.expected(old) == 0.04, boost::test_tools::tolerance(1e-9));
}

BOOST_AUTO_TEST_CASE(placements_of_which_the_load_shows_no_trace_teach_nothing)
{
    SessionCost estimate(12);
    Doubt doubt;
    for (int time = 0; time <= 300; time += 5) {
        doubt.unclaimed = time < 60 ? 0 : 33;
        BOOST_TEST(estimate.learn(10, 0, Seconds(5), true, doubt).xx == 0);
    }
    BOOST_TEST(!estimate.has_shown_unclaimed());
    estimate.forget(1); // nobody came: as if it had never been placed
    BOOST_TEST(estimate.learn(10, 0, Seconds(5), true).xx == 0);
}

BOOST_AUTO_TEST_CASE(a_load_that_rises_with_unclaimed_placements_shows_what_each_of_them_costs)
{
    SessionCost estimate(12);
    Doubt doubt;
    for (int time = 0; time <= 100; time += 5) {
        doubt.unclaimed = time < 60 ? 0 : 4;
        estimate.learn(time < 60 ? 10 : 30, 0, Seconds(5), true, doubt);
    }
    BOOST_TEST(estimate.has_shown_unclaimed());
    BOOST_TEST(!estimate.has_shown_unclaimed(), "until it is shown again");
    estimate.claim(1);
    for (int time = 105; time <= 300; time += 5)
        estimate.learn(30, 4, Seconds(5), true);
    estimate.combine(1, 10);
    BOOST_TEST(estimate.value() == 5, boost::test_tools::tolerance(0.1));
}

BOOST_AUTO_TEST_CASE(a_fall_teaches_only_where_a_departure_may_explain_it)
{
    for (bool const known_to_stay : {false, true}) {
        SessionCost estimate(12);
        Doubt doubt;
        doubt.no_departures = known_to_stay;
        for (int time = 0; time <= 300; time += 5)
            estimate.learn(time < 60 ? 0 : 60, time < 60 ? 0 : 4, Seconds(5), true, doubt);
        Evidence const fallen = estimate.learn(5, 4, Seconds(5), true, doubt);
        BOOST_TEST((fallen.xx == 0) == known_to_stay);
    }
}

BOOST_AUTO_TEST_CASE(the_variety_of_sessions_is_learned)
{
    SessionVariety same;
    SessionVariety different;
    for (int session = 0; session != 500; ++session) {
        same.record(0);
        different.record(1);
    }
    BOOST_TEST(same.value() < 0.01);
    BOOST_TEST(different.value() == 1, boost::test_tools::tolerance(0.01));
}

BOOST_AUTO_TEST_CASE(reservations_are_confirmed_newest_or_oldest_first_and_run_out_by_age)
{
    Reservations reservations;
    reservations.add(100);
    reservations.add(103);
    BOOST_TEST(reservations.count() == 2u);
    BOOST_TEST(reservations.by_age()[3] == 1u);
    AgeCounts confirmed{};
    BOOST_TEST(reservations.confirm(1, true, confirmed) == 1u);
    BOOST_TEST(confirmed[0] == 1u);
    BOOST_TEST(reservations.age_until(107) == 0u);
    BOOST_TEST(reservations.age_until(108) == 1u);
    BOOST_TEST(reservations.count() == 0u);
    reservations.add(200);
    reservations.add(203);
    confirmed.fill(0);
    BOOST_TEST(reservations.confirm(5, false, confirmed) == 2u);
    BOOST_TEST(confirmed[3] == 1u);
}

BOOST_AUTO_TEST_CASE(placements_become_visible_in_a_bare_number_after_some_time)
{
    PlacedHistory placed;
    placed.age_until(50);
    placed.add();
    BOOST_TEST(placed.visible() == 0);
    placed.age_until(53);
    BOOST_TEST(placed.visible() == 0.6, boost::test_tools::tolerance(1e-9));
    placed.age_until(500);
    BOOST_TEST(placed.visible() == 1);
}

BOOST_AUTO_TEST_CASE(a_sample_that_shows_a_session_in_part_teaches_nothing)
{
    SessionCost estimate(12);
    estimate.learn(0, 0, Seconds(5), true);
    estimate.learn(0, 0, Seconds(5), true);
    BOOST_TEST(estimate.learn(1, 3, Seconds(5), false).xx == 0);
    estimate.combine(1, 60);
    BOOST_TEST(estimate.value() == 12, boost::test_tools::tolerance(1e-9));
}

BOOST_AUTO_TEST_CASE(what_happened_in_a_long_silence_teaches_nothing)
{
    SessionCost estimate(12);
    estimate.learn(0, 0, Seconds(5), true);
    estimate.learn(0, 0, Seconds(5), true);
    BOOST_TEST(estimate.learn(80, 1, Seconds(31), true).xx == 0);
    BOOST_TEST(estimate.learn(80, 1, Seconds(5), true).xx == 0);
}

BOOST_AUTO_TEST_CASE(one_wild_sample_counts_as_three_sessions_at_most)
{
    SessionCost estimate(12);
    for (int quiet = 0; quiet != 100; ++quiet)
        estimate.learn(0, 0, Seconds(5), true);
    Evidence const wild = estimate.learn(500, 1, Seconds(5), true);
    BOOST_TEST(wild.xy / wild.xx < 3.2); // the filter passes 0.96 of the session
}

BOOST_AUTO_TEST_CASE(what_a_machine_taught_fades_within_hours)
{
    SessionCost estimate(12);
    for (int time = 0; time <= 600; time += 5)
        estimate.learn(12 * (time / 60 % 2), time / 60 % 2, Seconds(5), true);
    double const fresh = estimate.evidence().xx;
    for (int time = 0; time <= 7200; time += 5)
        estimate.learn(0, 0, Seconds(5), true);
    BOOST_TEST(estimate.evidence().xx < fresh / 4);
}

BOOST_AUTO_TEST_CASE(a_few_light_sessions_say_little_by_the_load_itself)
{
    SessionCost estimate(12);
    estimate.weigh(5 + 10 * 0.1, 10, 10); // most of it is the five percent of load from other programs
    estimate.combine(1, 60);
    BOOST_TEST(estimate.value() > 10);
}

BOOST_AUTO_TEST_CASE(one_absurd_report_does_not_teach_the_fleet_for_hours)
{
    FleetCost fleet;
    fleet.learn({5e12, 5e14}, {}, start);
    for (int report = 0; report != 100; ++report)
        fleet.learn({1000, 1000}, {}, start);
    BOOST_TEST(fleet.ratio() < 20);
}

BOOST_AUTO_TEST_CASE(one_absurd_machine_does_not_make_the_fleet_disagree)
{
    FleetCost fleet;
    fleet.learn({}, {1000, 1e6}, start);
    BOOST_TEST(fleet.strength() > 100);
}

BOOST_AUTO_TEST_CASE(one_absurd_session_does_not_make_all_look_different)
{
    SessionVariety variety;
    variety.record(1e6);
    BOOST_TEST(variety.value() < 1);
}

BOOST_AUTO_TEST_CASE(who_came_long_ago_says_little_about_who_comes_now)
{
    ShowRate rate(0);
    AgeCounts came{};
    came[0] = 100;
    for (int good = 0; good != 100; ++good)
        rate.record(came, 0);
    for (int bad = 0; bad != 20; ++bad)
        rate.record({}, 100);
    AgeCounts unseen{};
    unseen[0] = 1;
    BOOST_TEST(rate.expected(unseen) < 0.1); // more than 4 of 5 of all that were counted came
}

BOOST_AUTO_TEST_SUITE_END()
