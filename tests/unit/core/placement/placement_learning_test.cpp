// What the scheduler learns from reports: the cost of sessions and how much it varies, which browsers arrive,
// and what other session servers place.
#include "placement_fixture.hpp"

#include <cmath>

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using boost::test_tools::tolerance;
using std::chrono::seconds;

BOOST_AUTO_TEST_SUITE(placement_learning)

namespace {

/// A machine on which sessions come and go every minute for an hour; `load_of` tells how loaded it is with
/// them.
template<class Load>
TimePoint teach(Scheduler& scheduler, std::string_view name, Load load_of, TimePoint now = start)
{
    for (int time = 0; time <= 3600; time += 5) {
        int const sessions = time / 60 % 2 == 0 ? 1 : 3;
        scheduler.report(name, load_of(sessions, time), now += seconds(5));
    }
    return now;
}

LoadReport each(double cost, int sessions)
{
    return counted(5 + cost * sessions, sessions);
}

/// The standard deviation of the cost of sessions, relative to their mean, that the score reckons with.
double variety(Candidate const& machine)
{
    return (machine.score - machine.committed) / machine.cost - 1;
}

} // namespace

BOOST_FIXTURE_TEST_CASE(a_machine_learns_what_its_sessions_cost, OneMachine)
{
    TimePoint const now = teach(scheduler, "a", [](int sessions, int) { return each(24, sessions); });
    BOOST_TEST(machine("a", now).cost == 24, tolerance(0.05));
}

BOOST_FIXTURE_TEST_CASE(a_report_that_shows_newcomers_in_part_does_not_tell_their_cost, OneMachine)
{
    constexpr std::array<int, 4> coming_and_going = {0, 2, 4, 2};
    for (std::size_t report = 0; report != 720; ++report)
        scheduler.report("a", counted(60, coming_and_going[report % 4]), start + seconds(5) * report);
    BOOST_TEST(machine("a", start + seconds(3600)).cost == 12, tolerance(1e-9));
}

BOOST_FIXTURE_TEST_CASE(what_one_machine_learns_its_fleet_believes, Fixture)
{
    TimePoint const now = teach(scheduler, "a", [](int sessions, int) { return each(24, sessions); });
    BOOST_TEST(machine("b", now).cost == 24, tolerance(0.1));
}

BOOST_AUTO_TEST_CASE(a_machine_that_reports_a_bare_number_learns_from_what_was_placed_there)
{
    Scheduler scheduler;
    scheduler.set_servers(named({"a"}));
    std::vector<TimePoint> sessions;
    TimePoint now = start;
    for (int time = 0; time <= 7200; time += 5, now += seconds(5)) {
        // A browser every four minutes; its session shows after 30 s and stays.
        auto const visible =
            std::ranges::count_if(sessions, [&](TimePoint at) { return now - at >= seconds(30); });
        scheduler.report("a", LoadReport(3 * static_cast<double>(visible)), now);
        if (time % 240 == 0) {
            (void)scheduler.place(now);
            sessions.push_back(now);
        }
    }
    BOOST_TEST(scheduler.machines(now).front().cost < 5);
    BOOST_TEST(scheduler.machines(now).front().cost > 2);
}

BOOST_FIXTURE_TEST_CASE(of_many_sessions_the_load_itself_tells_their_cost_at_once, OneMachine)
{
    scheduler.report("a", counted(65, 40), start);
    scheduler.report("a", counted(65, 40), start + seconds(5));
    BOOST_TEST(machine("a", start + seconds(5)).cost < 4);
}

BOOST_AUTO_TEST_CASE(a_capacity_is_a_ceiling_and_tells_nothing_about_what_a_session_costs)
{
    for (int const capacity : {1, 8, 100, 1'000'000}) {
        Scheduler scheduler;
        scheduler.set_servers(named({"a"}));
        LoadReport report = counted(0, 0);
        report.capacity = capacity;
        scheduler.report("a", report, start);
        BOOST_TEST(scheduler.machines(start).front().cost == 12);
    }
}

BOOST_AUTO_TEST_CASE(forty_requests_are_shared_by_machines_of_equal_load_whatever_they_report)
{
    Scheduler scheduler;
    scheduler.set_servers(named({"counts", "bare"}));
    LoadReport report = counted(10, 0);
    report.capacity = 100;
    report.memory = 30;
    scheduler.report("counts", report, start);
    scheduler.report("bare", LoadReport(10), start);
    int counts = 0;
    for (int request = 0; request != 40; ++request)
        counts += scheduler.place(start).value().address == "counts";
    BOOST_TEST(std::abs(40 - 2 * counts) <= 4);
}

BOOST_AUTO_TEST_CASE(placements_that_nobody_claimed_teach_no_cost)
{
    for (bool const is_bare : {true, false}) {
        OneMachine fixture;
        RandomSource random(3);
        TimePoint now = start;
        for (int burst = 0; burst != 4; ++burst) {
            for (int poll = 0; poll != 36; ++poll, now += seconds(5)) {
                double const load = 10 + 2 * random.uniform();
                fixture.scheduler.report("a", is_bare ? LoadReport(load) : counted(load, 0), now);
                if (poll < 11)
                    fixture.place(30, now);
            }
            BOOST_TEST(fixture.machine("a", now).cost == 12, tolerance(0.02));
        }
    }
}

BOOST_AUTO_TEST_CASE(a_bare_number_teaches_the_cost_of_a_class_after_requests_that_nobody_claimed)
{
    OneMachine fixture;
    TimePoint now = start;
    int visible = 0;
    for (int poll = 0; poll != 100; ++poll, now += seconds(5)) {
        if (poll == 54)
            visible = 4; // placed four polls before
        fixture.scheduler.report("a", LoadReport(5 + 18 * visible), now);
        if (poll < 20)
            fixture.place(5, now);
        if (poll == 50)
            fixture.place(4, now);
    }
    BOOST_TEST(fixture.machine("a", now).cost > 12.5);
    BOOST_TEST(fixture.machine("a", now).cost < 20);
}

BOOST_AUTO_TEST_CASE(a_fall_that_no_departure_explains_teaches_no_cost)
{
    for (bool const is_bare : {true, false}) {
        OneMachine fixture;
        TimePoint now = start;
        fixture.place(4, now);
        auto const report = [&](double load, int sessions, int polls) {
            for (int poll = 0; poll != polls; ++poll)
                fixture.scheduler.report("a", is_bare ? LoadReport(load) : counted(load, sessions),
                                         now += seconds(5));
        };
        report(0, 0, 5);
        report(48, 4, 40);
        report(97, 4, 6); // another program uses the processor
        double const before = fixture.machine("a", now).cost;
        report(10, 4, 20); // it ends, and so does other load
        BOOST_TEST(fixture.machine("a", now).cost <= before * 1.01);
    }
}

BOOST_FIXTURE_TEST_CASE(an_unknown_session_keeps_off_small_machines, Fixture)
{
    scheduler.set_servers(named({"small", "big"}));
    teach(scheduler, "small", [](int sessions, int) { return each(24, sessions); });
    TimePoint now = teach(
        scheduler, "big", [](int sessions, int) { return each(3, sessions); }, start + seconds(3700));
    for (int poll = 0; poll != 12; ++poll) {
        now += seconds(5);
        scheduler.report("small", counted(20, 0), now);
        scheduler.report("big", counted(42, 0), now);
    }
    Candidate const small = machine("small", now);
    Candidate const big = machine("big", now);
    // On average the small one has more room, but a session may cost 50 % more.
    BOOST_TEST(small.committed + small.cost < big.committed + big.cost);
    BOOST_TEST(scheduler.place(now).value().address == "big");
}

BOOST_FIXTURE_TEST_CASE(what_a_machine_taught_survives_its_silence, OneMachine)
{
    auto const seated = [](int sessions, int) {
        LoadReport report = each(24, sessions);
        report.capacity = 19;
        return report;
    };
    TimePoint const now = teach(scheduler, "a", seated);
    scheduler.mark_unreachable("a", now);
    scheduler.report("a", seated(1, 0), now + seconds(20));
    BOOST_TEST(machine("a", now + seconds(20)).cost == 24, tolerance(0.1));
}

BOOST_FIXTURE_TEST_CASE(what_happened_while_a_machine_was_silent_teaches_nothing, OneMachine)
{
    auto const report = [this](int sessions, double memory, int time) {
        LoadReport told = counted(10, sessions);
        told.memory = memory;
        scheduler.report("a", told, start + seconds(time));
    };
    report(1, 10, 0);
    report(1, 10, 5);
    scheduler.mark_unreachable("a", start + seconds(10));
    report(4, 80, 15); // three sessions that cost no load and much memory, as if
    for (int time = 20; time <= 60; time += 5)
        report(4, 80, time);
    TimePoint const now = start + seconds(60);
    BOOST_TEST(machine("a", now).cost == 12, tolerance(0.01));
    place(4, now); // 2 % each: the fifth reaches 90 %
    BOOST_TEST(!machine("a", now).overcommitted);
    place(1, now);
    BOOST_TEST(machine("a", now).overcommitted);
}

BOOST_FIXTURE_TEST_CASE(a_machine_learns_how_much_memory_its_sessions_need, OneMachine)
{
    auto const needy = [](int sessions, int) {
        LoadReport report = each(1, sessions);
        report.memory = 56 + 10 * sessions;
        return report;
    };
    TimePoint const now = teach(scheduler, "a", needy); // ends at 66 %
    place(2, now);
    BOOST_TEST(!machine("a", now).overcommitted, "86 % are committed");
    place(1, now);
    BOOST_TEST(machine("a", now).overcommitted);
}

BOOST_FIXTURE_TEST_CASE(where_sessions_are_alike_nothing_is_added_for_their_differences, OneMachine)
{
    TimePoint const now = teach(scheduler, "a", [](int sessions, int) { return each(12, sessions); });
    BOOST_TEST(variety(machine("a", now)) < 0.35);
}

BOOST_FIXTURE_TEST_CASE(where_sessions_differ_the_score_is_more_careful, OneMachine)
{
    auto const unlike = [](int sessions, int time) {
        bool const heavy = time / 120 % 2 == 0;
        return counted(sessions == 1 ? 17 : heavy ? 65 : 17, sessions);
    };
    TimePoint const now = teach(scheduler, "a", unlike);
    BOOST_TEST(variety(machine("a", now)) > 0.6);
}

BOOST_FIXTURE_TEST_CASE(four_sessions_at_once_tell_the_variety_of_one, OneMachine)
{
    scheduler.report("a", counted(0, 0), start);
    scheduler.report("a", counted(24, 4), start + seconds(5));
    TimePoint const now = start + seconds(15);
    scheduler.report("a", counted(24, 4), now);
    // They missed 48 % by two sessions' worth: a mean square of 2 * 2 / 4 for each, one of fifty remembered.
    double const learned = std::sqrt(0.25 + (1 - 0.25) / 50);
    BOOST_TEST(variety(machine("a", now)) == learned, tolerance(0.01));
}

BOOST_FIXTURE_TEST_CASE(sessions_that_show_in_part_tell_nothing_about_variety, OneMachine)
{
    TimePoint now = start;
    int sessions = 0;
    for (int round = 0; round != 6; ++round) { // the next comes before the last can be seen alone
        ++sessions;
        scheduler.report("a", counted(12 * sessions - 6, sessions), now += seconds(5));
        scheduler.report("a", counted(12 * sessions, sessions), now += seconds(5));
    }
    BOOST_TEST(variety(machine("a", now)) == 0.5, tolerance(1e-9));
}

BOOST_AUTO_TEST_CASE(bare_numbers_tell_how_sessions_differ_too)
{
    Scheduler scheduler;
    scheduler.set_servers(named({"a"}));
    scheduler.report("a", LoadReport(0), start);
    (void)scheduler.place(start);
    for (int const time : {5, 15})
        scheduler.report("a", LoadReport(48), start + seconds(time));
    // One session of four times the cost that was expected: a square of nine, one of fifty remembered.
    double const learned = std::sqrt(0.25 + (9 - 0.25) / 50);
    BOOST_TEST(variety(scheduler.machines(start + seconds(15)).front()) == learned, tolerance(0.1));
}

// A bare number does not show sessions that came and left between two reports, nor those that cost little.
BOOST_AUTO_TEST_CASE(no_shows_of_machines_that_report_a_bare_number_say_nothing_about_anybody)
{
    Scheduler scheduler;
    scheduler.set_servers(named({"bare", "counts"}));
    TimePoint now = start;
    for (int round = 0; round != 30; ++round) {
        scheduler.report("bare", LoadReport(0), now);
        scheduler.mark_unreachable("counts", now);
        scheduler.place(now).value();
        now += seconds(70);
        scheduler.report("bare", LoadReport(0), now); // nobody came
    }
    scheduler.place(now).value();
    Candidate const bare = scheduler.machines(now).front();
    BOOST_TEST(bare.committed == bare.cost, tolerance(1e-9));
    scheduler.report("counts", counted(0, 0), now);
    scheduler.mark_unreachable("bare", now);
    scheduler.place(now).value();
    Candidate const counts = scheduler.machines(now).back();
    BOOST_TEST(counts.committed == counts.cost, tolerance(1e-9));
}

BOOST_AUTO_TEST_CASE(others_who_stop_placing_are_forgotten)
{
    SchedulerParams params;
    params.session_cost = 0.1;
    auto scheduler = Scheduler::make(params).value();
    scheduler.set_servers(named({"a"}));
    TimePoint now = start;
    int sessions = 0;
    auto const unseen = [&] {
        return scheduler.explain(scheduler.place(now).value().decision)->unseen_arrivals;
    };
    for (int report = 0; report != 12; ++report)
        scheduler.report("a", counted(0, sessions += 2), now += seconds(5));
    BOOST_TEST(unseen() > 1);
    for (int report = 0; report != 60; ++report)
        scheduler.report("a", counted(0, sessions), now += seconds(5));
    BOOST_TEST(unseen() < 0.1);
}

BOOST_AUTO_TEST_SUITE_END()
