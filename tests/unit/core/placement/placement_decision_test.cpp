#include "unit_test.hpp"

#include <webots_cloud/scheduler.hpp>

#include <boost/json.hpp>

using namespace webots_cloud;
using std::chrono::seconds;

BOOST_AUTO_TEST_SUITE(placement_decision)

namespace {

TimePoint const start = TimePoint(std::chrono::hours(1));

std::vector<std::string> names(std::size_t count)
{
    std::vector<std::string> all;
    for (std::size_t machine = 0; machine != count; ++machine)
        all.push_back("machine-" + std::to_string(machine) + ".example.org:2000");
    return all;
}

/// A fleet on which other session servers place sessions too, so that every branch of the policies is taken.
Scheduler busy_fleet(std::string policy, std::size_t size, SchedulingPolicy custom = {})
{
    SchedulerParams params;
    params.policy = std::move(policy);
    params.custom = std::move(custom);
    auto scheduler = Scheduler::make(params).value();
    auto const machines = names(size);
    scheduler.set_servers(std::vector<ServerSpec>(machines.begin(), machines.end()));
    for (int round = 0; round != 3; ++round)
        for (std::size_t machine = 0; machine != size; ++machine) {
            LoadReport report(static_cast<double>(machine * 7919 % 60));
            report.sessions = round;
            report.starting = 0;
            scheduler.report(machines[machine], report, start + seconds(5 * round));
        }
    return scheduler;
}

TimePoint const after = start + seconds(11);

} // namespace

BOOST_AUTO_TEST_CASE(every_decision_can_be_replayed_from_its_record)
{
    for (char const* const policy : {"least_committed", "least_reported", "random", "power_of_two"})
        for (std::size_t const size : {1u, 5u, 64u, 65u, 1000u}) {
            Scheduler scheduler = busy_fleet(policy, size);
            for (int session = 0; session != 50; ++session)
                (void)scheduler.place(after);
            for (Decision const& decision : scheduler.decisions()) {
                if (decision.chosen.empty())
                    continue;
                BOOST_TEST(decision.complete);
                BOOST_TEST(scheduler.replay(decision).value() == decision.chosen,
                           policy << " among " << size << ", decision " << decision.id);
            }
        }
}

BOOST_AUTO_TEST_CASE(a_replay_does_not_depend_on_what_happened_since)
{
    Scheduler scheduler = busy_fleet("least_committed", 20);
    Decision const decision = scheduler.explain(scheduler.place(after).value().decision).value();
    scheduler.set_servers({ServerSpec("elsewhere")});
    for (int session = 0; session != 300; ++session)
        (void)scheduler.place(after);
    BOOST_TEST(scheduler.replay(decision).value() == decision.chosen);
    BOOST_TEST(!scheduler.explain(decision.id).has_value());
}

BOOST_AUTO_TEST_CASE(a_policy_that_looks_at_a_huge_fleet_is_recorded_in_part_and_says_so)
{
    auto const scan = [](PlacementSnapshot const& machines, RandomSource&) {
        std::size_t best = 0;
        for (std::size_t position = 0; position != machines.size(); ++position)
            if (machines[position].score < machines[best].score)
                best = position;
        return best;
    };
    Scheduler scheduler = busy_fleet("scan", 200, scan);
    Decision const decision = scheduler.explain(scheduler.place(after).value().decision).value();
    BOOST_TEST(!decision.complete);
    BOOST_TEST(decision.machines.size() == 64u);
    auto const replayed = scheduler.replay(decision);
    BOOST_REQUIRE(replayed.has_error());
    BOOST_TEST((replayed.error() == errc::not_found));
    Scheduler small = busy_fleet("scan", 60, scan);
    Decision const whole = small.explain(small.place(after).value().decision).value();
    BOOST_TEST(small.replay(whole).value() == whole.chosen);
}

BOOST_AUTO_TEST_CASE(a_policy_that_looked_at_more_than_is_recorded_is_not_replayed_by_guessing)
{
    auto const survey = [](PlacementSnapshot const& machines, RandomSource&) {
        double sum = 0;
        for (std::size_t position = 0; position != machines.size(); ++position)
            sum += machines[position].load;
        return sum < 0 ? std::size_t(1) : std::size_t(0);
    };
    Scheduler scheduler = busy_fleet("survey", 200, survey);
    Decision const decision = scheduler.explain(scheduler.place(after).value().decision).value();
    BOOST_REQUIRE(scheduler.replay(decision).has_error());
    BOOST_TEST((scheduler.replay(decision).error() == errc::not_found));
}

BOOST_AUTO_TEST_CASE(names_in_explanations_outlive_the_list_wherever_the_policy_looked)
{
    // Looks at the 64 that are recorded, and chooses another.
    auto const beyond = [](PlacementSnapshot const& machines, RandomSource&) {
        for (std::size_t position = 0; position != 64; ++position)
            (void)machines[position];
        return std::size_t(150);
    };
    Scheduler scheduler = busy_fleet("beyond", 200, beyond);
    Placement const placement = scheduler.place(after).value();
    Decision const before = scheduler.explain(placement.decision).value();
    for (char const* const prefix : {"others-", "more-", "again-"}) {
        std::vector<ServerSpec> others;
        for (std::string const& name : names(200))
            others.emplace_back(prefix + name);
        scheduler.set_servers(others);
    }
    Decision const later = scheduler.explain(placement.decision).value();
    BOOST_TEST(later.chosen == before.chosen);
    BOOST_REQUIRE(later.machines.size() == 64u);
    for (std::size_t entry = 0; entry != 64; ++entry)
        BOOST_TEST(later.machines[entry].address == before.machines[entry].address);
}

BOOST_AUTO_TEST_CASE(the_last_hundred_decisions_are_kept)
{
    Scheduler scheduler = busy_fleet("random", 64);
    for (int session = 0; session != 150; ++session)
        (void)scheduler.place(after);
    auto const decisions = scheduler.decisions();
    BOOST_REQUIRE(decisions.size() == 100u);
    BOOST_TEST(decisions.front().id == 51u);
    BOOST_TEST(decisions.back().id == 150u);
    BOOST_TEST(!scheduler.explain(50).has_value());
    BOOST_TEST(scheduler.explain(51)->id == 51u);
    BOOST_TEST(!scheduler.explain(151).has_value());
    BOOST_TEST(!scheduler.explain(0).has_value());
}

BOOST_AUTO_TEST_CASE(a_decision_tells_the_numbers_of_every_machine_and_why_it_was_refused)
{
    Scheduler scheduler;
    scheduler.set_servers({ServerSpec("idle"), ServerSpec("busy"), ServerSpec("lost"), ServerSpec("new")});
    scheduler.report("idle", LoadReport(10), start);
    scheduler.report("busy", LoadReport(97), start);
    scheduler.report("lost", LoadReport(0), start);
    scheduler.mark_unreachable("lost", start);
    scheduler.place(start).value();
    Decision const decision = scheduler.explain(scheduler.place(start).value().decision).value();

    BOOST_TEST(decision.chosen == "idle");
    BOOST_TEST(decision.policy == "least_committed");
    BOOST_TEST(decision.offered == 1u);
    BOOST_TEST(decision.refused[static_cast<std::size_t>(Refusal::load)] == 1u);
    BOOST_REQUIRE(decision.machines.size() == 4u);
    BOOST_TEST(decision.machines[0].machine.load == 10);
    BOOST_TEST(decision.machines[0].machine.pending == 1);
    BOOST_TEST(decision.machines[0].machine.committed == 22, boost::test_tools::tolerance(1e-9));
    BOOST_TEST((decision.machines[1].machine.refusal == Refusal::load));
    BOOST_TEST((decision.machines[2].machine.refusal == Refusal::lost));
    BOOST_TEST((decision.machines[3].machine.refusal == Refusal::unknown));
}

BOOST_AUTO_TEST_CASE(a_refusal_is_a_decision_too)
{
    Scheduler scheduler;
    scheduler.set_servers({ServerSpec("a")});
    BOOST_TEST(scheduler.place(start).has_error());
    Decision const decision = scheduler.decisions().back();
    BOOST_TEST(decision.chosen.empty());
    BOOST_TEST((scheduler.replay(decision).error() == errc::unavailable));
}

BOOST_AUTO_TEST_CASE(decisions_are_json_for_operators_newest_first)
{
    Scheduler scheduler;
    scheduler.set_servers({ServerSpec("a"), ServerSpec("b")});
    BOOST_TEST(decisions_json(scheduler, start) == R"({"decisions":[]})");
    scheduler.report("a", LoadReport(12.345), start);
    (void)scheduler.place(start);
    scheduler.mark_unreachable("a", start);
    (void)scheduler.place(start + seconds(2));

    auto const json = boost::json::parse(decisions_json(scheduler, start + seconds(3)));
    auto const& list = json.at("decisions").as_array();
    BOOST_REQUIRE(list.size() == 2u);
    BOOST_TEST(list[0].at("chosen").is_null());
    BOOST_TEST(list[0].at("secondsAgo").as_double() == 1);
    BOOST_TEST(list[0].at("refused").at("lost").to_number<int>() == 1);
    BOOST_TEST(list[0].at("complete").as_bool());
    BOOST_TEST(list[1].at("policy").as_string() == "least_committed");
    BOOST_TEST(list[1].at("random").as_string() == std::to_string(scheduler.explain(1)->random));
    BOOST_TEST(list[1].at("chosen").as_string() == "a");
    BOOST_TEST(list[1].at("machines").at(0).at("load").as_double() == 12.35,
               boost::test_tools::tolerance(1e-3));
    BOOST_TEST(list[1].at("machines").at(1).at("refused").as_string() == "unknown");
}

BOOST_AUTO_TEST_SUITE_END()
