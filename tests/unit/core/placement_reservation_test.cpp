// How long a placement counts.
#include "placement_fixture.hpp"

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using std::chrono::seconds;

BOOST_AUTO_TEST_SUITE(placement_reservation)

BOOST_FIXTURE_TEST_CASE(a_report_that_counts_the_session_confirms_its_placement, OneMachine)
{
    place(3);
    scheduler.report("a", counted(0, 2, 2), start + seconds(5));
    BOOST_TEST(machine("a").pending == 1);
    // Two are starting and one is on its way: all three are still committed.
    BOOST_TEST(machine("a").committed == 36, boost::test_tools::tolerance(1e-9));
}

BOOST_FIXTURE_TEST_CASE(sessions_that_start_count_until_their_load_shows, OneMachine)
{
    place(2);
    scheduler.report("a", counted(0, 2, 2), start + seconds(5));
    scheduler.report("a", counted(24, 2, 0), start + seconds(25));
    BOOST_TEST(machine("a").pending == 0);
    BOOST_TEST(machine("a").committed == 24, boost::test_tools::tolerance(1e-9));
}

BOOST_FIXTURE_TEST_CASE(a_start_reveals_an_arrival_that_a_departure_hides, OneMachine)
{
    scheduler.report("a", counted(24, 2, 0), start + seconds(1));
    place(1, start + seconds(2));
    scheduler.report("a", counted(12, 2, 1), start + seconds(6));
    BOOST_TEST(machine("a").pending == 0);
}

BOOST_FIXTURE_TEST_CASE(a_reservation_that_nobody_uses_runs_out, OneMachine)
{
    place(1);
    for (int time = 5; time <= 50; time += 5)
        scheduler.report("a", counted(0, 0), start + seconds(time));
    BOOST_TEST(machine("a").pending == 1);
    for (int time = 55; time <= 70; time += 5)
        scheduler.report("a", counted(0, 0), start + seconds(time));
    BOOST_TEST(machine("a").pending == 0);
}

BOOST_AUTO_TEST_CASE(only_reports_settle_reservations)
{
    SchedulerParams params;
    params.report_lifetime = Duration::zero();
    OneMachine fixture(params);
    fixture.place(4, fixture.teach_cost());
    BOOST_TEST(!fixture.scheduler.available(start + std::chrono::hours(1)));
    fixture.scheduler.report("a", counted(0, 0), start + std::chrono::hours(1));
    BOOST_TEST(fixture.scheduler.available(start + std::chrono::hours(1)));
}

BOOST_AUTO_TEST_CASE(where_many_never_come_a_reservation_counts_less)
{
    OneMachine fixture;
    TimePoint now = start;
    int sessions = 0;
    for (int round = 0; round != 60; ++round) {
        fixture.scheduler.place(now).value();
        fixture.scheduler.place(now).value();
        ++sessions; // one of two comes, at once, and stays idle
        for (int report = 0; report != 14; ++report)
            fixture.scheduler.report("a", counted(0, sessions), now += seconds(5));
    }
    double const before = fixture.machine("a", now).committed;
    fixture.scheduler.place(now).value();
    double const counts = (fixture.machine("a", now).committed - before) / fixture.machine("a", now).cost;
    // 60 came, 60 did not, and ten are assumed to have come: 70 / 130.
    BOOST_TEST(counts == 70.0 / 130, boost::test_tools::tolerance(0.02));
}

BOOST_AUTO_TEST_CASE(a_rise_of_a_bare_number_confirms_what_it_is_worth)
{
    Scheduler scheduler;
    scheduler.set_servers(named({"a"}));
    scheduler.report("a", LoadReport(5), start);
    for (int session = 0; session != 3; ++session)
        scheduler.place(start).value();
    scheduler.report("a", LoadReport(6), start + seconds(5));
    BOOST_TEST(scheduler.machines(start + seconds(5)).front().pending == 3);
    scheduler.report("a", LoadReport(28), start + seconds(25));
    BOOST_TEST(scheduler.machines(start + seconds(25)).front().pending == 1);
    scheduler.report("a", LoadReport(28), start + seconds(70));
    BOOST_TEST(scheduler.machines(start + seconds(70)).front().pending == 0);
}

BOOST_FIXTURE_TEST_CASE(a_newly_counted_session_is_the_newest_placement, OneMachine)
{
    place(1);
    scheduler.report("a", counted(0, 0), start + seconds(30));
    place(1, start + seconds(30));
    scheduler.report("a", counted(0, 1, 1), start + seconds(35));
    scheduler.report("a", counted(0, 1, 1), start + seconds(65));
    BOOST_TEST(machine("a", start + seconds(65)).pending == 0, "the first never came");
}

BOOST_AUTO_TEST_CASE(a_rise_of_a_bare_number_is_the_oldest_placement)
{
    Scheduler scheduler;
    scheduler.set_servers(named({"a"}));
    TimePoint now = start;
    scheduler.report("a", LoadReport(0), now);
    (void)scheduler.place(now);
    scheduler.report("a", LoadReport(0), now += seconds(30));
    (void)scheduler.place(now);
    scheduler.report("a", LoadReport(12), now += seconds(5));
    scheduler.report("a", LoadReport(12), now += seconds(30));
    BOOST_TEST(scheduler.machines(now).front().pending == 1, "the second is still on its way");
}

BOOST_AUTO_TEST_CASE(without_a_placement_timeout_the_next_report_shows_whoever_came)
{
    SchedulerParams params;
    params.placement_timeout = Duration::zero();
    OneMachine fixture(params);
    fixture.place(3);
    BOOST_TEST(fixture.machine("a").pending == 3);
    fixture.scheduler.report("a", counted(0, 0), start + seconds(1));
    BOOST_TEST(fixture.machine("a", start + seconds(1)).pending == 0);
}

BOOST_AUTO_TEST_SUITE_END()
