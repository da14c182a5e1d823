#include "unit_test.hpp"

#include <webots_cloud/scheduler.hpp>

#include <map>
#include <set>

using namespace webots_cloud;
using std::chrono::seconds;

BOOST_AUTO_TEST_SUITE(placement_policy)

namespace {

TimePoint const start = TimePoint(std::chrono::hours(1));

/// Machines 0, 1, 2 ... of the loads given, asked to place `sessions`.
std::map<std::string, int> place(SchedulerParams params, std::vector<double> const& loads, int sessions)
{
    params.threshold = 1e9;
    auto scheduler = Scheduler::make(std::move(params)).value();
    std::vector<ServerSpec> specs;
    for (std::size_t machine = 0; machine != loads.size(); ++machine)
        specs.emplace_back(std::to_string(machine));
    scheduler.set_servers(specs);
    for (std::size_t machine = 0; machine != loads.size(); ++machine)
        scheduler.report(std::to_string(machine), LoadReport(loads[machine]), start);
    std::map<std::string, int> placed;
    for (int session = 0; session != sessions; ++session)
        ++placed[std::string(scheduler.place(start).value().address)];
    return placed;
}

SchedulerParams with_policy(char const* name)
{
    SchedulerParams params;
    params.policy = name;
    return params;
}

/// A snapshot of machines that a test describes, whose lowest scores come in the order of its list.
class Described : public PlacementSnapshot
{
public:
    std::vector<Candidate> machines;
    double others = 0;
    std::size_t least = 0;
    bool empty_part = false;
    mutable std::size_t asked_parts = 0;
    mutable double asked_where = 0;

    std::size_t size() const override { return machines.size(); }
    Candidate operator[](std::size_t position) const override { return machines[position]; }
    std::size_t least_committed() const override { return least; }
    std::size_t least_reported() const override { return 0; }
    std::size_t lowest(std::span<std::size_t> positions, std::size_t parts, double where) const override
    {
        asked_parts = parts;
        asked_where = where;
        std::size_t const found = empty_part ? 0 : std::min(positions.size(), machines.size());
        for (std::size_t position = 0; position != found; ++position)
            positions[position] = position;
        return found;
    }
    double unseen_arrivals() const override { return others; }
};

struct Bottom
{
    double score;
    double cost;
    double weight = 1;
};

Described described(double others, std::initializer_list<Bottom> machines)
{
    Described snapshot;
    snapshot.others = others;
    for (Bottom const& bottom : machines) {
        Candidate machine;
        machine.score = bottom.score;
        machine.cost = bottom.cost;
        machine.weight = bottom.weight;
        snapshot.machines.push_back(machine);
    }
    return snapshot;
}

/// How often each of three machines is chosen in 3000 decisions.
std::array<int, 3> choices(Described const& snapshot)
{
    SchedulingPolicy const policy = scheduling_policy("least_committed").value();
    RandomSource random(3);
    std::array<int, 3> chosen{};
    for (int decision = 0; decision != 3000; ++decision)
        ++chosen.at(policy(snapshot, random));
    return chosen;
}

} // namespace

BOOST_AUTO_TEST_CASE(least_reported_sends_everybody_to_one_machine)
{
    auto const placed = place(with_policy("least_reported"), {30, 20, 10, 40}, 60);
    BOOST_TEST(placed.size() == 1u);
    BOOST_TEST(placed.begin()->first == "2");
}

BOOST_AUTO_TEST_CASE(least_reported_serves_equal_machines_in_turn)
{
    auto const placed = place(with_policy("least_reported"), {10, 10, 10, 40}, 9);
    for (char const* const name : {"0", "1", "2"})
        BOOST_TEST(placed.at(name) == 3);
}

BOOST_AUTO_TEST_CASE(least_reported_skips_machines_that_are_not_offered)
{
    auto scheduler = Scheduler::make(with_policy("least_reported")).value();
    scheduler.set_servers({ServerSpec("a"), ServerSpec("b")});
    scheduler.report("a", LoadReport(10), start);
    scheduler.report("b", LoadReport(50), start);
    scheduler.mark_unreachable("a", start);
    BOOST_TEST(scheduler.place(start).value().address == "b");
}

BOOST_AUTO_TEST_CASE(least_reported_refuses_by_reports_alone_as_the_reference_does)
{
    auto scheduler = Scheduler::make(with_policy("least_reported")).value();
    scheduler.set_servers({ServerSpec("a")});
    scheduler.report("a", LoadReport(94), start);
    for (int session = 0; session != 20; ++session)
        BOOST_TEST(scheduler.place(start).has_value());
}

BOOST_AUTO_TEST_CASE(random_uses_every_machine)
{
    auto const placed = place(with_policy("random"), {0, 50, 90}, 3000);
    BOOST_REQUIRE(placed.size() == 3u);
    for (auto const& [name, sessions] :
         placed) // binomial, 1000 with a standard deviation of 26: five of them
        BOOST_TEST(std::abs(sessions - 1000) < 130, name << " got " << sessions);
}

BOOST_AUTO_TEST_CASE(power_of_two_takes_the_better_of_two_different_machines)
{
    auto placed = place(with_policy("power_of_two"), {10, 20, 30}, 3000);
    // Two of three: the worst never wins, the best wins unless it is not drawn.
    BOOST_TEST(placed["2"] == 0);
    BOOST_TEST(std::abs(placed["0"] - 2000) < 130);
    BOOST_TEST(place(with_policy("power_of_two"), {10}, 5)["0"] == 5);
}

BOOST_AUTO_TEST_CASE(others_arrivals_are_poured_over_the_lowest_machines)
{
    // Three fill the first to 30 (two sessions), the second to 30 (one).
    auto const chosen = choices(described(3, {{10, 10}, {20, 10}, {60, 10}}));
    BOOST_TEST(std::abs(chosen[0] - 2000) < 130);
    BOOST_TEST(std::abs(chosen[1] - 1000) < 130);
    BOOST_TEST(chosen[2] == 0);
}

BOOST_AUTO_TEST_CASE(others_arrivals_fill_machines_of_cheap_sessions_and_of_high_weight_more_slowly)
{
    // A percent of score is a fifth of a session on the first, a tenth on the second: 40 and 20 percent
    // higher.
    auto const cheap = choices(described(6, {{10, 5}, {10, 10}, {60, 10}}));
    BOOST_TEST(std::abs(cheap[0] - 2000) < 130);
    BOOST_TEST(std::abs(cheap[1] - 1000) < 130);
    auto const heavy = choices(described(6, {{10, 10, 2}, {10, 10, 1}, {60, 10, 1}}));
    BOOST_TEST(std::abs(heavy[0] - 2000) < 130);
    BOOST_TEST(std::abs(heavy[1] - 1000) < 130);
}

BOOST_AUTO_TEST_CASE(where_others_place_much_a_random_part_of_the_fleet_is_asked)
{
    Described snapshot = described(3, {{10, 10}, {20, 10}, {60, 10}});
    RandomSource random(3);
    SchedulingPolicy const policy = scheduling_policy("least_committed").value();
    (void)policy(snapshot, random);
    BOOST_TEST(snapshot.asked_parts == 1u);
    snapshot.others = 800;
    std::set<int> tenths;
    for (int decision = 0; decision != 300; ++decision) {
        (void)policy(snapshot, random);
        tenths.insert(static_cast<int>(10 * snapshot.asked_where));
    }
    BOOST_TEST(snapshot.asked_parts == 128u);
    BOOST_TEST(tenths.size() == 10u);
}

BOOST_AUTO_TEST_CASE(where_the_part_asked_has_no_room_the_least_committed_machine_is_the_answer)
{
    Described snapshot = described(800, {{10, 10}, {20, 10}, {60, 10}});
    snapshot.empty_part = true;
    snapshot.least = 2;
    RandomSource random(3);
    BOOST_TEST(scheduling_policy("least_committed").value()(snapshot, random) == 2u);
}

BOOST_AUTO_TEST_CASE(a_part_of_the_fleet_is_the_share_of_the_list_that_was_asked_for)
{
    std::vector<std::size_t> found;
    double where = 0;
    SchedulerParams params;
    params.custom = [&](PlacementSnapshot const& machines, RandomSource&) {
        std::array<std::size_t, 4> positions{};
        found.assign(positions.begin(), positions.begin() + machines.lowest(positions, 2, where));
        return found.front();
    };
    auto const first = place(params, {10, 20, 30, 40}, 1);
    BOOST_TEST(first.at("0") == 1);
    where = 0.9;
    auto const second = place(params, {10, 20, 30, 40}, 1);
    BOOST_TEST(second.at("2") == 1);
    BOOST_TEST(found.size() == 2u);
}

BOOST_AUTO_TEST_CASE(without_others_the_least_committed_machine_is_the_answer)
{
    Described snapshot;
    snapshot.machines.resize(5);
    RandomSource random(3);
    BOOST_TEST(scheduling_policy("least_committed").value()(snapshot, random) == 0u);
}

BOOST_AUTO_TEST_CASE(sessions_that_somebody_else_placed_are_noticed)
{
    Scheduler scheduler;
    scheduler.set_servers({ServerSpec("a"), ServerSpec("b")});
    auto const report = [&](char const* name, int sessions, int time) {
        LoadReport idle(0);
        idle.sessions = sessions;
        idle.starting = 0;
        scheduler.report(name, idle, start + seconds(time));
    };
    report("a", 0, 0);
    report("b", 0, 0);
    std::uint64_t const before = scheduler.place(start).value().decision;
    report("a", 5, 5);
    report("b", 5, 5);
    std::uint64_t const after = scheduler.place(start + seconds(5)).value().decision;
    BOOST_TEST(scheduler.explain(before)->unseen_arrivals == 0);
    // Others placed nine of ten: 9 in 30 s, not yet reported for half of 5 s and a second on average.
    BOOST_TEST(scheduler.explain(after)->unseen_arrivals == 9.0 / 30 * 3.5,
               boost::test_tools::tolerance(0.01));
}

BOOST_AUTO_TEST_CASE(a_policy_of_your_own_decides)
{
    SchedulerParams params = with_policy("fullest");
    params.custom = [](PlacementSnapshot const& machines, RandomSource&) {
        std::size_t fullest = 0;
        for (std::size_t position = 1; position != machines.size(); ++position)
            if (machines[position].load > machines[fullest].load)
                fullest = position;
        return fullest;
    };
    auto const placed = place(params, {10, 80, 30}, 5);
    BOOST_TEST(placed.at("1") == 5);
}

BOOST_AUTO_TEST_CASE(a_policy_that_chooses_nobody_known_fails_and_commits_nothing)
{
    SchedulerParams params;
    params.custom = [](PlacementSnapshot const& machines, RandomSource&) { return machines.size(); };
    auto scheduler = Scheduler::make(params).value();
    scheduler.set_servers({ServerSpec("a")});
    scheduler.report("a", LoadReport(0), start);
    auto const placement = scheduler.place(start);
    BOOST_REQUIRE(placement.has_error());
    BOOST_TEST((placement.error() == errc::invalid_argument));
    BOOST_TEST(scheduler.machines(start).front().pending == 0);
}

BOOST_AUTO_TEST_CASE(an_unknown_policy_is_refused_by_name)
{
    BOOST_REQUIRE(scheduling_policy("fastest").has_error());
    BOOST_TEST(scheduling_policy("fastest").error().detail().find("\"fastest\"") != std::string::npos);
}

BOOST_AUTO_TEST_SUITE_END()
