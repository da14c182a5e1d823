#include "unit_test.hpp"

#include "core/simulation/staging.hpp"

#include <algorithm>
#include <random>
#include <set>

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(staging)

namespace {

using core::Staging;
using Ids = std::vector<Staging::Id>;

core::StagedWorld staged_world(std::string address, int count, std::string mode = {})
{
    core::StagedWorld world;
    world.address = std::move(address);
    world.mode = std::move(mode);
    world.count = count;
    return world;
}

core::StagingRoom quiet_room(int seats = 10)
{
    core::StagingRoom room;
    room.seats = seats;
    return room;
}

/// A machine that does at once what is decided.
struct Machine
{
    explicit Machine(std::vector<core::StagedWorld> worlds, Duration max_age = 600s)
    {
        staging.apply(std::move(worlds), max_age);
    }

    /// The number of what was begun; 0: nothing.
    Staging::Id begin()
    {
        auto const plan = staging.plan(now, room);
        if (!plan.next)
            return 0;
        staging.begun(++last, *plan.next, now);
        staging.fetched(last, "commit 1");
        return last;
    }

    Staging::Id make_ready()
    {
        auto const id = begin();
        staging.ready(id, now);
        return id;
    }

    void make_all_ready()
    {
        while (make_ready() != 0)
            ;
    }

    Ids to_give_back() const { return staging.plan(now, room).give_back; }

    Staging staging;
    core::StagingRoom room = quiet_room();
    TimePoint now{};
    Staging::Id last = 0;
};

} // namespace

BOOST_AUTO_TEST_CASE(one_after_the_other_is_staged_until_there_are_enough)
{
    Machine machine({staged_world("a", 2), staged_world("b", 1, "mjpeg")});
    BOOST_TEST(machine.begin() == 1u);
    BOOST_TEST(machine.begin() == 0u); // the first one is not ready yet
    BOOST_TEST(!machine.staging.find("a", ""));
    machine.staging.ready(1, machine.now);
    machine.make_all_ready();
    BOOST_TEST(machine.last == 3u);
    BOOST_TEST(machine.staging.find("a", "").value() == 1u);
    BOOST_TEST(machine.staging.find("a", "w3d").value() == 1u); // the browser draws it, as without a mode
    BOOST_TEST(!machine.staging.find("a", "4d"));
    BOOST_TEST(!machine.staging.find("a", "mjpeg"));
    BOOST_TEST(machine.staging.find("b", "mjpeg").value() == 3u);
    BOOST_TEST(!machine.staging.find("b", "x3d"));
    BOOST_TEST(!machine.staging.find("c", ""));
}

BOOST_AUTO_TEST_CASE(what_a_browser_takes_is_replaced)
{
    Machine machine({staged_world("a", 1)});
    machine.make_all_ready();
    machine.staging.taken(1);
    machine.room.taken = 1;
    BOOST_TEST(!machine.staging.find("a", ""));
    BOOST_TEST(machine.make_ready() == 2u);
    BOOST_TEST(machine.staging.find("a", "").value() == 2u);
}

BOOST_AUTO_TEST_CASE(nothing_is_staged_while_browsers_start_or_memory_is_short)
{
    Machine machine({staged_world("a", 1)});
    machine.room.browser_starts = true;
    BOOST_TEST(machine.begin() == 0u);
    machine.room = quiet_room();
    machine.room.memory = Staging::much_memory;
    BOOST_TEST(machine.begin() == 0u);
    machine.room = quiet_room();
    BOOST_TEST(machine.begin() == 1u);
}

BOOST_AUTO_TEST_CASE(a_busy_machine_stages_seldom)
{
    Machine machine({staged_world("a", 2)});
    machine.room.load = Staging::busy_load;
    BOOST_TEST(machine.make_ready() == 1u);
    machine.now += Staging::busy_pause - 1s;
    BOOST_TEST(machine.begin() == 0u);
    machine.room.load = 100; // by whatever else the machine does
    machine.room.browsers = Staging::full_load;
    machine.now += 60s;
    BOOST_TEST(machine.begin() == 0u);
    machine.room.browsers = Staging::full_load - 1;
    BOOST_TEST(machine.begin() == 2u);
}

BOOST_AUTO_TEST_CASE(browsers_get_the_seats_of_staged_simulations_and_one_is_always_free)
{
    Machine machine({staged_world("a", 2), staged_world("b", 9)});
    machine.room.seats = 4;
    machine.make_all_ready();
    BOOST_TEST(machine.last == 3u);
    machine.room.taken = 1;
    BOOST_TEST(machine.to_give_back() == Ids{3}, boost::test_tools::per_element()); // "a" matters more
    machine.room.taken = 4;
    BOOST_TEST(machine.to_give_back() == (Ids{1, 2, 3}), boost::test_tools::per_element());
    BOOST_TEST(machine.staging.seats() == 3u); // until they have ended
    for (Staging::Id const id : {1, 2, 3}) {
        machine.staging.given_back(id);
        machine.staging.ended(id, machine.now);
    }
    BOOST_TEST(machine.staging.seats() == 0u);
    BOOST_TEST(machine.begin() == 0u);
    machine.room.taken = 2;
    BOOST_TEST(machine.begin() == 4u); // they had not failed
}

BOOST_AUTO_TEST_CASE(little_memory_has_one_after_the_other_given_back)
{
    Machine machine({staged_world("a", 2)});
    machine.make_all_ready();
    machine.room.memory = Staging::no_memory;
    BOOST_TEST(machine.to_give_back() == Ids{2}, boost::test_tools::per_element());
    machine.staging.given_back(2);
    BOOST_TEST(machine.to_give_back().empty()); // first it has to show
    machine.staging.ended(2, machine.now);
    BOOST_TEST(machine.to_give_back() == Ids{1}, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(old_ones_are_replaced_one_after_the_other)
{
    Machine machine({staged_world("a", 2)});
    machine.make_all_ready();
    machine.now += 599s;
    BOOST_TEST(machine.to_give_back().empty());
    machine.now += 1s;
    BOOST_TEST(machine.to_give_back() == Ids{1}, boost::test_tools::per_element());
    machine.staging.given_back(1);
    machine.staging.ended(1, machine.now);
    BOOST_TEST(machine.to_give_back() == Ids{2}, boost::test_tools::per_element());
    machine.staging.given_back(2);
    machine.staging.ended(2, machine.now);
    machine.make_all_ready();
    BOOST_TEST(machine.last == 4u);
}

BOOST_AUTO_TEST_CASE(those_of_another_commit_are_given_back_and_not_handed_out)
{
    Machine machine({staged_world("a", 1), staged_world("b", 1)});
    machine.make_all_ready();
    machine.staging.learned("a", "commit 1");
    BOOST_TEST(machine.to_give_back().empty());
    machine.staging.learned("a", "commit 2");
    BOOST_TEST(machine.to_give_back() == Ids{1}, boost::test_tools::per_element());
    BOOST_TEST(!machine.staging.find("a", ""));
    BOOST_TEST(machine.staging.find("b", "").has_value());
}

BOOST_AUTO_TEST_CASE(what_fails_is_tried_again_later_and_later_and_others_meanwhile)
{
    Machine machine({staged_world("a", 1), staged_world("b", 1)}, 24h);
    auto const fail = [&] {
        auto const id = machine.begin();
        machine.staging.ended(id, machine.now);
        return id;
    };
    BOOST_TEST(fail() == 1u);
    BOOST_TEST(machine.make_ready() == 2u);
    BOOST_TEST(machine.staging.find("b", "").has_value());
    BOOST_TEST(machine.begin() == 0u);
    machine.now += 1s;
    BOOST_TEST(fail() == 3u);
    machine.now += 1s;
    BOOST_TEST(machine.begin() == 0u);
    machine.now += 1s;
    BOOST_TEST(fail() == 4u);
    for (int i = 0; i < 40; ++i) {
        machine.now += Staging::longest_pause;
        BOOST_TEST(fail() != 0u);
    }
    machine.now += Staging::longest_pause - 1s;
    BOOST_TEST(fail() == 0u);
    machine.now += 1s;
    auto const id = machine.make_ready();
    machine.staging.taken(id); // a browser had it: all is well
    BOOST_TEST(fail() == id + 1);
    machine.now += 1s;
    BOOST_TEST(machine.begin() == id + 2);
}

BOOST_AUTO_TEST_CASE(what_fails_does_not_hold_up_what_stands_behind_it)
{
    Machine machine({staged_world("a", 1), staged_world("b", 1)});
    machine.staging.ended(machine.begin(), machine.now);
    machine.now += 60s; // so that "a" could be tried again
    machine.make_ready();
    BOOST_TEST(machine.staging.find("b", "").has_value());
}

BOOST_AUTO_TEST_CASE(what_ends_by_itself_when_it_is_ready_has_failed_too)
{
    Machine machine({staged_world("a", 1)});
    machine.staging.ended(machine.make_ready(), machine.now);
    BOOST_TEST(machine.begin() == 0u);
    machine.now += 1s;
    machine.staging.ended(machine.make_ready(), machine.now);
    machine.now += 1s;
    BOOST_TEST(machine.begin() == 0u);
}

BOOST_AUTO_TEST_CASE(another_configuration_and_the_end_of_the_server_have_them_given_back)
{
    Machine machine({staged_world("a", 2), staged_world("b", 1)});
    machine.make_all_ready();
    machine.staging.apply({staged_world("b", 1), staged_world("a", 1)}, 600s);
    BOOST_TEST(machine.to_give_back() == Ids{2}, boost::test_tools::per_element());
    machine.staging.apply({staged_world("b", 1)}, 600s);
    BOOST_TEST(machine.to_give_back() == (Ids{1, 2}), boost::test_tools::per_element());
    machine.room.is_open = false;
    BOOST_TEST(machine.to_give_back().size() == 3u);
    machine.staging.apply({}, 600s);
    BOOST_TEST(!machine.staging.is_idle());
    for (Staging::Id const id : {1, 2, 3})
        machine.staging.ended(id, machine.now);
    BOOST_TEST(machine.staging.is_idle());
}

// Whatever happens: browsers and staged simulations that stay never need more seats than there are, no world
// has too many, nothing is begun that is given back at once, and when all is quiet there are enough.
BOOST_AUTO_TEST_CASE(random_sequences_keep_the_promises)
{
    for (unsigned seed = 1; seed <= 300; ++seed)
        BOOST_TEST_CONTEXT("seed " << seed)
        {
            std::mt19937 random(seed);
            auto const below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
            Machine machine({staged_world("a", 1 + below(3)), staged_world("b", below(4))}, 1h);
            machine.room.seats = 1 + below(8);
            std::set<Staging::Id> ours;    // that are staged, or still end
            std::set<Staging::Id> leaving; // of these
            auto const seats = [&] { return machine.room.taken + static_cast<int>(ours.size()); };
            auto const act = [&] {
                auto const plan = machine.staging.plan(machine.now, machine.room);
                for (auto const id : plan.give_back) {
                    BOOST_TEST(ours.contains(id));
                    BOOST_TEST(leaving.insert(id).second);
                    machine.staging.given_back(id);
                }
                if (!plan.next)
                    return;
                BOOST_TEST(plan.give_back.empty());
                machine.staging.begun(++machine.last, *plan.next, machine.now);
                ours.insert(machine.last);
                BOOST_TEST(seats() < machine.room.seats); // one is left
            };
            auto const any_of = [&](std::set<Staging::Id> const& ids) {
                return *std::next(ids.begin(), below(static_cast<int>(ids.size())));
            };
            for (int step = 0; step < 200; ++step) {
                machine.now += std::chrono::milliseconds(below(2000));
                auto const what = below(8);
                if (what == 0 && machine.room.taken < machine.room.seats)
                    ++machine.room.taken;
                else if (what == 1 && machine.room.taken > 0)
                    --machine.room.taken;
                else if (what == 2 && !ours.empty())
                    machine.staging.ready(any_of(ours), machine.now);
                else if (what == 3 && !ours.empty()) {
                    auto const id = any_of(ours);
                    machine.staging.ended(id, machine.now);
                    ours.erase(id);
                    leaving.erase(id);
                } else if (what == 4 && machine.room.taken < machine.room.seats) {
                    auto const id = machine.staging.find("a", "");
                    if (id) {
                        BOOST_TEST(!leaving.contains(*id));
                        BOOST_TEST(ours.erase(*id) == 1u);
                        machine.staging.taken(*id);
                        ++machine.room.taken;
                    }
                } else if (what == 5)
                    machine.room.load = below(100);
                else if (what == 6)
                    machine.room.memory = below(100);
                act();
                BOOST_TEST(machine.staging.seats() == ours.size());
                auto const staying = static_cast<int>(ours.size() - leaving.size());
                BOOST_TEST(machine.room.taken + staying <= std::max(machine.room.seats, machine.room.taken));
            }
            for (auto const id : leaving) {
                machine.staging.ended(id, machine.now);
                ours.erase(id);
            }
            machine.room = quiet_room();
            for (auto const id : ours)
                machine.staging.ready(id, machine.now);
            machine.now += Staging::longest_pause;
            machine.make_all_ready();
            int wanted = 0;
            for (auto const& world : machine.staging.worlds())
                wanted += world.count;
            BOOST_TEST(static_cast<int>(machine.staging.seats()) == wanted);
        }
}

BOOST_AUTO_TEST_SUITE_END()
