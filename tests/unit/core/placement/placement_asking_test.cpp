// Whom to ask before placing, where other session servers place on the same machines.
#include "placement_fixture.hpp"

#include <algorithm>

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(placement_asking)

namespace {

constexpr auto fresh = 100ms;

/// A site where somebody else has placed a session on each machine, five seconds ago.
struct Shared : Fixture
{
    explicit Shared(std::initializer_list<char const*> names = {"a", "b", "c", "d", "e"}) : Fixture({}, names)
    {
        for (char const* const name : names)
            scheduler.report(name, counted(0, 1, 1), start + 5s);
    }

    std::vector<std::string_view> worth_asking(TimePoint now) const
    {
        return scheduler.worth_asking(request_of(now), now);
    }

    static PlacementRequest request_of(TimePoint now)
    {
        PlacementRequest request;
        request.current_since = now - fresh;
        return request;
    }

    TimePoint const now = start + 8s;
};

} // namespace

BOOST_AUTO_TEST_CASE(where_nobody_else_places_nobody_is_asked)
{
    Fixture fixture;
    (void)fixture.place(3);
    for (auto const* const name : {"a", "b", "c"})
        fixture.scheduler.report(name, counted(0, 1, 1), start + 5s); // they are ours
    BOOST_TEST(fixture.scheduler.worth_asking(Shared::request_of(start + 8s), start + 8s).empty());
}

BOOST_AUTO_TEST_CASE(where_others_place_the_three_best_machines_are_asked_the_best_one_first)
{
    Shared shared;
    shared.scheduler.report("c", counted(0, 0), start + 5s);
    shared.scheduler.report("a", counted(0, 2, 2), start + 5s);
    auto const asked = shared.worth_asking(shared.now);
    BOOST_TEST_REQUIRE(asked.size() == 3u);
    BOOST_TEST(asked.front() == "c");
    BOOST_TEST((std::ranges::find(asked, "a") == asked.end()));
}

BOOST_AUTO_TEST_CASE(a_day_after_the_last_session_of_others_nobody_is_asked)
{
    Shared shared;
    TimePoint now = start + 5s;
    auto const poll_until = [&](TimePoint end) {
        for (; now < end; now += 5s)
            for (auto const* const name : {"a", "b", "c", "d", "e"})
                shared.scheduler.report(name, counted(0, 1, 0), now);
    };
    poll_until(start + 24h);
    BOOST_TEST(!shared.worth_asking(now).empty());
    poll_until(start + 24h + 10s);
    BOOST_TEST(shared.worth_asking(now).empty());
}

BOOST_AUTO_TEST_CASE(a_machine_that_has_just_reported_is_not_asked_and_none_is_where_that_is_the_best)
{
    Shared shared;
    shared.scheduler.report("a", counted(0, 2, 2), shared.now);
    shared.scheduler.report("b", counted(0, 2, 2), shared.now);
    BOOST_TEST(shared.worth_asking(shared.now).size() == 3u); // c, d and e
    shared.scheduler.report("c", counted(0, 0), shared.now);
    BOOST_TEST(shared.worth_asking(shared.now).empty());
    BOOST_TEST(shared.worth_asking(shared.now + fresh).empty());
    BOOST_TEST(!shared.worth_asking(shared.now + fresh + 1ms).empty());
}

BOOST_AUTO_TEST_CASE(machines_that_report_a_bare_number_have_nothing_to_say)
{
    Shared shared;
    for (auto const* const name : {"a", "b", "c", "d", "e"})
        shared.scheduler.report(name, LoadReport(1), start + 6s);
    BOOST_TEST(shared.worth_asking(shared.now).empty());
}

BOOST_AUTO_TEST_CASE(machines_that_do_not_come_into_question_are_not_asked)
{
    Shared shared({"a", "b", "c"});
    auto request = Shared::request_of(shared.now);
    request.excluded = {"b", "c"};
    auto const asked = shared.scheduler.worth_asking(request, shared.now);
    BOOST_TEST(asked == std::vector<std::string_view>{"a"}, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(who_has_asked_goes_to_the_best_machine_and_who_has_not_spreads)
{
    Shared shared;
    TimePoint now = shared.now;
    for (int others = 2; others != 12; ++others, now += 5s) // two each second, on five machines
        for (auto const* const name : {"a", "b", "c", "d", "e"})
            shared.scheduler.report(name, counted(0, 2 * others, 2), now);
    shared.scheduler.report("c", counted(0, 20, 0), now);
    auto const place = [&](PlacementRequest const& request) {
        auto const placement = shared.scheduler.place(request, now).value();
        auto const decision = shared.scheduler.explain(placement.decision).value();
        shared.scheduler.release(placement, now);
        BOOST_TEST(shared.scheduler.replay(decision).value() == placement.address);
        return decision;
    };
    BOOST_TEST(place({}).unseen_arrivals > 1);
    auto const asked = place(Shared::request_of(now));
    BOOST_TEST(asked.unseen_arrivals == 0);
    BOOST_TEST(asked.least_committed.has_value());
}

BOOST_AUTO_TEST_SUITE_END()
