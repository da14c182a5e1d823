// Sessions that not every machine can run.
#include "placement_fixture.hpp"

#include <boost/json.hpp>

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using std::chrono::seconds;

BOOST_AUTO_TEST_SUITE(placement_labels)

namespace {

PlacementRequest needing(std::vector<std::string> labels)
{
    PlacementRequest request;
    request.labels = std::move(labels);
    return request;
}

LoadReport labelled(double load, std::vector<std::string> labels)
{
    LoadReport report = counted(load, 0);
    report.labels = std::move(labels);
    return report;
}

/// The operator calls `b` and `c` gpu; `c` says that it has R2025a, and is the busiest.
struct Labelled : Fixture
{
    Labelled()
    {
        auto servers = named({"a", "b", "c"});
        servers[1].labels = servers[2].labels = {"gpu"};
        scheduler.set_servers(servers);
        scheduler.report("b", labelled(10, {}), start);
        scheduler.report("c", labelled(50, {"R2025a"}), start);
    }

    std::string place(std::vector<std::string> labels)
    {
        return std::string(scheduler.place(needing(std::move(labels)), start).value().address);
    }
};

} // namespace

BOOST_FIXTURE_TEST_CASE(a_session_goes_only_where_all_of_its_labels_are, Labelled)
{
    BOOST_TEST(place({"R2025a"}) == "c");
    BOOST_TEST(place({"gpu", "R2025a"}) == "c");
    BOOST_TEST(place({"gpu"}) == "b");
    BOOST_TEST(place({}) == "a");
}

BOOST_FIXTURE_TEST_CASE(among_those_the_policy_decides_as_ever, Labelled)
{
    std::map<std::string, int> placed;
    for (int session = 0; session != 8; ++session)
        ++placed[place({"gpu"})];
    // 10 % and 50 %: three sessions of 12 % make them about equal, then they are served in turn
    BOOST_TEST(placed["b"] == 6);
    BOOST_TEST(placed["c"] == 2);
}

BOOST_AUTO_TEST_CASE(every_policy_is_given_only_those)
{
    for (char const* const policy : {"least_committed", "least_reported", "random", "power_of_two"}) {
        SchedulerParams params;
        params.policy = policy;
        Fixture fixture(params);
        for (char const* const name : {"b", "c"})
            fixture.scheduler.report(name, labelled(30, {"gpu"}), start);
        for (int session = 0; session != 20; ++session) {
            auto const placement = fixture.scheduler.place(needing({"gpu"}), start);
            BOOST_TEST(placement.value().address != "a", policy);
            Decision const decision = fixture.scheduler.explain(placement->decision).value();
            BOOST_TEST(fixture.scheduler.replay(decision).value() == decision.chosen, policy);
        }
    }
}

BOOST_AUTO_TEST_CASE(others_sessions_are_spread_over_those_alone)
{
    Fixture fixture({}, {"a", "b", "c"});
    TimePoint now = start;
    for (int round = 1; round != 20; ++round) {
        now += seconds(5);
        for (char const* const name : {"a", "b", "c"})
            fixture.scheduler.report(name, counted(0, 20 * round), now); // all of them placed by others
    }
    for (char const* const name : {"b", "c"}) {
        LoadReport report = counted(0, 400);
        report.labels = {"gpu"};
        fixture.scheduler.report(name, report, now);
    }
    for (int session = 0; session != 20; ++session) {
        auto const placement = fixture.scheduler.place(needing({"gpu"}), now);
        BOOST_TEST(placement.value().address != "a");
        Decision const decision = fixture.scheduler.explain(placement->decision).value();
        BOOST_TEST(decision.unseen_arrivals > 0);
        BOOST_TEST(fixture.scheduler.replay(decision).value() == decision.chosen);
    }
}

BOOST_FIXTURE_TEST_CASE(one_that_is_busy_is_worth_waiting_for, Labelled)
{
    scheduler.report("c", labelled(97, {"R2025a"}), start);
    auto const refused = scheduler.place(needing({"R2025a"}), start);
    BOOST_REQUIRE(refused.has_error());
    BOOST_TEST((refused.error() == errc::unavailable));
    BOOST_TEST(refused.error().detail() == "no simulation server available at the moment.");
    scheduler.mark_unreachable("c", start);
    BOOST_TEST((scheduler.place(needing({"R2025a"}), start).error() == errc::unavailable));
}

BOOST_FIXTURE_TEST_CASE(what_no_machine_can_run_is_refused_with_a_sentence_that_says_so, Labelled)
{
    auto const one = scheduler.place(needing({"R2019a"}), start);
    BOOST_REQUIRE(one.has_error());
    BOOST_TEST((one.error() == errc::refused));
    BOOST_TEST(one.error().detail() ==
               "no simulation server of this site can run this: none has the label \"R2019a\".");
    BOOST_TEST(
        scheduler.place(needing({"gpu", "R2019a"}), start).error().detail() ==
        "no simulation server of this site can run this: none has all of the labels \"gpu\", \"R2019a\".");
    BOOST_TEST(scheduler.available(start));
}

BOOST_AUTO_TEST_CASE(a_machine_that_has_not_reported_yet_may_have_any_label)
{
    Scheduler scheduler;
    scheduler.set_servers(named({"a"}));
    BOOST_TEST((scheduler.place(needing({"gpu"}), start).error() == errc::unavailable));
    scheduler.report("a", labelled(0, {"gpu"}), start);
    BOOST_TEST(scheduler.place(needing({"gpu"}), start).value().address == "a");
    scheduler.report("a", counted(0, 0), start);
    BOOST_TEST((scheduler.place(needing({"gpu"}), start).error() == errc::refused));
}

BOOST_FIXTURE_TEST_CASE(labels_that_are_none_are_an_error_of_the_caller, Labelled)
{
    for (auto const& labels : {std::vector<std::string>{""},
                               {"two words"},
                               {"\n"},
                               {std::string(41, 'a')},
                               std::vector<std::string>(33, "gpu")})
        BOOST_TEST((scheduler.place(needing(labels), start).error() == errc::invalid_argument));
    BOOST_TEST((scheduler.place(needing({std::string(40, 'a')}), start).error() == errc::refused));
}

BOOST_FIXTURE_TEST_CASE(a_decision_says_who_lacks_a_label, Labelled)
{
    auto const placement = scheduler.place(needing({"R2025a"}), start);
    Decision const decision = scheduler.explain(placement->decision).value();
    BOOST_TEST(decision.offered == 1u);
    BOOST_TEST(decision.refused[static_cast<std::size_t>(Refusal::labels)] == 2u);
    BOOST_TEST((decision.machines[0].machine.refusal == Refusal::labels));
    BOOST_TEST((decision.machines[2].machine.refusal == Refusal::none));
    auto const json = boost::json::parse(decisions_json(scheduler, start));
    BOOST_TEST(json.at("decisions").at(0).at("refused").at("labels").to_number<int>() == 2);
    for (Candidate const& machine : scheduler.machines(start))
        BOOST_TEST((machine.refusal == Refusal::none));
}

BOOST_FIXTURE_TEST_CASE(held_seats_are_kept_from_sessions_with_labels_too, Labelled)
{
    scheduler.hold(1000);
    BOOST_TEST((scheduler.place(needing({"gpu"}), start).error() == errc::unavailable));
    PlacementRequest request = needing({"gpu"});
    request.held = true;
    BOOST_TEST(scheduler.place(request, start).value().address == "b");
}

BOOST_FIXTURE_TEST_CASE(of_machines_that_placements_would_fill_one_with_room_comes_first, Labelled)
{
    LoadReport small = labelled(0, {});
    small.capacity = 1;
    scheduler.report("b", small, start);
    BOOST_TEST(place({"gpu"}) == "b");
    BOOST_TEST(place({"gpu"}) == "c");
    scheduler.mark_unreachable("c", start);
    BOOST_TEST(place({"gpu"}) == "b", "nobody else is left");
}

BOOST_AUTO_TEST_SUITE_END()
