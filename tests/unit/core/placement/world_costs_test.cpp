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

BOOST_AUTO_TEST_SUITE(world_costs)

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
            costs.learn(worlds, {10'000, 0}, seconds(5), now += seconds(5));
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

BOOST_AUTO_TEST_CASE(graphics_are_learned_from_machines_that_know_of_them)
{
    WorldCosts costs;
    TimePoint now = start;
    auto drawing = use_of("r", "drawing", 2, 2);
    drawing.graphics = 1.6;
    auto counting = use_of("r", "counting", 2, 2);
    auto const elsewhere = use_of("r", "drawing", 2, 2);
    for (int report = 0; report != 120; ++report) {
        costs.learn({drawing, counting}, {100, 0, 4}, seconds(5), now += seconds(5));
        costs.learn({elsewhere}, {100, 0, std::nullopt}, seconds(5), now); // has a processor that nobody asks
    }
    BOOST_TEST(costs.graphics() == 0.4, within);
    auto const expect = [&](std::string const& world) {
        return costs.expect(world_key(address("r", world), "mjpeg"));
    };
    BOOST_TEST(expect("drawing").graphics == 2, within);
    BOOST_TEST(expect("counting").graphics < 0.1);
    BOOST_TEST(expect("drawing").mean == 1, within);
    auto const loaded = WorldCosts::load(costs.save(now), now).value();
    BOOST_TEST(loaded.graphics() == costs.graphics(), boost::test_tools::tolerance(1e-3));
    BOOST_TEST(Fleet().expect("r", "drawing").graphics == 1, "nobody has said anything of graphics");
}

BOOST_AUTO_TEST_CASE(no_machine_says_more_of_graphics_than_it_has)
{
    WorldCosts costs;
    auto lie = use_of("r", "w", 1, 1);
    lie.graphics = 1e6;
    for (int report = 0; report != 12; ++report)
        costs.learn({lie}, {4, 0, 1}, seconds(5), start + seconds(5 * report));
    BOOST_TEST(costs.graphics() <= 1);
}

BOOST_AUTO_TEST_CASE(where_nobody_uses_graphics_a_lie_about_them_does_not_spoil_the_average_at_once)
{
    WorldCosts costs;
    TimePoint now = start;
    for (int report = 0; report != 120; ++report)
        costs.learn({use_of("r", "w", 64, 64)}, {100, 0, 4}, seconds(5), now += seconds(5));
    auto lie = use_of("r", "w", 64, 64);
    lie.graphics = 1e6;
    costs.learn({lie}, {100, 0, 100'000}, seconds(5), now += seconds(5));
    BOOST_TEST(costs.graphics() < 0.01);
}

// Two machines with the same processors; on one, graphics processors are what there is too little of.
BOOST_AUTO_TEST_CASE(a_world_that_draws_much_goes_where_graphics_processors_are_free)
{
    SchedulerParams params;
    params.threshold = 1000;
    Fixture fixture(params, {"few", "many"});
    auto const report = [](double graphics_processors) {
        LoadReport said = counted(20, 4);
        said.processors = 64;
        said.graphics_processors = graphics_processors;
        auto drawing = use_of("r", "drawing", 2, 2);
        drawing.graphics = 0.8;
        said.worlds = {drawing, use_of("r", "counting", 2, 2)};
        return said;
    };
    for (int second = 5; second != 600; second += 5)
        for (auto const& [name, graphics] : {std::pair("few", 1.0), std::pair("many", 8.0)})
            fixture.scheduler.report(name, report(graphics), start + seconds(second));
    auto const now = start + seconds(600);
    PlacementRequest draws;
    draws.world = address("r", "drawing");
    draws.mode = "mjpeg";
    for (int session = 0; session != 4; ++session)
        BOOST_TEST(fixture.scheduler.place(draws, now)->address == "many");
}

namespace {

/// A fleet that knows some worlds, and what it expects of them.
struct Saved : Fleet
{
    Saved()
    {
        auto heavy = use_of("r", "heavy", 2, 8);
        heavy.memory = 6e9;
        watch({heavy, use_of("q", "light", 4, 0.4)}, 60);
    }
    static void check(WorldCosts const& one, WorldCosts const& other)
    {
        for (auto const* const name : {"heavy", "light", "other"})
            for (auto const* const repository : {"r", "q", "p"}) {
                auto const key = world_key(address(repository, name), "mjpeg");
                BOOST_TEST(one.expect(key).mean == other.expect(key).mean,
                           boost::test_tools::tolerance(1e-3));
                BOOST_TEST(one.expect(key).memory == other.expect(key).memory,
                           boost::test_tools::tolerance(1e-3));
                BOOST_TEST(one.expect(key).is_known == other.expect(key).is_known);
            }
    }
};

} // namespace

BOOST_FIXTURE_TEST_CASE(what_was_saved_is_known_again_after_a_restart, Saved)
{
    TimePoint const later = now - hours(1000); // the clock of another boot
    auto const loaded = WorldCosts::load(costs.save(now), later);
    BOOST_REQUIRE(loaded.has_value());
    check(costs, *loaded);
    BOOST_TEST(loaded->expect(world_key(address("r", "heavy"), "mjpeg")).memory == 3e9,
               boost::test_tools::tolerance(1e-3));
    BOOST_TEST(WorldCosts::load(WorldCosts().save(start), start).has_value());
}

BOOST_FIXTURE_TEST_CASE(what_was_saved_fades_like_what_was_not, Saved)
{
    auto loaded = WorldCosts::load(costs.save(now + hours(24 * 14)), start).value();
    std::vector<WorldUse> const changed = {use_of("r", "heavy", 1, 1)};
    loaded.learn(changed, {100, 0}, seconds(60), start);
    costs.learn(changed, {100, 0}, seconds(60), now + hours(24 * 14));
    check(costs, loaded);
}

BOOST_AUTO_TEST_CASE(what_was_learned_after_a_long_silence_is_known_again_after_a_restart)
{
    Fleet fleet;
    fleet.watch({}, 5'000);
    for (int i = 0; i < 3; ++i)
        fleet.costs.learn({use_of("average", "average", 900, 900)}, {10'000, 0}, minutes(30),
                          fleet.now += minutes(30));
    BOOST_TEST(WorldCosts::load(fleet.costs.save(fleet.now), fleet.now).has_value());
}

BOOST_AUTO_TEST_CASE(what_is_saved_is_bounded_and_of_the_latest)
{
    Fleet fleet;
    fleet.watch({use_of("old", "old", 1, 2)}, 20);
    for (int world = 0; world != 3000; ++world)
        fleet.watch({use_of("r" + std::to_string(world), "w", 1, 1)}, 1);
    fleet.watch({use_of("new", "new", 1, 2)}, 20);
    std::string const text = fleet.costs.save(fleet.now);
    BOOST_TEST(text.size() < 300'000u);
    auto const loaded = WorldCosts::load(text, start);
    BOOST_TEST_REQUIRE(loaded.has_value());
    BOOST_TEST(loaded->size() == WorldCosts::max_saved);
    BOOST_TEST(loaded->expect(world_key(address("new", "new"), "mjpeg")).is_known);
    BOOST_TEST(!loaded->expect(world_key(address("old", "old"), "mjpeg")).is_known);
    std::string longer = text;
    longer.insert(longer.rfind('\n', longer.size() - 2), "\n0123456789abcdef 1 1 1 1");
    BOOST_TEST(!WorldCosts::load(longer, start).has_value(), "more than was ever saved");
}

BOOST_FIXTURE_TEST_CASE(text_that_was_not_saved_is_refused_whole, Saved)
{
    std::string const text = costs.save(now);
    std::string const title = text.substr(0, text.find('\n') + 1);
    BOOST_TEST(WorldCosts::load(title + "1 1 1 1 1 1\n", now).has_value());
    for (std::string const& wrong : {std::string(),
                                     std::string("{}"),
                                     std::string(1000, '\0'),
                                     title.substr(1),
                                     "x" + text,
                                     text + "x",
                                     text.substr(0, text.size() - 1),
                                     title + "\n",
                                     title + "1 1 1 1 1\n",
                                     title + "1 1 1 1 1 1 1\n",
                                     title + "1 -1 1 1 1 1\n",
                                     title + "1 nan 1 1 1 1\n",
                                     title + "1 inf 1 1 1 1\n",
                                     title + "1 1e999 1 1 1 1\n",
                                     title + "1 1 1e9 1 1 1\n",
                                     title + "1 1 1 1e99 1 1\n",
                                     title + "1 1 1 1 1e99 1\n",
                                     title + "1 1 1 1 1 1e99\n",
                                     title + "1  1 1 1 1 1\n",
                                     title + "g 1 1 1 1 1\n",
                                     title + "11111111111111111 1 1 1 1 1\n",
                                     title + "1 1 1 1 1 1\r\n"})
        BOOST_TEST(!WorldCosts::load(wrong, now).has_value(), wrong.substr(0, 60));
}

BOOST_FIXTURE_TEST_CASE(any_bytes_are_survived, Saved)
{
    std::string const text = costs.save(now);
    RandomSource random(7);
    int usable = 0;
    for (int round = 0; round != 20'000; ++round) {
        std::string changed = text;
        for (std::size_t changes = 1 + random.below(4); changes != 0; --changes) {
            std::size_t const at = random.below(changed.size());
            switch (random.below(4)) {
            case 0:
                changed[at] = static_cast<char>(random.below(256));
                break;
            case 1:
                changed[at] = "0123456789. -e+\n"[random.below(16)];
                break;
            case 2:
                changed.erase(at, random.below(30));
                break;
            default:
                changed.insert(at, changed.substr(random.below(changed.size()), 20));
            }
            if (changed.empty())
                break;
        }
        auto loaded = WorldCosts::load(changed, now);
        if (!loaded)
            continue;
        ++usable;
        loaded->learn({use_of("r", "heavy", 1, 1)}, {100, 0}, seconds(5), now + seconds(5));
        ExpectedCost const expected = loaded->expect(world_key(address("r", "heavy"), "mjpeg"));
        BOOST_REQUIRE((expected.mean >= 0.02 && expected.mean <= 50));
        BOOST_REQUIRE((expected.memory >= 0 && expected.memory <= 1e15));
        BOOST_REQUIRE(WorldCosts::load(loaded->save(now + seconds(5)), now).has_value());
    }
    BOOST_TEST(usable > 100, "some changes are of digits only");
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

BOOST_FIXTURE_TEST_CASE(who_can_wait_waits_for_a_machine_with_room_for_the_world, Campus)
{
    scheduler.mark_unreachable("b", now);
    scheduler.report("a", with(75, 4, {use_of("r", "average", 3, 3)}), now += seconds(5));
    auto const place = [&](PlacementRequest request, bool must_fit) {
        request.only_free = true;
        request.must_fit = must_fit;
        auto const placement = scheduler.place(request, now);
        if (placement)
            scheduler.release(*placement, now);
        return placement;
    };
    BOOST_TEST((place(of("q", "heavy"), true).error() == errc::too_large));
    Decision const decision = scheduler.decisions().back();
    BOOST_TEST(decision.refused[static_cast<std::size_t>(Refusal::room)] == 1u);
    BOOST_TEST((decision.machines[0].machine.refusal == Refusal::room));
    auto const json = boost::json::parse(decisions_json(scheduler, now));
    BOOST_TEST(json.at("decisions").at(0).at("machines").at(0).at("refused") == "room");

    BOOST_TEST(place(of("q", "heavy"), false).value().address == "a", "it has waited long enough");
    BOOST_TEST(place(of("s", "light"), true).value().address == "a");
    BOOST_TEST(place(of("new", "new"), true).value().address == "a", "nothing is known of it");
    scheduler.report("b", with(50, 64, {use_of("r", "average", 28, 28)}), now);
    BOOST_TEST(place(of("q", "heavy"), true).value().address == "b");
}

BOOST_AUTO_TEST_CASE(a_small_world_is_not_heavy_beside_a_busy_neighbour)
{
    Fixture site({}, {"a"});
    TimePoint now = start;
    auto const watch = [&](double load, double each, int reports) {
        for (int seen = 0; seen != reports; ++seen)
            site.scheduler.report("a", Campus::with(load, 2, {use_of("r", "arena", 1, each)}),
                                  now += seconds(5));
    };
    auto const fits = [&] {
        auto request = Campus::of("r", "arena");
        request.only_free = request.must_fit = true;
        auto const placement = site.scheduler.place(request, now);
        if (placement)
            site.scheduler.release(*placement, now);
        return placement.has_value();
    };
    watch(8, 0.08, 60);  // 8 % of a processor
    watch(90, 0.08, 10); // another program takes nearly all of both
    BOOST_TEST(fits(), "four percent of the machine");
    watch(90, 0.6, 720); // now it is a heavy one
    BOOST_TEST(!fits());
}

BOOST_FIXTURE_TEST_CASE(a_machine_without_sessions_has_room_for_every_world, Campus)
{
    scheduler.mark_unreachable("b", now);
    for (int seen = 0; seen != 60; ++seen) // by others of its programs
        scheduler.report("a", with(80, 4, {}), now += seconds(5));
    PlacementRequest heavy = of("q", "heavy");
    heavy.only_free = heavy.must_fit = true;
    BOOST_TEST(scheduler.place(heavy, now).value().address == "a");
}

BOOST_FIXTURE_TEST_CASE(where_no_machine_is_free_it_is_not_the_world_that_is_too_large, Campus)
{
    for (auto const* const machine : {"a", "b"})
        scheduler.report(machine, with(96, 64, {use_of("r", "average", 60, 60)}), now += seconds(5));
    PlacementRequest heavy = of("q", "heavy");
    heavy.only_free = heavy.must_fit = true;
    BOOST_TEST((scheduler.place(heavy, now).error() == errc::unavailable));
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

BOOST_FIXTURE_TEST_CASE(a_scheduler_expects_what_another_has_saved, Campus)
{
    Fixture fresh({}, {"a", "b"});
    BOOST_TEST((fresh.scheduler.load_costs("nonsense", start).error() == errc::invalid_argument));
    BOOST_TEST(fresh.scheduler.load_costs(scheduler.save_costs(now), start).has_value());
    fresh.scheduler.report("a", with(25, 4, {use_of("r", "average", 1, 1)}), start);
    fresh.scheduler.report("b", with(50, 64, {use_of("r", "average", 28, 28)}), start);
    auto const placement = fresh.scheduler.place(of("q", "heavy"), start).value();
    BOOST_TEST(fresh.scheduler.explain(placement.decision)->expected_cost.value() > 1.5);
}

namespace {

/// `a` and `b` have run a world of 12 GB and one of 0.1 GB; `a` has 16 GB and is the less loaded, `b` has 64.
struct Memory : Campus
{
    Memory()
    {
        for (int seen = 0; seen != 60; ++seen)
            report(now += seconds(5), 30);
    }
    void report(TimePoint time, double used_of_a)
    {
        auto big = use_of("q", "big", 1, 1);
        big.memory = 12e9;
        auto small = use_of("s", "small", 2, 2);
        small.memory = 0.2e9;
        LoadReport b = with(60, 64, {big, small, use_of("r", "average", 28, 28)});
        b.memory = 30;
        b.memory_bytes = 64e9;
        scheduler.report("b", b, time);
        report_a(time, used_of_a);
    }
    void report_a(TimePoint time, double used)
    {
        LoadReport a = with(5, 4, {});
        a.memory = used;
        a.memory_bytes = 16e9;
        scheduler.report("a", a, time);
    }
    std::string place(PlacementRequest const& request)
    {
        auto const placement = scheduler.place(request, now);
        return placement ? std::string(placement->address) : "";
    }
};

} // namespace

BOOST_FIXTURE_TEST_CASE(a_world_goes_where_its_memory_fits, Memory)
{
    report(now, 45); // believed is half of it at most: 95 %
    BOOST_TEST(place(of("q", "big")) == "b");
    BOOST_TEST(place(of("s", "small")) == "a");
}

BOOST_FIXTURE_TEST_CASE(what_was_placed_counts_as_the_memory_that_its_world_needs, Memory)
{
    BOOST_TEST(place(of("q", "big")) == "a");
    BOOST_TEST(place(of("q", "big")) == "b");
    BOOST_TEST(place(of("s", "small")) == "a");
}

BOOST_FIXTURE_TEST_CASE(where_no_memory_is_free_who_can_wait_waits, Memory)
{
    report(now, 45);
    scheduler.mark_unreachable("b", now);
    PlacementRequest request = of("q", "big");
    request.only_free = true;
    BOOST_TEST(place(request) == "");
    request.only_free = false;
    BOOST_TEST(place(request) == "a", "the least bad one");
}

BOOST_FIXTURE_TEST_CASE(no_claim_about_a_world_keeps_it_off_machines_with_much_memory, Memory)
{
    auto lie = use_of("t", "lie", 1, 1);
    lie.memory = 1e300;
    for (int seen = 0; seen != 60; ++seen) {
        LoadReport b = with(60, 64, {lie, use_of("r", "average", 28, 28)});
        b.memory = 30;
        b.memory_bytes = 1e300;
        report_a(now += seconds(5), 30);
        scheduler.report("b", b, now);
    }
    PlacementRequest request = of("t", "lie");
    request.only_free = true;
    BOOST_TEST(place(request) == "a");
    BOOST_TEST(scheduler.load_costs(scheduler.save_costs(now), now).has_value(), "nor spoils what is saved");
}

BOOST_AUTO_TEST_CASE(what_a_machine_has_lied_is_forgotten_when_it_has_left)
{
    WorldCosts costs;
    TimePoint now = start;
    auto const report = [&](bool lies) {
        now += seconds(5);
        costs.learn({use_of("r", "w", 10, 20), use_of("q", "average", 20, 20)}, {64, 0}, seconds(5), now);
        if (lies)
            costs.learn({use_of("r", "w", 1000, 1e300)}, {1e5, 0}, seconds(5), now);
        return costs.expect(world_key(address("r", "w"), "mjpeg")).mean;
    };
    double truth = 0;
    for (int seen = 0; seen != 720; ++seen)
        truth = report(false);
    for (int seen = 0; seen != 720; ++seen)
        report(true);
    int reports = 1;
    while (std::abs(report(false) / truth - 1) > 0.25 && reports < 100'000)
        ++reports;
    BOOST_TEST_MESSAGE("forgotten after " << reports * 5 / 60 << " min");
    BOOST_TEST(reports <= 12 * 60 * 24);
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
