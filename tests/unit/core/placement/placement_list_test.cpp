#include "placement_fixture.hpp"

#include <algorithm>

using namespace webots_cloud;
using namespace webots_cloud::placement_test;
using std::chrono::seconds;

BOOST_AUTO_TEST_SUITE(placement_list)

namespace {

std::string order_of(Scheduler const& scheduler, TimePoint now = start)
{
    std::string order;
    for (Candidate const& machine : scheduler.machines(now))
        order += std::string(order.empty() ? "" : " ").append(machine.address);
    return order;
}

/// A scheduler whose list changes at random, and what there should be in it.
struct ChangingFleet
{
    struct Machine
    {
        std::string address;
        TimePoint reported;
    };

    ChangingFleet() { scheduler.follow(list); }

    void add()
    {
        Machine machine{"m" + std::to_string(++last), now};
        std::size_t const at = random.below(expected.size() + 1);
        auto const place = expected.begin() + static_cast<std::ptrdiff_t>(at);
        list.put(ServerSpec(machine.address), place == expected.end() ? std::string() : place->address);
        scheduler.report(machine.address, report(), now);
        expected.insert(place, machine);
    }
    void remove()
    {
        std::size_t const at = random.below(expected.size());
        list.remove(expected[at].address);
        expected.erase(expected.begin() + static_cast<std::ptrdiff_t>(at));
    }
    void hear()
    {
        auto& machine = expected[random.below(expected.size())];
        machine.reported = now;
        scheduler.report(machine.address, report(), now);
    }
    LoadReport report() { return LoadReport(random.uniform() * 90); }

    /// Nothing of the indexes may point to another machine than before.
    void check()
    {
        auto const machines = scheduler.machines(now);
        BOOST_REQUIRE(machines.size() == expected.size());
        Candidate const* best = nullptr;
        for (std::size_t i = 0; i != machines.size(); ++i) {
            bool const is_old = now - expected[i].reported > scheduler_params.report_lifetime;
            BOOST_REQUIRE(machines[i].address == expected[i].address);
            BOOST_REQUIRE((machines[i].refusal == Refusal::stale) == is_old);
            bool const is_offered = machines[i].refusal == Refusal::none && !machines[i].overcommitted;
            if (is_offered && (!best || machines[i].score < best->score))
                best = &machines[i];
        }
        BOOST_REQUIRE(best);
        auto const placement = scheduler.place(now);
        BOOST_REQUIRE(placement.has_value());
        if (placement->address != best->address) { // scores are told apart to some digits
            auto const chosen = std::ranges::find(machines, placement->address, &Candidate::address);
            BOOST_REQUIRE(chosen != machines.end());
            BOOST_REQUIRE(chosen->score <= best->score * 1.00001);
        }
        auto const decision = scheduler.explain(placement->decision).value();
        std::size_t refused = 0;
        for (std::size_t const count : decision.refused)
            refused += count;
        BOOST_REQUIRE(refused == expected.size());
    }

    SchedulerParams scheduler_params;
    Fleet list;
    Scheduler scheduler;
    RandomSource random{3};
    TimePoint now = start;
    int last = 0;
    std::vector<Machine> expected;
};

} // namespace

BOOST_FIXTURE_TEST_CASE(machines_come_and_go_one_by_one_and_nothing_happens_to_the_others, Fixture)
{
    Fleet fleet;
    fleet.set({ServerSpec("a"), ServerSpec("b"), ServerSpec("c")});
    scheduler.follow(fleet);
    place(3);
    fleet.put(ServerSpec("ab"), "b");
    fleet.put(ServerSpec("d"));
    fleet.put(ServerSpec("e"), "nobody");
    BOOST_TEST(order_of(scheduler) == "a ab b c d e");
    BOOST_TEST((machine("ab").refusal == Refusal::unknown));
    for (char const* const name : {"a", "b", "c"})
        BOOST_TEST(machine(name).pending == 1, name);
    fleet.remove("b");
    fleet.remove("b");
    BOOST_TEST(order_of(scheduler) == "a ab c d e");
    BOOST_TEST(machine("c").pending == 1);
    BOOST_TEST(scheduler.placed("b") == 1u);
    fleet.put(ServerSpec("b"), "ab");
    BOOST_TEST(order_of(scheduler) == "a b ab c d e");
    BOOST_TEST(machine("b").pending == 0, "it counts as new");
    BOOST_TEST(scheduler.placed("b") == 1u);
}

BOOST_FIXTURE_TEST_CASE(a_known_machine_is_treated_in_another_way_and_keeps_its_reservations, Fixture)
{
    Fleet fleet;
    fleet.set({ServerSpec("a"), ServerSpec("b"), ServerSpec("c")});
    scheduler.follow(fleet);
    place(3);
    ServerSpec drained("a");
    drained.drain = true;
    fleet.put(drained);
    BOOST_TEST(order_of(scheduler) == "a b c");
    BOOST_TEST((machine("a").refusal == Refusal::draining));
    BOOST_TEST(machine("a").pending == 1);
    fleet.put(ServerSpec("a"), "");
    BOOST_TEST(order_of(scheduler) == "b c a");
    BOOST_TEST((machine("a").refusal == Refusal::none));
    BOOST_TEST(machine("a").pending == 1);
    fleet.put(ServerSpec("b"), "b");
    BOOST_TEST(order_of(scheduler) == "b c a");
}

BOOST_AUTO_TEST_CASE(a_list_that_grew_decides_as_one_that_was_set)
{
    Scheduler set;
    Scheduler grown;
    Fleet fleet;
    grown.follow(fleet);
    std::vector<ServerSpec> specs;
    for (int i = 0; i != 150; ++i) {
        specs.emplace_back("m" + std::to_string(i));
        fleet.put(specs.back());
    }
    set.set_servers(specs);
    RandomSource random(1);
    for (auto const& spec : specs) {
        auto const report = counted(random.uniform() * 50, 0);
        for (auto* const scheduler : {&set, &grown})
            scheduler->report(spec.address, report, start);
    }
    for (int i = 0; i != 500; ++i)
        BOOST_REQUIRE(set.place(start).value().address == grown.place(start).value().address);
}

BOOST_AUTO_TEST_CASE(whatever_comes_and_goes_the_best_machine_is_found_and_old_reports_are_not_believed)
{
    for (std::size_t const size : {40u, 64u, 65u, 200u}) {
        ChangingFleet fleet;
        while (fleet.expected.size() != size)
            fleet.add();
        for (int step = 0; step != 400; ++step) {
            fleet.now += std::chrono::milliseconds(500);
            for (std::size_t heard = 0; heard != size / 10; ++heard)
                fleet.hear();
            if (fleet.random.below(2) == 0)
                fleet.add();
            else
                fleet.remove();
            fleet.check();
        }
        while (!fleet.expected.empty())
            fleet.remove();
        BOOST_TEST(fleet.scheduler.free_seats(fleet.now) == 0u);
        BOOST_TEST(!fleet.scheduler.available(fleet.now));
    }
}

BOOST_AUTO_TEST_CASE(explanations_name_machines_that_have_left_however_many_have)
{
    Scheduler scheduler;
    Fleet fleet;
    scheduler.follow(fleet);
    fleet.put(ServerSpec("a machine with a long name"));
    scheduler.report("a machine with a long name", counted(0, 0), start);
    auto const placement = scheduler.place(start).value();
    fleet.remove("a machine with a long name");
    for (int i = 0; i != 2500; ++i) {
        auto const name = "another machine with a long name " + std::to_string(i);
        fleet.put(ServerSpec(name));
        fleet.remove(name);
    }
    BOOST_TEST(scheduler.explain(placement.decision).value().chosen == "a machine with a long name");
}

BOOST_FIXTURE_TEST_CASE(a_report_of_a_machine_that_is_not_in_the_list_says_so, OneMachine)
{
    BOOST_TEST(scheduler.report("a", LoadReport(10), start));
    BOOST_TEST(scheduler.mark_unreachable("a", start));
    BOOST_TEST(!scheduler.report("b", LoadReport(10), start));
    BOOST_TEST(!scheduler.report("b", LoadReport(-1), start), "one that is no load");
    BOOST_TEST(!scheduler.mark_unreachable("b", start));
}

BOOST_AUTO_TEST_SUITE_END()
