// What a session of a world costs, by what machines report.
#include "placement_fixture.hpp"

#include "core/placement/world_costs.hpp"

#include <boost/json.hpp>

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using placement::ExpectedCost;
using placement::WorldCosts;
using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::seconds;

namespace {

std::string address(std::string const& repository, std::string const& world)
{
    return "https://github.com/o/" + repository + "/blob/main/worlds/" + world + ".wbt";
}

WorldUse use_of(std::string const& repository, std::string const& world, int running, double processors,
                int starting = 0)
{
    WorldUse use;
    use.key = world_key(address(repository, world), "mjpeg");
    use.running = running;
    use.processors = processors;
    use.starting = starting;
    return use;
}

/// A fleet whose average session keeps one processor busy: what else is seen is a small part of it.
struct Fleet
{
    Fleet() { watch({}, 120); }

    void watch(std::vector<WorldUse> worlds, int reports)
    {
        worlds.push_back(use_of("average", "average", 900, 900));
        for (int report = 0; report != reports; ++report)
            costs.learn(worlds, 10'000, seconds(5), now += seconds(5));
    }
    ExpectedCost expect(std::string const& repository, std::string const& world,
                        std::string const& mode = "mjpeg") const
    {
        return costs.expect(world_key(address(repository, world), mode));
    }

    WorldCosts costs;
    TimePoint now = start;
};

auto const within = boost::test_tools::tolerance(0.15);

} // namespace

BOOST_AUTO_TEST_SUITE(world_costs)

BOOST_AUTO_TEST_CASE(keys_are_equal_for_equal_addresses_and_modes_only)
{
    auto const key = world_key(address("r", "w"), "mjpeg");
    BOOST_TEST((key == world_key(address("r", "w"), "mjpeg")));
    auto const sibling = world_key(address("r", "x"), "mjpeg");
    BOOST_TEST((sibling.world != key.world && sibling.repository == key.repository));
    auto const stranger = world_key(address("s", "w"), "mjpeg");
    BOOST_TEST((stranger.repository != key.repository && stranger.mode == key.mode));
    auto const other_mode = world_key(address("r", "w"), "x3d");
    BOOST_TEST((other_mode.world != key.world && other_mode.repository != key.repository &&
                other_mode.mode != key.mode));
    BOOST_TEST((world_key("w", "").repository != world_key("w", "").world));
}

BOOST_AUTO_TEST_CASE(without_reports_every_session_is_the_average_one)
{
    ExpectedCost const expected = WorldCosts().expect(world_key(address("r", "w"), "mjpeg"));
    BOOST_TEST(expected.mean == 1);
    BOOST_TEST(!expected.is_known);
}

BOOST_AUTO_TEST_CASE(a_world_is_known_after_a_minute_whatever_the_size_of_the_machine)
{
    Fleet fleet;
    BOOST_TEST(!fleet.expect("r", "heavy").is_known);
    fleet.watch({use_of("r", "heavy", 1, 3), use_of("q", "light", 2, 0.4)}, 12);
    BOOST_TEST(fleet.expect("r", "heavy").is_known);
    BOOST_TEST(fleet.expect("r", "heavy").mean > 2.5);
    BOOST_TEST(fleet.expect("q", "light").mean < 0.3);
}

BOOST_AUTO_TEST_CASE(a_world_that_only_starts_teaches_nothing)
{
    Fleet fleet;
    fleet.watch({use_of("r", "w", 0, 0, 5)}, 100);
    BOOST_TEST(!fleet.expect("r", "w").is_known);
}

BOOST_AUTO_TEST_CASE(a_new_world_is_expected_to_be_as_others_of_its_repository_are)
{
    Fleet fleet;
    fleet.watch({use_of("r", "w1", 2, 6), use_of("r", "w2", 2, 6)}, 720);
    BOOST_TEST(fleet.expect("r", "w3").mean > 2);
    BOOST_TEST(!fleet.expect("r", "w3").is_known, "it may differ");
    BOOST_TEST(fleet.expect("s", "w3").mean < 2);
}

BOOST_AUTO_TEST_CASE(one_odd_hour_does_not_outweigh_what_is_known)
{
    Fleet fleet;
    fleet.watch({use_of("r", "w", 1, 1)}, 720);
    double const before = fleet.expect("r", "w").mean;
    fleet.watch({use_of("r", "w", 1, 1000)}, 12); // a minute; each report counts as four times the usual
    BOOST_TEST(fleet.expect("r", "w").mean < 1.3 * before);
}

BOOST_AUTO_TEST_CASE(a_world_that_has_changed_is_learned_anew)
{
    Fleet fleet;
    fleet.watch({use_of("r", "w", 1, 1)}, 720);
    fleet.watch({use_of("r", "w", 1, 3)}, 2880);
    BOOST_TEST(fleet.expect("r", "w").mean == 3, within);
}

BOOST_AUTO_TEST_CASE(what_was_seen_long_ago_weighs_little)
{
    Fleet fleet;
    fleet.watch({use_of("r", "w", 1, 3)}, 12);
    fleet.now += hours(24 * 365);
    fleet.watch({use_of("r", "w", 1, 1)}, 12);
    BOOST_TEST(fleet.expect("r", "w").mean < 1.3);
}

BOOST_AUTO_TEST_CASE(memory_is_bounded_and_the_oldest_are_forgotten)
{
    Fleet fleet;
    fleet.watch({use_of("r", "old", 1, 1)}, 20);
    for (int report = 0; report != 400; ++report) {
        std::vector<WorldUse> worlds;
        for (int world = 0; world != 64; ++world)
            worlds.push_back(use_of("r" + std::to_string(report), std::to_string(world), 1, 1));
        fleet.watch(worlds, 1);
        BOOST_REQUIRE(fleet.costs.size() <= WorldCosts::max_estimates);
    }
    fleet.watch({use_of("new", "new", 1, 2)}, 20);
    BOOST_TEST(!fleet.expect("r", "old").is_known);
    BOOST_TEST(fleet.expect("new", "new").is_known);
}

namespace {

/// Two machines, `a` of 4 processors and `b` of 64, that have run a world of 2 processors and one of 0.1.
struct Campus : Fixture
{
    Campus() : Fixture({}, {"a", "b"})
    {
        for (int seen = 0; seen != 60; ++seen) {
            now += seconds(5);
            scheduler.report("a", with(25, 4, {use_of("r", "average", 1, 1)}), now);
            scheduler.report("b",
                             with(50, 64,
                                  {use_of("r", "average", 28, 28), use_of("q", "heavy", 1, 2),
                                   use_of("s", "light", 20, 2)}),
                             now);
        }
    }
    static LoadReport with(double load, double processors, std::vector<WorldUse> worlds)
    {
        LoadReport report = counted(load, 0);
        for (WorldUse const& use : worlds) {
            *report.sessions += use.running + use.starting;
            *report.starting += use.starting;
        }
        report.processors = processors;
        report.worlds = std::move(worlds);
        return report;
    }
    static PlacementRequest of(std::string const& repository, std::string const& world)
    {
        PlacementRequest request;
        request.world = address(repository, world);
        request.mode = "mjpeg";
        return request;
    }

    TimePoint now = start;
};

} // namespace

BOOST_FIXTURE_TEST_CASE(a_heavy_world_goes_to_the_machine_that_can_carry_it, Campus)
{
    BOOST_TEST(scheduler.place(of("q", "heavy"), now).value().address == "b");
    BOOST_TEST(scheduler.place(of("s", "light"), now).value().address == "a");
}

BOOST_FIXTURE_TEST_CASE(what_was_placed_counts_as_what_its_world_costs, Campus)
{
    double const before = machine("b", now).committed;
    (void)scheduler.place(of("q", "heavy"), now);
    double const heavy = machine("b", now).committed - before;
    double const idle = machine("a", now).committed;
    (void)scheduler.place(of("s", "light"), now);
    double const light = machine("a", now).committed - idle;
    BOOST_TEST(heavy == 100.0 * 2 / 64, boost::test_tools::tolerance(0.2));
    BOOST_TEST(light == 100.0 * 0.1 / 4, boost::test_tools::tolerance(0.3));
}

BOOST_FIXTURE_TEST_CASE(what_starts_counts_as_what_its_world_costs_whoever_placed_it, Campus)
{
    scheduler.report("a", with(25, 4, {use_of("r", "average", 1, 1), use_of("q", "heavy", 0, 0, 1)}),
                     now += seconds(5));
    BOOST_TEST(machine("a", now).committed == 75, boost::test_tools::tolerance(0.15));
}

BOOST_FIXTURE_TEST_CASE(a_world_nobody_has_run_is_placed_as_ever, Campus)
{
    auto const decided = [&](PlacementRequest const& request) {
        auto const placement = scheduler.place(request, now).value();
        scheduler.release(placement, now);
        return scheduler.explain(placement.decision).value();
    };
    BOOST_TEST(decided(of("new", "new")).chosen == decided(PlacementRequest()).chosen);
    BOOST_TEST(!decided(of("new", "new")).expected_cost.has_value());
}

BOOST_FIXTURE_TEST_CASE(a_decision_says_what_was_believed_and_can_be_replayed, Campus)
{
    auto const placement = scheduler.place(of("q", "heavy"), now).value();
    Decision const decision = scheduler.explain(placement.decision).value();
    BOOST_TEST(decision.expected_cost.value() > 1.5);
    BOOST_TEST(scheduler.replay(decision).value() == decision.chosen);
    auto const json = boost::json::parse(decisions_json(scheduler, now));
    BOOST_TEST(json.at("decisions").at(0).at("expectedCost").as_double() > 1.5);
    // The score is that of this session, not of the average one.
    BOOST_TEST(decision.machines[0].machine.score > decision.machines[1].machine.score);
}

BOOST_FIXTURE_TEST_CASE(a_full_machine_says_nothing_about_what_its_simulations_want, Campus)
{
    for (int seen = 0; seen != 60; ++seen)
        scheduler.report("a", with(100, 4, {use_of("t", "starved", 40, 4)}), now += seconds(5));
    scheduler.report("b", with(50, 64, {}), now);
    auto const placement = scheduler.place(of("t", "starved"), now).value();
    BOOST_TEST(!scheduler.explain(placement.decision)->expected_cost.has_value());
}

BOOST_FIXTURE_TEST_CASE(a_machine_that_lies_has_nobody_refused_on_others_whose_worlds_are_known, Campus)
{
    for (int seen = 0; seen != 720; ++seen) {
        now += seconds(5);
        scheduler.report("a", with(25, 1e5, {use_of("t", "lie", 1000, 1e300)}), now);
        scheduler.report("b", with(50, 64, {use_of("r", "average", 28, 28, 2)}), now);
        BOOST_REQUIRE((machine("b", now).refusal == Refusal::none));
    }
}

BOOST_FIXTURE_TEST_CASE(impossible_numbers_of_worlds_are_a_failed_poll, Campus)
{
    LoadReport report = with(25, 0, {});
    scheduler.report("a", report, now);
    BOOST_TEST((machine("a", now).refusal == Refusal::lost));
    scheduler.report("a", with(25, 4, {use_of("r", "w", -1, 1)}), now);
    BOOST_TEST((machine("a", now).refusal == Refusal::lost));
    scheduler.report("a", with(25, 4, {use_of("r", "w", 1, -1)}), now);
    BOOST_TEST((machine("a", now).refusal == Refusal::lost));
}

BOOST_AUTO_TEST_SUITE_END()
