#include "unit_test.hpp"

#include "core/classes/class_staging.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <random>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol section 13.20.
BOOST_AUTO_TEST_SUITE(class_staging)

namespace {

using core::ClassStaging;
using core::StagingMachine;
using core::StagingWish;

StagingWish wish_of(std::string url, int count)
{
    StagingWish wish;
    wish.url = std::move(url);
    wish.mode = "mjpeg";
    wish.count = count;
    return wish;
}

core::StagedFigure figure_of(std::string url, int ready, int taken = 0)
{
    core::StagedFigure figure;
    figure.url = std::move(url);
    figure.mode = "mjpeg";
    figure.ready = ready;
    figure.taken = taken;
    return figure;
}

struct Fixture
{
    void update(std::vector<StagingWish> const& classes) { staging.update(classes, machines, now); }

    /// What the machine is to have of a world.
    int wanted(std::string const& machine, std::string_view url = "a") const
    {
        for (auto const& wish : staging.wishes_for(machine))
            if (wish.url == url)
                return wish.count;
        return 0;
    }

    ClassStaging staging;
    std::vector<StagingMachine> machines{{"m1", 20}, {"m2", 20}};
    TimePoint now{};
};

} // namespace

BOOST_AUTO_TEST_CASE(seats_are_shared_where_most_is_free_and_no_machine_gets_more_than_it_takes)
{
    Fixture fixture;
    fixture.update({wish_of("a", 30)});
    BOOST_TEST(fixture.wanted("m1") == 15);
    BOOST_TEST(fixture.wanted("m2") == 15);
    fixture.update({wish_of("a", 30), wish_of("b", 30)});
    BOOST_TEST(fixture.wanted("m1", "a") == 15); // the class that was opened first keeps what it has
    BOOST_TEST(fixture.wanted("m1", "b") == 5);
    fixture.machines[0].room = 12;
    fixture.machines[1].room = 40;
    fixture.update({wish_of("a", 30), wish_of("b", 30)});
    BOOST_TEST(fixture.wanted("m1", "a") == 12);
    BOOST_TEST(fixture.wanted("m1", "b") == 0);
    BOOST_TEST(fixture.wanted("m2", "a") == 18);
    BOOST_TEST(fixture.wanted("m2", "b") == 22);
}

BOOST_AUTO_TEST_CASE(what_a_student_takes_is_not_made_again_nor_given_back_elsewhere)
{
    Fixture fixture;
    fixture.update({wish_of("a", 30)});
    fixture.staging.heard("m1", {figure_of("a", 15)});
    fixture.staging.heard("m2", {figure_of("a", 15)});
    fixture.update({wish_of("a", 25)}); // five were placed, and are on their way
    BOOST_TEST(fixture.wanted("m1") + fixture.wanted("m2") == 30);
    fixture.staging.heard("m1", {figure_of("a", 10, 5)});
    fixture.machines[0].room = 15; // as a report shows later
    fixture.now += 60s;
    fixture.update({wish_of("a", 25)});
    BOOST_TEST(fixture.wanted("m1") == 10);
    BOOST_TEST(fixture.wanted("m2") == 15);
    BOOST_TEST(fixture.staging.ready() == std::vector<int>{25}, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(who_does_not_take_it_has_it_given_back_after_a_while)
{
    Fixture fixture;
    fixture.update({wish_of("a", 10)});
    fixture.staging.heard("m1", {figure_of("a", 5)});
    fixture.staging.heard("m2", {figure_of("a", 3)});
    fixture.update({wish_of("a", 8)});
    fixture.now += ClassStaging::patience - 1s;
    fixture.update({wish_of("a", 6)}); // more are on their way: they have as long
    fixture.now += 1s;
    fixture.update({wish_of("a", 6)});
    BOOST_TEST(fixture.wanted("m1") + fixture.wanted("m2") == 10);
    fixture.now += ClassStaging::patience;
    fixture.update({wish_of("a", 6)});
    BOOST_TEST(fixture.wanted("m1") == 3);
    BOOST_TEST(fixture.wanted("m2") == 3); // what was not ready first
}

BOOST_AUTO_TEST_CASE(a_student_who_leaves_has_the_seat_made_ready_again)
{
    Fixture fixture;
    fixture.update({wish_of("a", 2)});
    fixture.staging.heard("m1", {figure_of("a", 0, 1)});
    fixture.staging.heard("m2", {figure_of("a", 0, 1)});
    fixture.update({wish_of("a", 0)});
    BOOST_TEST(fixture.staging.wishes_for("m1").empty());
    BOOST_TEST(fixture.staging.ready().empty()); // all seats are used: there is nothing to say
    fixture.update({wish_of("a", 1)});
    BOOST_TEST(fixture.wanted("m1") + fixture.wanted("m2") == 1);
}

BOOST_AUTO_TEST_CASE(a_class_that_ends_or_has_another_world_has_all_given_back_at_once)
{
    Fixture fixture;
    fixture.update({wish_of("a", 10), wish_of("b", 4)});
    fixture.update({wish_of("c", 10), wish_of("b", 4)});
    BOOST_TEST(fixture.wanted("m1", "a") == 0);
    BOOST_TEST(fixture.wanted("m1", "c") + fixture.wanted("m2", "c") == 10);
    BOOST_TEST(fixture.wanted("m1", "b") == 2);
    fixture.update({});
    BOOST_TEST(fixture.staging.wishes_for("m1").empty());
    BOOST_TEST(fixture.staging.wishes_for("m2").empty());
}

BOOST_AUTO_TEST_CASE(what_a_lost_machine_had_is_made_elsewhere_and_counts_as_ready_nowhere)
{
    Fixture fixture;
    fixture.update({wish_of("a", 10)});
    fixture.staging.heard("m1", {figure_of("a", 5, 2)});
    fixture.staging.heard("m2", {figure_of("a", 5)});
    fixture.staging.lost("m1");
    BOOST_TEST(fixture.staging.ready() == std::vector<int>{5}, boost::test_tools::per_element());
    fixture.staging.heard("m1", {figure_of("a", 1)}); // a new connection counts anew
    BOOST_TEST(fixture.wanted("m1") == 3);
    fixture.machines.erase(fixture.machines.begin());
    fixture.update({wish_of("a", 10)});
    BOOST_TEST(fixture.wanted("m2") == 10);
    BOOST_TEST(fixture.staging.ready() == std::vector<int>{5}, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(classes_with_one_world_share_what_is_ready_in_their_order)
{
    Fixture fixture;
    fixture.update({wish_of("a", 4), wish_of("a", 6)});
    BOOST_TEST(fixture.wanted("m1") == 5);
    fixture.staging.heard("m1", {figure_of("a", 5)});
    fixture.staging.heard("m2", {figure_of("a", 2)});
    BOOST_TEST(fixture.staging.ready() == (std::vector<int>{4, 3}), boost::test_tools::per_element());
    fixture.staging.heard("m2", {figure_of("a", 9999)}); // a machine may say anything
    BOOST_TEST(fixture.staging.ready() == (std::vector<int>{4, 6}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(without_machines_nothing_is_said)
{
    Fixture fixture;
    fixture.machines.clear();
    fixture.update({wish_of("a", 4)});
    BOOST_TEST(fixture.staging.ready().empty());
    fixture.staging.heard("m1", {figure_of("a", 5)});
    fixture.staging.lost("m1");
    BOOST_TEST(fixture.staging.ready().empty());
}

BOOST_AUTO_TEST_CASE(random_classes_and_machines_keep_the_promises)
{
    std::mt19937 random(1);
    auto const below = [&random](int most) {
        return static_cast<int>(random() % static_cast<unsigned>(most));
    };
    Fixture fixture;
    std::vector<StagingWish> classes;
    for (int step = 0; step < 5'000; ++step) {
        fixture.now += std::chrono::seconds(below(4));
        classes.clear();
        for (auto const* url : {"a", "b", "c"})
            if (below(4) != 0)
                classes.push_back(wish_of(url, below(12)));
        for (auto& machine : fixture.machines)
            machine.room = below(15);
        fixture.update(classes);
        for (auto const& machine : fixture.machines) {
            int sum = 0;
            for (auto const& wish : fixture.staging.wishes_for(machine.address)) {
                sum += wish.count;
                BOOST_TEST_REQUIRE(wish.count > 0);
                BOOST_TEST_REQUIRE(std::count_if(classes.begin(), classes.end(), [&](auto const& each) {
                                       return each.url == wish.url;
                                   }) == 1);
            }
            BOOST_TEST_REQUIRE(sum <= machine.room);
            fixture.staging.heard(machine.address,
                                  {figure_of("a", below(12), below(5)), figure_of("b", below(12))});
        }
        auto const ready = fixture.staging.ready();
        for (std::size_t i = 0; i < ready.size(); ++i)
            BOOST_TEST_REQUIRE((ready[i] >= 0 && ready[i] <= classes[i].count));
    }
}

BOOST_AUTO_TEST_SUITE_END()
