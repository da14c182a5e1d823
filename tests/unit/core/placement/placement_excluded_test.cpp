// Machines that a caller does not want, and callers who can wait.
#include "placement_fixture.hpp"

#include <boost/json.hpp>

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using std::chrono::seconds;

BOOST_AUTO_TEST_SUITE(placement_excluded)

namespace {

PlacementRequest without(std::vector<std::string> excluded)
{
    PlacementRequest request;
    request.excluded = std::move(excluded);
    return request;
}

PlacementRequest patient(std::vector<std::string> excluded = {})
{
    PlacementRequest request = without(std::move(excluded));
    request.only_free = true;
    return request;
}

LoadReport seated(int capacity, int sessions = 0)
{
    LoadReport report = counted(0, sessions);
    report.capacity = capacity;
    return report;
}

/// Three machines of two seats each.
struct Seats : Fixture
{
    Seats()
    {
        for (char const* const name : {"a", "b", "c"})
            scheduler.report(name, seated(2), start);
    }

    std::string place(PlacementRequest const& request, TimePoint now = start)
    {
        auto const placement = scheduler.place(request, now);
        if (!placement)
            return placement.error() == errc::unavailable ? "" : placement.error().message();
        return std::string(placement->address);
    }
};

} // namespace

BOOST_FIXTURE_TEST_CASE(nobody_goes_to_a_machine_that_is_excluded, Seats)
{
    for (int session = 0; session != 10; ++session)
        BOOST_TEST(place(without({"a", "c"})) == "b");
    BOOST_TEST(place(without({"a", "b", "c"})) == "");
    BOOST_TEST(place(without({"nobody", "b", "a"})) == "c");
}

BOOST_FIXTURE_TEST_CASE(the_others_are_served_as_evenly_as_ever, Seats)
{
    std::map<std::string, int> placed;
    for (int session = 0; session != 4; ++session)
        ++placed[place(without({"b"}))];
    BOOST_TEST((placed == std::map<std::string, int>{{"a", 2}, {"c", 2}}));
}

BOOST_FIXTURE_TEST_CASE(a_decision_says_who_was_excluded_and_can_be_replayed, Seats)
{
    auto const placement = scheduler.place(without({"a", "c"}), start).value();
    Decision const decision = scheduler.explain(placement.decision).value();
    BOOST_TEST(decision.offered == 1u);
    BOOST_TEST(decision.refused[static_cast<std::size_t>(Refusal::excluded)] == 2u);
    BOOST_TEST((decision.machines[0].machine.refusal == Refusal::excluded));
    BOOST_TEST((decision.machines[1].machine.refusal == Refusal::none));
    BOOST_TEST(scheduler.replay(decision).value() == "b");
    auto const json = boost::json::parse(decisions_json(scheduler, start));
    BOOST_TEST(json.at("decisions").at(0).at("refused").at("excluded").to_number<int>() == 2);
    BOOST_TEST(json.at("decisions").at(0).at("machines").at(0).at("refused") == "excluded");
    for (Candidate const& machine : scheduler.machines(start))
        BOOST_TEST((machine.refusal == Refusal::none));
}

BOOST_FIXTURE_TEST_CASE(a_machine_that_is_refused_anyway_keeps_its_reason, Seats)
{
    scheduler.mark_unreachable("a", start);
    auto const placement = scheduler.place(without({"a", "b"}), start).value();
    Decision const decision = scheduler.explain(placement.decision).value();
    BOOST_TEST((decision.machines[0].machine.refusal == Refusal::lost));
    BOOST_TEST(decision.refused[static_cast<std::size_t>(Refusal::excluded)] == 1u);
}

BOOST_FIXTURE_TEST_CASE(waiting_may_help_where_the_only_machine_with_a_label_is_excluded, Seats)
{
    auto servers = named({"a", "b", "c"});
    servers[0].labels = {"gpu"};
    scheduler.set_servers(servers);
    PlacementRequest request = without({"a"});
    request.labels = {"gpu"};
    BOOST_TEST((scheduler.place(request, start).error() == errc::unavailable));
    request.labels = {"docker"};
    BOOST_TEST((scheduler.place(request, start).error() == errc::refused));
}

BOOST_FIXTURE_TEST_CASE(who_can_wait_is_not_sent_to_a_machine_that_placements_fill, Seats)
{
    for (int session = 0; session != 6; ++session)
        BOOST_TEST(place(patient()) != "");
    BOOST_TEST(place(patient()) == "");
    BOOST_TEST(place(PlacementRequest()) != "", "who can't wait goes to the least bad one");
}

BOOST_FIXTURE_TEST_CASE(who_can_wait_gets_a_seat_as_soon_as_one_is_free, Seats)
{
    std::vector<Placement> placed;
    for (int session = 0; session != 6; ++session)
        placed.push_back(scheduler.place(patient(), start).value());
    scheduler.release(placed[3], start);
    BOOST_TEST(place(patient()) == placed[3].address);
    BOOST_TEST(place(patient()) == "");
    TimePoint const now = start + seconds(5);
    for (char const* const name : {"a", "b", "c"})
        scheduler.report(name, seated(2, 2), now);
    BOOST_TEST(place(patient(), now) == "");
    scheduler.report("b", seated(2, 1), now + seconds(5));
    BOOST_TEST(place(patient(), now + seconds(5)) == "b");
}

BOOST_FIXTURE_TEST_CASE(a_free_seat_on_an_excluded_machine_is_none, Seats)
{
    for (int session = 0; session != 4; ++session)
        BOOST_TEST(place(patient({"b"})) != "");
    BOOST_TEST(place(patient({"b"})) == "");
    BOOST_TEST(place(patient()) == "b");
}

BOOST_FIXTURE_TEST_CASE(where_nothing_is_free_the_decision_says_who_is_overcommitted, Seats)
{
    for (int session = 0; session != 6; ++session)
        place(patient());
    BOOST_TEST(place(patient()) == "");
    Decision const decision = scheduler.decisions().back();
    BOOST_TEST(decision.chosen == "");
    BOOST_TEST(decision.offered == 0u);
    for (Decision::Entry const& entry : decision.machines)
        BOOST_TEST(entry.machine.overcommitted);
}

BOOST_AUTO_TEST_SUITE_END()
