// Of machines that are about equally good, one that has the project in its cache.
#include "placement_fixture.hpp"

#include <boost/json.hpp>

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using std::chrono::seconds;

BOOST_AUTO_TEST_SUITE(placement_warm)

namespace {

constexpr std::string_view world = "https://github.com/o/r/blob/main/worlds/w.wbt";

PlacementRequest of(std::string_view address)
{
    PlacementRequest request;
    request.world = address;
    request.mode = "mjpeg";
    return request;
}

/// Three machines where a session costs 12 %; `b` has the project.
struct Warm : Fixture
{
    Warm() { report("b", 0, {project_key("https://elsewhere.org/o/r", "main"), project_key(world)}); }

    void report(char const* name, double load, std::vector<std::uint32_t> projects = {})
    {
        LoadReport report = counted(load, 0);
        report.projects = std::move(projects);
        scheduler.report(name, report, start);
    }
    std::string place(PlacementRequest const& request = of(world))
    {
        auto const placement = scheduler.place(request, start).value();
        scheduler.release(placement, start);
        return std::string(placement.address);
    }
    Decision last() const { return scheduler.decisions().back(); }
};

} // namespace

BOOST_FIXTURE_TEST_CASE(of_equal_machines_the_one_that_has_the_project_is_chosen, Warm)
{
    for (int session = 0; session != 5; ++session)
        BOOST_TEST(place() == "b");
    BOOST_TEST(place(of("https://github.com/o/r/tree/main/worlds/other.wbt")) == "b");
    std::map<std::string, int> elsewhere;
    for (int session = 0; session != 6; ++session)
        ++elsewhere[place(of("https://github.com/o/s/blob/main/worlds/w.wbt"))];
    BOOST_TEST(elsewhere.size() == 3u, "nobody has that one");
}

BOOST_FIXTURE_TEST_CASE(it_is_not_chosen_when_it_is_worse_by_more_than_half_a_session, Warm)
{
    scheduler.mark_unreachable("c", start);
    // What differs by more than a session from the last report is believed at once.
    report("a", 20);
    report("b", 25, {project_key(world)});
    BOOST_TEST(place() == "b");
    report("b", 40, {project_key(world)});
    report("b", 27, {project_key(world)});
    BOOST_TEST(place() == "a");
}

BOOST_FIXTURE_TEST_CASE(a_class_of_one_project_is_spread_as_evenly_as_ever, Warm)
{
    std::map<std::string, int> placed;
    for (int session = 0; session != 9; ++session)
        ++placed[std::string(scheduler.place(of(world), start)->address)];
    BOOST_TEST((placed == std::map<std::string, int>{{"a", 3}, {"b", 3}, {"c", 3}}));
}

BOOST_FIXTURE_TEST_CASE(what_the_last_report_does_not_name_any_more_is_gone, Warm)
{
    report("b", 0, {});
    report("c", 0, {project_key(world)});
    for (int session = 0; session != 3; ++session)
        BOOST_TEST(place() == "c");
}

BOOST_FIXTURE_TEST_CASE(a_decision_says_who_has_the_project_and_can_be_replayed, Warm)
{
    BOOST_TEST(place() == "b");
    BOOST_TEST(!last().machines[0].machine.warm);
    BOOST_TEST(last().machines[1].machine.warm);
    BOOST_TEST(last().machines[1].machine.score < last().machines[0].machine.score);
    BOOST_TEST(scheduler.replay(last()).value() == "b");
    auto const json = boost::json::parse(decisions_json(scheduler, start));
    auto const& machines = json.at("decisions").at(0).at("machines").as_array();
    BOOST_TEST(machines[1].at("warm").as_bool());
    BOOST_TEST(!machines[0].as_object().contains("warm"));
    for (Candidate const& machine : scheduler.machines(start))
        BOOST_TEST(!machine.warm);
}

BOOST_FIXTURE_TEST_CASE(who_names_no_world_is_placed_as_ever, Warm)
{
    std::map<std::string, int> placed;
    for (int session = 0; session != 6; ++session)
        ++placed[place(PlacementRequest())];
    BOOST_TEST(placed.size() == 3u);
}

BOOST_AUTO_TEST_SUITE_END()
