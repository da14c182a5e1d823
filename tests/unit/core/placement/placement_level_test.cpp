// The load that the scheduler assumes of a machine: what it reported, and what was placed there since.
#include "placement_fixture.hpp"

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using boost::test_tools::tolerance;
using std::chrono::seconds;

BOOST_AUTO_TEST_SUITE(placement_level)

namespace {

/// One machine that has not reported yet; `after` is the load that the scheduler assumes after a report.
struct Level : Fixture
{
    Level() : Fixture({}, {}) { scheduler.set_servers(named({"a"})); }

    double after(LoadReport const& report, int time)
    {
        scheduler.report("a", report, start + seconds(time));
        return machine("a", start + seconds(time)).committed;
    }
};

/// The same for a machine that reports a bare number.
struct BareLevel : Level
{
    double after(double load, int time) { return Level::after(LoadReport(load), time); }
};

} // namespace

BOOST_FIXTURE_TEST_CASE(small_differences_are_noise_and_smoothed, Level)
{
    after(counted(20, 0), 0);
    BOOST_TEST(after(counted(26, 0), 5) == 21.8, tolerance(1e-9));
}

BOOST_FIXTURE_TEST_CASE(more_than_a_sessions_worth_is_believed_at_once, Level)
{
    after(counted(20, 0), 0);
    BOOST_TEST(after(counted(60, 0), 5) == 60, tolerance(1e-9));
    BOOST_TEST(after(counted(10, 0), 10) == 10, tolerance(1e-9));
}

BOOST_FIXTURE_TEST_CASE(reports_that_show_a_new_session_in_part_do_not_lower_its_share, Level)
{
    after(counted(20, 0), 0);
    BOOST_TEST(after(counted(23, 1), 5) == 32, tolerance(1e-9));
    BOOST_TEST(after(counted(27, 1), 10) == 32, tolerance(1e-9));
    // From now on the mean of five samples shows the session fully, so this difference is learned from.
    BOOST_TEST(after(counted(27, 1), 15) == 30.5, tolerance(1e-9));
}

BOOST_FIXTURE_TEST_CASE(reports_that_show_an_ended_session_in_part_do_not_raise_the_level, Level)
{
    after(counted(32, 1), 0);
    BOOST_TEST(after(counted(29, 0), 5) == 20, tolerance(1e-9));
    BOOST_TEST(after(counted(20, 0), 10) == 20, tolerance(1e-9));
}

BOOST_FIXTURE_TEST_CASE(beyond_what_a_new_session_explains_reports_are_believed, Level)
{
    after(counted(20, 0), 0);
    BOOST_TEST(after(counted(60, 1), 5) == 60, tolerance(1e-9));
}

BOOST_FIXTURE_TEST_CASE(a_fall_below_what_was_there_before_a_new_session_is_believed, Level)
{
    after(counted(60, 0), 0);
    after(counted(60, 1), 5);
    BOOST_TEST(after(counted(30, 1), 10) == 72 - 30, tolerance(1e-9));
}

BOOST_FIXTURE_TEST_CASE(a_report_of_more_starts_than_sessions_counts_as_none_visible, Level)
{
    after(counted(0, 1, 5), 0);
    BOOST_TEST(after(counted(12, 1, 0), 5) == 12, tolerance(1e-9));
}

BOOST_FIXTURE_TEST_CASE(departures_never_leave_less_than_nothing, Level)
{
    after(counted(0, 4), 0);
    BOOST_TEST(after(counted(0, 0), 5) == 0);
    BOOST_TEST(machine("a", start + seconds(5)).score == 0);
}

BOOST_FIXTURE_TEST_CASE(a_rise_of_a_bare_number_is_explained_by_what_was_placed, BareLevel)
{
    after(5, 0);
    place(1);
    BOOST_TEST(after(12, 20) == 17, tolerance(1e-9));
    BOOST_TEST(machine("a", start + seconds(20)).pending == 0);
    // The mean may still show only a part of the session.
    BOOST_TEST(after(14, 25) == 17, tolerance(1e-9));
}

BOOST_FIXTURE_TEST_CASE(a_bare_number_that_falls_confirms_nothing, BareLevel)
{
    after(60, 0);
    place(2);
    after(10, 5);
    BOOST_TEST(machine("a", start + seconds(5)).pending == 2);
}

BOOST_FIXTURE_TEST_CASE(a_machine_that_begins_to_count_its_sessions_is_not_compared_with_before, BareLevel)
{
    after(60, 0);
    place(1);
    Level::after(counted(60, 5), 5);
    BOOST_TEST(machine("a", start + seconds(5)).pending == 1, "none of the five is known to be new");
    std::uint64_t const next = scheduler.place(start + seconds(5)).value().decision;
    BOOST_TEST(scheduler.explain(next)->unseen_arrivals == 0);
}

BOOST_FIXTURE_TEST_CASE(the_score_is_the_load_with_one_session_more_and_what_the_unseen_may_differ,
                        OneMachine)
{
    // 12 % a session, and half of that its standard deviation before anything was learned.
    BOOST_TEST(machine("a").score == 12 + 6, tolerance(1e-9));
    place(3);
    BOOST_TEST(machine("a").score == 4 * 12 + 2 * 6, tolerance(1e-9));
    scheduler.report("a", counted(0, 3, 3), start);
    BOOST_TEST(machine("a").score == 4 * 12 + 2 * 6, tolerance(1e-9));
}

BOOST_AUTO_TEST_SUITE_END()
