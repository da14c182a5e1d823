// Seats that are held, and how many are free.
#include "placement_fixture.hpp"

#include <boost/json.hpp>

#include <limits>

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using std::chrono::seconds;

BOOST_AUTO_TEST_SUITE(placement_held)

namespace {

LoadReport seated(int capacity, int sessions = 0, double load = 0)
{
    LoadReport report = counted(load, sessions);
    report.capacity = capacity;
    return report;
}

/// Two machines with four seats each.
struct Seats : Fixture
{
    Seats() : Fixture({}, {"a", "b"})
    {
        scheduler.report("a", seated(4), start);
        scheduler.report("b", seated(4), start);
    }
};

} // namespace

BOOST_FIXTURE_TEST_CASE(free_seats_are_the_capacity_less_sessions_and_placements, Seats)
{
    BOOST_TEST(scheduler.free_seats(start) == 8u);
    place(3);
    BOOST_TEST(scheduler.free_seats(start) == 5u);
    scheduler.report("a", seated(4, 3), start + seconds(5));
    scheduler.report("b", seated(4, 1), start + seconds(5));
    BOOST_TEST(scheduler.free_seats(start + seconds(5)) == 4u);
}

BOOST_FIXTURE_TEST_CASE(a_machine_that_is_not_offered_has_no_free_seats, Seats)
{
    scheduler.mark_unreachable("a", start);
    BOOST_TEST(scheduler.free_seats(start) == 4u);
    BOOST_TEST(scheduler.free_seats(start + seconds(60)) == 0u, "reports that are too old");
    scheduler.set_servers({});
    BOOST_TEST(scheduler.free_seats(start) == 0u);
}

BOOST_FIXTURE_TEST_CASE(a_machine_without_a_capacity_has_room_for_what_its_load_leaves, OneMachine)
{
    scheduler.report("a", LoadReport(35), start);
    BOOST_TEST(scheduler.free_seats(start) == 5u); // 95 % less 35 %, of 12 % each
    place(5);
    BOOST_TEST(scheduler.free_seats(start) == 1u, "an assumed cost fills no machine");
    scheduler.hold(1);
    BOOST_TEST(!scheduler.available(start), "but the estimate keeps seats for a class");
}

BOOST_AUTO_TEST_CASE(seats_are_free_exactly_while_somebody_who_can_wait_is_placed)
{
    PlacementRequest patient;
    patient.only_free = true;
    auto const fill = [&](Scheduler& scheduler, TimePoint now) { // with 50 at most
        int placed = 0;
        for (; placed < 50; ++placed) {
            bool const is_free = scheduler.free_seats(now) > 0;
            BOOST_TEST(scheduler.place(patient, now).has_value() == is_free);
            if (!is_free)
                break;
        }
        return placed;
    };
    Seats seats;
    BOOST_TEST(fill(seats.scheduler, start) == 8);
    OneMachine untaught;
    untaught.scheduler.report("a", LoadReport(35), start);
    BOOST_TEST(fill(untaught.scheduler, start) == 50, "nothing is known that would fill it");
    OneMachine taught;
    TimePoint const now = taught.teach_cost() + seconds(5);
    taught.scheduler.report("a", seated(100, 4, 48), now);
    int const placed = fill(taught.scheduler, now);
    BOOST_TEST(placed >= 3);
    BOOST_TEST(placed <= 5);
}

BOOST_FIXTURE_TEST_CASE(a_generous_capacity_counts_until_the_cost_of_sessions_is_known, OneMachine)
{
    scheduler.report("a", seated(100), start);
    BOOST_TEST(scheduler.free_seats(start) == 100u);
    TimePoint const now = teach_cost() + seconds(5);
    scheduler.report("a", seated(100, 4, 48), now);
    BOOST_TEST(scheduler.free_seats(now) >= 3u);
    BOOST_TEST(scheduler.free_seats(now) <= 4u);
}

BOOST_FIXTURE_TEST_CASE(absurd_capacities_of_a_whole_fleet_are_still_a_number, Fixture)
{
    for (char const* const name : {"a", "b", "c"})
        scheduler.report(name, seated(std::numeric_limits<int>::max()), start);
    BOOST_TEST(scheduler.free_seats(start) == 3'000'000u);
    scheduler.hold(std::numeric_limits<std::size_t>::max());
    BOOST_TEST(!scheduler.available(start));
}

BOOST_FIXTURE_TEST_CASE(held_seats_are_for_those_they_are_held_for, Seats)
{
    scheduler.hold(6);
    BOOST_TEST(scheduler.available(start));
    place(2);
    BOOST_TEST(!scheduler.available(start));
    auto const refused = scheduler.place(start);
    BOOST_REQUIRE(refused.has_error());
    BOOST_TEST((refused.error() == errc::unavailable));
    BOOST_TEST(refused.error().detail() == "no simulation server available at the moment.");
    for (std::size_t held = 6; held-- != 0;) {
        BOOST_TEST(scheduler.place_held(start).has_value());
        scheduler.hold(held);
        BOOST_TEST(scheduler.available(start) == (held == 0), held << " are held");
    }
    BOOST_TEST(scheduler.placed("a") == 4u);
    BOOST_TEST(scheduler.placed("b") == 4u);
}

BOOST_FIXTURE_TEST_CASE(a_seat_that_becomes_free_is_for_others_again_once_enough_are_held, Seats)
{
    scheduler.report("a", seated(4, 4), start);
    scheduler.hold(4);
    BOOST_TEST(!scheduler.available(start));
    scheduler.report("a", seated(4, 3), start + seconds(5));
    BOOST_TEST(scheduler.available(start + seconds(5)));
    BOOST_TEST(scheduler.place(start + seconds(5)).has_value());
    BOOST_TEST(scheduler.place(start + seconds(5)).has_error());
}

BOOST_FIXTURE_TEST_CASE(who_has_a_held_seat_is_refused_only_where_no_machine_is_offered, Seats)
{
    for (int student = 0; student != 9; ++student)
        BOOST_TEST(scheduler.place_held(start).has_value(), "the machine itself says when it is full");
    scheduler.report("a", seated(4, 4), start + seconds(5));
    scheduler.report("b", seated(4, 4), start + seconds(5));
    auto const refused = scheduler.place_held(start + seconds(5));
    BOOST_REQUIRE(refused.has_error());
    BOOST_TEST(refused.error().detail() == "no simulation server available at the moment.");
}

BOOST_FIXTURE_TEST_CASE(a_decision_says_that_all_free_seats_were_held, Seats)
{
    scheduler.hold(8);
    (void)scheduler.place(start);
    Decision const decision = scheduler.decisions().back();
    BOOST_TEST(decision.chosen.empty());
    BOOST_TEST(decision.offered == 2u);
    BOOST_TEST(decision.held == 8u);
    BOOST_TEST(decision.free_seats == 8u);
    BOOST_TEST((scheduler.replay(decision).error() == errc::unavailable));
    auto const json = boost::json::parse(decisions_json(scheduler, start));
    BOOST_TEST(json.at("decisions").at(0).at("held").to_number<int>() == 8);
    BOOST_TEST(json.at("decisions").at(0).at("freeSeats").to_number<int>() == 8);

    (void)scheduler.place_held(start);
    BOOST_TEST(scheduler.decisions().back().held == 0u);
    BOOST_TEST(scheduler.replay(scheduler.decisions().back()).value() == scheduler.decisions().back().chosen);
}

BOOST_AUTO_TEST_SUITE_END()
