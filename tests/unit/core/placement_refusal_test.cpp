// Who is not offered, or offered with care.
#include "placement_fixture.hpp"

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using std::chrono::seconds;

BOOST_AUTO_TEST_SUITE(placement_refusal)

BOOST_AUTO_TEST_CASE(a_machine_never_gets_more_sessions_than_its_capacity)
{
    OneMachine fixture;
    LoadReport report = counted(1, 2);
    report.capacity = 5;
    fixture.scheduler.report("a", report, start);
    fixture.place(3);
    BOOST_TEST(fixture.scheduler.place(start).has_error());
    BOOST_TEST((fixture.machine("a").refusal == Refusal::full));
    report.sessions = 4; // one of the three is still on its way
    fixture.scheduler.report("a", report, start + seconds(5));
    BOOST_TEST(!fixture.scheduler.available(start + seconds(5)));
}

BOOST_AUTO_TEST_CASE(a_machine_short_of_memory_is_not_offered_however_idle)
{
    OneMachine fixture;
    LoadReport report = counted(0, 0);
    report.memory = 90;
    fixture.scheduler.report("a", report, start);
    BOOST_TEST(!fixture.scheduler.available(start));
    BOOST_TEST((fixture.machine("a").refusal == Refusal::memory));
    report.memory = 87; // room for one session of 2 %, then for half of one
    fixture.scheduler.report("a", report, start);
    fixture.place(2);
    BOOST_TEST(!fixture.scheduler.available(start));
}

BOOST_AUTO_TEST_CASE(a_machine_that_drains_gets_nothing_new)
{
    OneMachine fixture;
    LoadReport report = counted(0, 0);
    report.draining = true;
    fixture.scheduler.report("a", report, start);
    BOOST_TEST(!fixture.scheduler.available(start));
    BOOST_TEST((fixture.machine("a").refusal == Refusal::draining));
    fixture.scheduler.report("a", counted(0, 0), start);
    BOOST_TEST(fixture.scheduler.available(start));
}

BOOST_AUTO_TEST_CASE(the_operator_drains_a_machine_and_undoes_it_without_a_report)
{
    OneMachine fixture;
    std::vector<ServerSpec> servers = named({"a"});
    servers[0].drain = true;
    fixture.scheduler.set_servers(servers);
    BOOST_TEST((fixture.machine("a").refusal == Refusal::draining));
    servers[0].drain = false;
    fixture.scheduler.set_servers(servers);
    BOOST_TEST(fixture.scheduler.available(start));
}

BOOST_FIXTURE_TEST_CASE(a_lost_machine_is_not_offered_until_its_next_report, OneMachine)
{
    scheduler.lost("a", start + seconds(5));
    BOOST_TEST(!scheduler.available(start + seconds(5)));
    BOOST_TEST((machine("a", start + seconds(5)).refusal == Refusal::lost));
    scheduler.report("a", counted(0, 0), start + seconds(10));
    BOOST_TEST(scheduler.available(start + seconds(10)));
}

BOOST_FIXTURE_TEST_CASE(a_machine_that_never_answered_is_unknown_and_not_lost, Fixture)
{
    scheduler.set_servers(named({"a", "b", "c", "d"}));
    scheduler.lost("d", start);
    BOOST_TEST((machine("d").refusal == Refusal::unknown));
    // It may have been up all the time, so it is not spared when it answers.
    for (char const* const name : {"a", "b", "c"})
        scheduler.report(name, counted(36, 0), start + seconds(5));
    scheduler.report("d", counted(0, 0), start + seconds(5));
    BOOST_TEST(place(3, start + seconds(5))["d"] == 3);
}

BOOST_FIXTURE_TEST_CASE(a_report_is_trusted_for_its_lifetime, OneMachine)
{
    BOOST_TEST(scheduler.available(start + seconds(15)));
    BOOST_TEST(!scheduler.available(start + seconds(16)));
    BOOST_TEST((machine("a", start + seconds(16)).refusal == Refusal::stale));
    scheduler.report("a", counted(0, 0), start + seconds(17));
    BOOST_TEST(scheduler.available(start + seconds(17)));
}

BOOST_FIXTURE_TEST_CASE(a_report_that_became_too_old_is_not_placed_upon, OneMachine)
{
    BOOST_TEST(scheduler.place(start + seconds(16)).has_error());
}

BOOST_FIXTURE_TEST_CASE(machines_show_as_stale_without_being_asked_for_a_place, Fixture)
{
    for (Candidate const& candidate : scheduler.machines(start + seconds(16)))
        BOOST_TEST((candidate.refusal == Refusal::stale), candidate.address);
}

BOOST_AUTO_TEST_CASE(without_a_lifetime_a_report_is_trusted_for_ever)
{
    SchedulerParams params;
    params.report_lifetime = Duration::zero();
    BOOST_TEST(OneMachine(params).scheduler.available(start + std::chrono::hours(24)));
}

BOOST_FIXTURE_TEST_CASE(a_new_list_does_not_make_old_reports_younger, Fixture)
{
    scheduler.report("a", counted(0, 0), start + seconds(10));
    scheduler.set_servers(named({"a", "b"}));
    BOOST_TEST((machine("b", start + seconds(16)).refusal == Refusal::stale));
    BOOST_TEST((machine("a", start + seconds(16)).refusal == Refusal::none));
}

BOOST_FIXTURE_TEST_CASE(a_lost_machine_is_lost_however_long_it_is_silent, OneMachine)
{
    scheduler.lost("a", start + seconds(5));
    BOOST_TEST((machine("a", start + seconds(100)).refusal == Refusal::lost));
    scheduler.report("a", counted(0, 0), start + seconds(100));
    BOOST_TEST(scheduler.available(start + seconds(100)));
}

BOOST_FIXTURE_TEST_CASE(a_machine_that_came_back_empty_is_filled_cautiously, Fixture)
{
    scheduler.lost("a", start);
    TimePoint const back = start + seconds(100);
    for (char const* const name : {"b", "c"})
        scheduler.report(name, counted(36, 3), back);
    scheduler.report("a", counted(0, 0), back);
    // Alone, a would take all three.
    auto const placed = place(3, back);
    BOOST_TEST(!placed.contains("a"));

    TimePoint const later = back + seconds(30);
    for (char const* const name : {"b", "c"})
        scheduler.report(name, counted(36, 3), later);
    scheduler.report("a", counted(0, 0), later);
    BOOST_TEST(place(1, later).contains("a"));
}

BOOST_FIXTURE_TEST_CASE(a_machine_that_was_away_for_a_moment_is_filled_cautiously_too, Fixture)
{
    scheduler.lost("a", start + seconds(5));
    TimePoint const back = start + seconds(10);
    for (char const* const name : {"b", "c"})
        scheduler.report(name, counted(36, 0), back);
    scheduler.report("a", counted(0, 0), back);
    BOOST_TEST(!place(3, back).contains("a"));
}

BOOST_FIXTURE_TEST_CASE(machines_that_answer_when_we_start_were_up_before_us, Fixture)
{
    for (char const* const name : {"b", "c"})
        scheduler.report(name, counted(36, 0), start);
    BOOST_TEST(place(3)["a"] == 3);
}

BOOST_FIXTURE_TEST_CASE(a_machine_that_answers_first_when_we_have_run_for_long_has_just_come_up, Fixture)
{
    TimePoint const later = start + seconds(100);
    scheduler.set_servers(named({"a", "b", "c", "d"}));
    for (char const* const name : {"a", "b", "c"})
        scheduler.report(name, counted(36, 0), later);
    scheduler.report("d", counted(0, 0), later);
    BOOST_TEST(!place(3, later).contains("d"));
}

BOOST_FIXTURE_TEST_CASE(slow_start_makes_nobody_wait_where_there_is_no_other_machine, OneMachine)
{
    scheduler.lost("a", start);
    scheduler.report("a", counted(0, 0), start + seconds(100));
    place(7, start + seconds(100));
    BOOST_TEST(machine("a", start + seconds(100)).committed == 84, boost::test_tools::tolerance(1e-9));
    BOOST_TEST(scheduler.available(start + seconds(100)));
}

BOOST_FIXTURE_TEST_CASE(a_machine_whose_sessions_survived_was_not_down, Fixture)
{
    scheduler.report("a", counted(12, 1), start);
    scheduler.lost("a", start);
    TimePoint const back = start + seconds(10);
    for (char const* const name : {"b", "c"})
        scheduler.report(name, counted(48, 4), back);
    scheduler.report("a", counted(12, 1), back);
    BOOST_TEST(place(2, back)["a"] == 2);
}

BOOST_AUTO_TEST_CASE(a_machine_of_weight_two_is_filled_twice_as_high)
{
    Fixture fixture({}, {"a", "b"});
    std::vector<ServerSpec> servers = named({"a", "b"});
    servers[0].weight = 2;
    fixture.scheduler.set_servers(servers);
    auto placed = fixture.place(9);
    BOOST_TEST(placed["a"] == 6);
    BOOST_TEST(placed["b"] == 3);
}

BOOST_AUTO_TEST_CASE(a_weight_that_is_no_positive_number_counts_as_one)
{
    double const infinity = std::numeric_limits<double>::infinity();
    for (double const weight : {0.0, -2.0, infinity, std::numeric_limits<double>::quiet_NaN()}) {
        OneMachine fixture;
        std::vector<ServerSpec> servers = named({"a"});
        servers[0].weight = weight;
        fixture.scheduler.set_servers(servers);
        BOOST_TEST(fixture.machine("a").weight == 1);
    }
}

BOOST_FIXTURE_TEST_CASE(a_new_list_keeps_what_is_known_of_machines_that_stay, Fixture)
{
    place(6);
    scheduler.set_servers(named({"d", "c", "b"}));
    BOOST_TEST(machine("c").pending == 2);
    BOOST_TEST(machine("b").pending == 2);
    BOOST_TEST((machine("d").refusal == Refusal::unknown));
    BOOST_TEST(scheduler.machines(start).size() == 3u);
    scheduler.set_servers(named({"a"}));
    BOOST_TEST((machine("a").refusal == Refusal::unknown), "what is left out is forgotten");
    BOOST_TEST(!scheduler.available(start));
}

BOOST_AUTO_TEST_CASE(of_entries_with_one_address_the_first_counts)
{
    Scheduler scheduler;
    std::vector<ServerSpec> servers = named({"a", "a"});
    servers[1].drain = true;
    scheduler.set_servers(servers);
    scheduler.report("a", LoadReport(0), start);
    BOOST_TEST(scheduler.machines(start).size() == 1u);
    BOOST_TEST(scheduler.available(start));
}

BOOST_AUTO_TEST_SUITE_END()
