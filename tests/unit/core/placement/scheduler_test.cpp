// Which machine the scheduler chooses.
#include "placement_fixture.hpp"

#include <cmath>
#include <limits>
#include <set>
#include <type_traits>

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using std::chrono::seconds;

// A class with a constructor: g++ 12 destroys temporaries of aggregates twice in expressions with co_await.
static_assert(!std::is_aggregate_v<ServerSpec> && !std::is_aggregate_v<SchedulerParams>);
static_assert(!std::is_aggregate_v<Placement> && !std::is_aggregate_v<Candidate>);
static_assert(!std::is_aggregate_v<Decision> && !std::is_aggregate_v<Decision::Entry>);

BOOST_AUTO_TEST_SUITE(scheduler)

BOOST_AUTO_TEST_CASE(without_servers_nothing_is_available)
{
    Scheduler scheduler;
    BOOST_TEST(!scheduler.available(start));
    auto const placement = scheduler.place(start);
    BOOST_REQUIRE(placement.has_error());
    BOOST_TEST((placement.error() == errc::unavailable));
    BOOST_TEST(placement.error().detail() == "no simulation server available at the moment.");
}

BOOST_AUTO_TEST_CASE(a_server_that_never_reported_is_not_offered)
{
    Scheduler scheduler;
    scheduler.set_servers(named({"a"}));
    BOOST_TEST(!scheduler.available(start));
    BOOST_TEST((scheduler.machines(start).front().refusal == Refusal::unknown));
    scheduler.report("a", LoadReport(10), start);
    BOOST_TEST(scheduler.available(start));
    BOOST_TEST(scheduler.place(start).value().address == "a");
}

BOOST_AUTO_TEST_CASE(reports_of_servers_that_are_not_in_the_list_are_ignored)
{
    Scheduler scheduler;
    scheduler.report("stranger", LoadReport(0), start);
    scheduler.mark_unreachable("stranger", start);
    BOOST_TEST(!scheduler.available(start));
}

BOOST_AUTO_TEST_CASE(a_report_with_impossible_numbers_is_a_failed_poll)
{
    auto const nan = std::numeric_limits<double>::quiet_NaN();
    std::vector<LoadReport> reports{LoadReport(nan), LoadReport(-1),
                                    LoadReport(std::numeric_limits<double>::infinity())};
    reports.emplace_back(10).memory = nan;
    reports.emplace_back(10).sessions = -1;
    reports.emplace_back(10).arrivals = -1;
    for (auto const& report : reports) {
        Scheduler scheduler;
        scheduler.set_servers(named({"a", "b"}));
        scheduler.report("a", LoadReport(10), start);
        scheduler.report("a", report, start);
        BOOST_TEST((scheduler.machines(start).front().refusal == Refusal::lost));
        scheduler.report("a", LoadReport(20), start);
        scheduler.report("b", LoadReport(10), start);
        BOOST_TEST(scheduler.place(start).value().address == "b"); // and nothing of it is left
    }
}

BOOST_FIXTURE_TEST_CASE(the_least_loaded_server_is_chosen, Fixture)
{
    scheduler.report("a", counted(50, 0), start);
    scheduler.report("c", counted(50, 0), start);
    BOOST_TEST(scheduler.place(start).value().address == "b");
}

BOOST_FIXTURE_TEST_CASE(it_counts_the_sessions_that_it_placed_on_each_listed_server, Fixture)
{
    place(18);
    BOOST_TEST(scheduler.placed("a") == 6u);
    scheduler.report("a", counted(50, 6), start);
    BOOST_TEST(scheduler.placed("a") == 6u);
    BOOST_TEST(scheduler.placed("stranger") == 0u);
}

BOOST_FIXTURE_TEST_CASE(it_still_counts_them_when_a_server_has_left_the_list_and_comes_back, Fixture)
{
    place(18);
    scheduler.set_servers(named({"b"}));
    BOOST_TEST(scheduler.placed("a") == 6u);
    BOOST_TEST(scheduler.placed("b") == 6u);
    scheduler.set_servers(named({"a"}));
    BOOST_TEST(scheduler.placed("a") == 6u);
    BOOST_TEST(scheduler.machines(start).front().pending == 0, "what is known of it was forgotten");
    scheduler.report("a", counted(50, 0), start);
    place(2);
    BOOST_TEST(scheduler.placed("a") == 8u);
    scheduler.set_servers({});
    BOOST_TEST(scheduler.placed("a") == 8u);
}

BOOST_AUTO_TEST_CASE(it_forgets_the_counts_of_servers_that_left_long_ago)
{
    Scheduler scheduler;
    for (int i = 0; i < 110; ++i) {
        auto const name = std::to_string(i);
        scheduler.set_servers({ServerSpec(name)});
        scheduler.report(name, counted(0, 0), start);
        BOOST_TEST(scheduler.place(start).has_value());
    }
    BOOST_TEST(scheduler.placed("109") == 1u);
    BOOST_TEST(scheduler.placed("108") == 1u);
    BOOST_TEST(scheduler.placed("9") == 1u);
    BOOST_TEST(scheduler.placed("8") == 0u);
    BOOST_TEST(scheduler.placed("0") == 0u);
}

BOOST_AUTO_TEST_CASE(it_remembers_a_large_fleet_that_leaves_at_once)
{
    Scheduler scheduler;
    std::vector<ServerSpec> machines;
    for (int i = 0; i < 300; ++i)
        machines.emplace_back(std::to_string(i));
    scheduler.set_servers(machines);
    for (auto const& machine : machines)
        scheduler.report(machine.address, counted(0, 0), start);
    for (int i = 0; i < 300; ++i)
        (void)scheduler.place(start);
    scheduler.set_servers({});
    std::uint64_t placed = 0;
    for (auto const& machine : machines)
        placed += scheduler.placed(machine.address);
    BOOST_TEST(placed == 300u);
}

BOOST_FIXTURE_TEST_CASE(placements_count_before_any_report_shows_them, Fixture)
{
    for (auto const& [name, sessions] : place(18))
        BOOST_TEST(sessions == 6, name << " got " << sessions);
    BOOST_TEST(machine("a").pending == 6);
    BOOST_TEST(machine("a").committed == 72, boost::test_tools::tolerance(1e-9));
}

BOOST_AUTO_TEST_CASE(the_first_of_equal_servers_is_drawn_by_lot)
{
    std::set<std::string> first;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        SchedulerParams params;
        params.seed = seed;
        first.emplace(Fixture(params).scheduler.place(start).value().address);
    }
    // All sixty on two of three servers: less likely than 3 * (2/3)^60 = 8e-11.
    BOOST_TEST(first.size() == 3u);
}

BOOST_AUTO_TEST_CASE(equal_servers_take_turns)
{
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        SchedulerParams params;
        params.seed = seed;
        Fixture fixture(params);
        auto const round = [&](TimePoint now) {
            std::string order;
            for (int session = 0; session != 3; ++session)
                order += fixture.scheduler.place(now).value().address;
            return order;
        };
        std::string const first = round(start);
        // They become equal again; who was served longest ago is next.
        for (char const* const name : {"a", "b", "c"})
            fixture.scheduler.report(name, counted(0, 1), start + seconds(1));
        BOOST_TEST(round(start + seconds(1)) == first);
    }
}

BOOST_AUTO_TEST_CASE(of_equal_servers_whoever_was_served_longest_ago_is_next)
{
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        SchedulerParams params;
        params.seed = seed;
        Fixture fixture(params);
        for (char const* const chosen : {"c", "a", "b"}) {
            for (char const* const name : {"a", "b", "c"})
                fixture.scheduler.report(name, counted(*name == *chosen ? 0 : 80, 0), start);
            BOOST_TEST(fixture.scheduler.place(start).value().address == chosen);
        }
        for (char const* const name : {"a", "b", "c"})
            fixture.scheduler.report(name, counted(0, 0), start);
        for (char const* const next : {"c", "a", "b"})
            BOOST_TEST(fixture.scheduler.place(start).value().address == next, "seed " << seed);
    }
}

BOOST_AUTO_TEST_CASE(of_equal_servers_those_that_were_never_served_come_first)
{
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        SchedulerParams params;
        params.seed = seed;
        Fixture fixture(params);
        std::string const served(fixture.scheduler.place(start).value().address);
        for (char const* const name : {"a", "b", "c"}) // each with one session in its report
            fixture.scheduler.report(name, counted(12, 1), start);
        BOOST_TEST(!fixture.place(2).contains(served), "seed " << seed);
    }
}

BOOST_AUTO_TEST_CASE(another_seed_gives_other_decisions)
{
    auto const history = [](std::uint64_t seed) {
        SchedulerParams params;
        params.policy = "power_of_two";
        params.threshold = 1e9;
        params.seed = seed;
        Fixture fixture(params);
        // Loads differ, so that only the random numbers of decisions matter and not who is served first.
        for (char const* const name : {"a", "b", "c"})
            fixture.scheduler.report(name, counted(*name, 0), start);
        std::string all;
        for (int session = 0; session != 40; ++session)
            all += fixture.scheduler.place(start).value().address;
        return all;
    };
    BOOST_TEST(history(1) != history(2));
}

BOOST_AUTO_TEST_CASE(the_same_seed_and_calls_give_the_same_decisions)
{
    auto const history = [] {
        SchedulerParams params;
        params.policy = "random";
        Fixture fixture(params);
        std::string all;
        for (int session = 0; session != 20; ++session)
            all += fixture.scheduler.place(start).value().address;
        return all;
    };
    BOOST_TEST(history() == history());
}

BOOST_FIXTURE_TEST_CASE(a_server_at_the_threshold_is_not_offered, OneMachine)
{
    scheduler.report("a", counted(94.9, 0), start);
    BOOST_TEST(scheduler.available(start));
    scheduler.report("a", counted(95, 0), start);
    BOOST_TEST(!scheduler.available(start));
    BOOST_TEST((machine("a").refusal == Refusal::load));
}

BOOST_FIXTURE_TEST_CASE(sessions_that_start_make_a_server_unavailable_before_their_load_shows, OneMachine)
{
    TimePoint const now = teach_cost();
    scheduler.report("a", counted(48, 8, 4), now + seconds(5)); // 8 * 12 % reach 95 %
    BOOST_TEST(!scheduler.available(now + seconds(5)));
    BOOST_TEST((machine("a", now + seconds(5)).refusal == Refusal::committed));
    BOOST_TEST(scheduler.place(now + seconds(5)).has_error());
}

BOOST_FIXTURE_TEST_CASE(what_was_placed_and_nobody_claimed_makes_no_server_unavailable, OneMachine)
{
    TimePoint const now = teach_cost();
    place(4, now); // with the four that are running: 8 * 12 % reach 95 %
    BOOST_TEST(machine("a", now).overcommitted);
    BOOST_TEST((machine("a", now).refusal == Refusal::none));
    BOOST_TEST(scheduler.available(now));
    BOOST_TEST(scheduler.place(now).has_value());
}

BOOST_FIXTURE_TEST_CASE(a_guess_of_what_sessions_cost_sends_nobody_away, OneMachine)
{
    place(30);
    BOOST_TEST(machine("a").committed > 95);
    BOOST_TEST(scheduler.available(start));
    BOOST_TEST(scheduler.place(start).has_value());
}

BOOST_AUTO_TEST_CASE(unusable_parameters_are_named)
{
    auto const complaint = [](auto change) {
        SchedulerParams params;
        change(params);
        auto const valid = validate(params);
        BOOST_TEST(valid.has_error());
        BOOST_TEST((Scheduler::make(params).error() == errc::invalid_argument));
        std::string const detail = valid.has_error() ? valid.error().detail() : "";
        return detail.substr(0, detail.find(':'));
    };
    BOOST_TEST(complaint([](SchedulerParams& p) { p.policy = "best"; }) == "scheduling");
    BOOST_TEST(complaint([](SchedulerParams& p) { p.threshold = 0; }) == "threshold");
    BOOST_TEST(complaint([](SchedulerParams& p) { p.memory_threshold = -1; }) == "memory_threshold");
    BOOST_TEST(complaint([](SchedulerParams& p) { p.session_cost = 0; }) == "session_cost");
    BOOST_TEST(complaint([](SchedulerParams& p) { p.session_memory = -1; }) == "session_memory");
    BOOST_TEST(complaint([](SchedulerParams& p) { p.placement_timeout = -seconds(1); }) ==
               "placement_timeout");
    BOOST_TEST(complaint([](SchedulerParams& p) { p.report_lifetime = -seconds(1); }) == "report_lifetime");
    BOOST_TEST(complaint([](SchedulerParams& p) { p.slow_start = -seconds(1); }) == "slow_start");
    BOOST_TEST(!validate(SchedulerParams()).has_error());
}

BOOST_AUTO_TEST_CASE(available_says_whether_a_placement_would_succeed)
{
    RandomSource random(7);
    Fixture fixture;
    TimePoint now = start;
    int refused = 0;
    for (int step = 0; step != 20'000; ++step) {
        now += std::chrono::milliseconds(random.below(3000));
        std::string const name(1, static_cast<char>('a' + random.below(3)));
        if (random.uniform() < 0.1) {
            fixture.scheduler.mark_unreachable(name, now);
        } else {
            LoadReport report = counted(random.uniform() * 110, static_cast<int>(random.below(9)));
            report.capacity = 8;
            report.memory = random.uniform() * 100;
            report.draining = random.uniform() < 0.1;
            fixture.scheduler.report(name, report, now);
        }
        bool const available = fixture.scheduler.available(now);
        bool const placed = fixture.scheduler.place(now).has_value();
        BOOST_REQUIRE(available == placed);
        refused += !placed;
    }
    BOOST_TEST(refused > 1000);
    BOOST_TEST(refused < 19'000);
}

BOOST_AUTO_TEST_CASE(new_limits_hold_at_once_and_what_is_known_stays)
{
    TimePoint const now{std::chrono::hours(1)};
    Scheduler scheduler;
    scheduler.set_servers({ServerSpec("a:1")});
    scheduler.report("a:1", LoadReport(50), now);
    BOOST_TEST(scheduler.available(now));
    SchedulerParams params;
    params.threshold = 40;
    BOOST_TEST(scheduler.apply(params).has_value());
    BOOST_TEST(!scheduler.available(now));
    params.threshold = 95;
    params.report_lifetime = std::chrono::hours(1);
    BOOST_TEST(scheduler.apply(params).has_value());
    BOOST_TEST(scheduler.available(now + std::chrono::minutes(30)));
    params.threshold = 0;
    params.report_lifetime = std::chrono::seconds(15);
    BOOST_TEST((scheduler.apply(params).error() == errc::invalid_argument));
    BOOST_TEST(scheduler.available(now + std::chrono::minutes(30)));
    LoadReport report(50);
    report.memory = 70;
    scheduler.report("a:1", report, now + std::chrono::minutes(31));
    params = SchedulerParams();
    params.memory_threshold = 60;
    BOOST_TEST(scheduler.apply(params).has_value());
    BOOST_TEST((scheduler.machines(now + std::chrono::minutes(31)).front().refusal == Refusal::memory));
}

BOOST_AUTO_TEST_CASE(a_new_policy_decides_at_once_and_old_decisions_keep_theirs)
{
    Scheduler scheduler;
    scheduler.set_servers(named({"a", "b"}));
    scheduler.report("a", counted(10, 0), start);
    scheduler.report("b", counted(20, 0), start);
    auto const before = scheduler.explain(scheduler.place(start).value().decision).value();
    BOOST_TEST(before.policy == "least_committed");
    BOOST_TEST(before.chosen == "a");

    SchedulerParams params;
    params.policy = "highest_load";
    params.custom = [](PlacementSnapshot const& machines, RandomSource&) {
        std::size_t highest = 0;
        for (std::size_t i = 1; i < machines.size(); ++i)
            highest = machines[i].load > machines[highest].load ? i : highest;
        return highest;
    };
    BOOST_TEST(scheduler.apply(params).has_value());
    auto const after = scheduler.explain(scheduler.place(start).value().decision).value();
    BOOST_TEST(after.policy == "highest_load");
    BOOST_TEST(after.chosen == "b");
    BOOST_TEST(scheduler.explain(before.id).value().policy == "least_committed");
    BOOST_TEST(scheduler.replay(before).value() == "a");
    BOOST_TEST(scheduler.replay(after).value() == "b");

    params.policy = "best";
    params.custom = nullptr;
    BOOST_TEST((scheduler.apply(params).error() == errc::invalid_argument));
    BOOST_TEST(scheduler.explain(scheduler.place(start).value().decision).value().policy == "highest_load");

    BOOST_TEST(scheduler.apply(SchedulerParams()).has_value());
    for (int i = 0; i < 100; ++i) // until the log has forgotten the others
        (void)scheduler.place(start);
    BOOST_TEST(scheduler.replay(before).value() == "a");
    BOOST_TEST(scheduler.replay(after).value() == "b", "a policy goes with the next change");
    params.policy = "least_reported";
    BOOST_TEST(scheduler.apply(params).has_value());
    BOOST_TEST((scheduler.replay(after).error() == errc::not_found));
}

BOOST_AUTO_TEST_CASE(the_first_costs_that_are_assumed_and_a_slow_start_can_be_changed)
{
    Scheduler scheduler;
    scheduler.set_servers(named({"a"}));
    SchedulerParams params;
    params.session_cost = 30;
    params.placement_timeout = seconds(1); // stays
    BOOST_TEST(scheduler.apply(params).has_value());
    scheduler.set_servers(named({"a", "b"}));
    scheduler.report("a", counted(10, 0), start);
    scheduler.report("b", counted(10, 0), start);
    auto const machines = scheduler.machines(start);
    BOOST_TEST(std::lround(machines[0].cost) == 12);
    BOOST_TEST(std::lround(machines[1].cost) == 30);
    (void)scheduler.place(start);
    scheduler.report("a", counted(10, 0), start + seconds(10));
    BOOST_TEST(scheduler.machines(start + seconds(10))[0].pending == 1);
}

BOOST_AUTO_TEST_SUITE_END()
