#define BOOST_TEST_MODULE demo_simulator
#include "arena.hpp"

#include <boost/test/unit_test.hpp>

using namespace webots_cloud::demo;

namespace {

World crowded_world()
{
    World world;
    world.size = {1.6, 1.2};
    for (int i = 0; i < 8; ++i) {
        RobotDescription robot;
        robot.name = "r" + std::to_string(i);
        robot.pose = {{-0.6 + 0.17 * i, i % 2 ? 0.3 : -0.3}, 0.8 * i};
        world.robots.push_back(robot);
    }
    BoxDescription box;
    box.outline = {{{0.1, 0}, 0.4}, {0.1, 0.05}};
    world.boxes.push_back(box);
    return world;
}

World lonely_world()
{
    World world;
    RobotDescription robot;
    robot.name = "blue";
    world.robots.push_back(robot);
    return world;
}

} // namespace

BOOST_AUTO_TEST_SUITE(arena)

BOOST_AUTO_TEST_CASE(robots_stay_inside_and_apart_for_ten_minutes)
{
    Arena arena(crowded_world());
    double const reach_x = 0.8 - robot_model::radius + 1e-9;
    double const reach_y = 0.6 - robot_model::radius + 1e-9;
    for (int step = 0; step < 600'000 / 32; ++step) {
        arena.step();
        for (Robot const& robot : arena.robots()) {
            BOOST_REQUIRE_LE(std::abs(robot.pose.position.x), reach_x);
            BOOST_REQUIRE_LE(std::abs(robot.pose.position.y), reach_y);
            for (Robot const& other : arena.robots())
                if (&robot != &other)
                    BOOST_REQUIRE_GT(length(robot.pose.position - other.pose.position),
                                     1.5 * robot_model::radius);
        }
    }
}

BOOST_AUTO_TEST_CASE(robots_keep_exploring)
{
    Arena arena(crowded_world());
    for (int minute = 0; minute < 5; ++minute) {
        std::vector<Point> lowest(arena.robots().size(), {9, 9});
        std::vector<Point> highest(arena.robots().size(), {-9, -9});
        for (int step = 0; step < 60'000 / 32; ++step) {
            arena.step();
            for (std::size_t i = 0; i < lowest.size(); ++i) {
                Point const p = arena.robots()[i].pose.position;
                lowest[i] = {std::min(lowest[i].x, p.x), std::min(lowest[i].y, p.y)};
                highest[i] = {std::max(highest[i].x, p.x), std::max(highest[i].y, p.y)};
            }
        }
        for (std::size_t i = 0; i < lowest.size(); ++i)
            BOOST_TEST(length(highest[i] - lowest[i]) > 0.4,
                       "robot " << i << " is stuck in minute " << minute);
    }
}

BOOST_AUTO_TEST_CASE(the_same_steps_give_the_same_poses_also_after_a_reset)
{
    Arena first(crowded_world());
    Arena second(crowded_world());
    for (int i = 0; i < 77; ++i)
        second.step();
    second.reset();
    for (int i = 0; i < 500; ++i) {
        first.step();
        second.step();
    }
    for (std::size_t i = 0; i < first.robots().size(); ++i) {
        BOOST_TEST(first.robots()[i].pose.position.x == second.robots()[i].pose.position.x);
        BOOST_TEST(first.robots()[i].pose.heading == second.robots()[i].pose.heading);
    }
    BOOST_TEST(first.time() == 500 * 32);
}

BOOST_AUTO_TEST_CASE(a_robot_remarks_on_the_wall_and_turns_before_it_touches)
{
    Arena arena(lonely_world());
    std::string remark;
    double nearest_wall = 9;
    for (int i = 0; i < 1000; ++i) {
        for (std::string const& line : arena.step())
            remark = line;
        Point const p = arena.robots()[0].pose.position;
        nearest_wall = std::min({nearest_wall, 1 - std::abs(p.x), 1 - std::abs(p.y)});
    }
    BOOST_TEST(remark == "robot blue: wall ahead");
    BOOST_TEST(nearest_wall > robot_model::radius + 0.005);
}

BOOST_AUTO_TEST_CASE(a_robot_sees_a_box_a_robot_and_nothing_behind_the_range)
{
    World world = lonely_world();
    RobotDescription other;
    other.name = "red";
    other.pose = {{-0.25, 0}, 0};
    world.robots.push_back(other);
    BoxDescription box;
    box.outline = {{{0.35, 0}, 0}, {0.05, 0.05}};
    world.boxes.push_back(box);
    Arena const arena(world);
    BOOST_TEST(arena.robots()[0].distances[3] == 0.3 - robot_model::radius,
               boost::test_tools::tolerance(1e-9));
    BOOST_TEST(arena.robots()[1].distances[3] == 0.25 - 2 * robot_model::radius,
               boost::test_tools::tolerance(1e-9));
    BOOST_TEST(arena.robots()[0].distances[0] == robot_model::sensor_range);
}

BOOST_AUTO_TEST_SUITE_END()
