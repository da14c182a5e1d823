#include "lock_step.hpp"

#include <boost/test/unit_test.hpp>

#include <cmath>
#include <limits>

using namespace webots_cloud::demo;

BOOST_AUTO_TEST_SUITE(lock_step)

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// One robot that a program drives, in the middle of a floor of 4 m.
Arena driven_arena()
{
    World world;
    world.size = {4, 4};
    RobotDescription robot;
    robot.name = "blue";
    robot.program = "drive.py";
    world.robots.push_back(robot);
    return Arena(std::move(world));
}

void step(Arena& arena, int count)
{
    for (int i = 0; i < count; ++i)
        arena.step();
}

} // namespace

BOOST_AUTO_TEST_CASE(requests_are_read)
{
    auto const request = parse_step_request("step 64 inf -2.5 1e-05 20.0");
    BOOST_REQUIRE(request.has_value());
    BOOST_TEST(request->duration == 64);
    BOOST_TEST(std::isinf(request->drive.left.position));
    BOOST_TEST(request->drive.left.velocity == -2.5);
    BOOST_TEST(request->drive.right.position == 1e-05);
    BOOST_TEST(request->drive.right.velocity == 20);
}

BOOST_AUTO_TEST_CASE(motors_have_a_top_speed)
{
    auto const request = parse_step_request("step 32 inf 1e9 inf -inf");
    BOOST_REQUIRE(request.has_value());
    BOOST_TEST(request->drive.left.velocity == robot_model::max_wheel_velocity);
    BOOST_TEST(request->drive.right.velocity == -robot_model::max_wheel_velocity);
}

BOOST_AUTO_TEST_CASE(what_is_no_request_is_refused)
{
    std::string const good = "step 32 0 0 0 0";
    BOOST_TEST(parse_step_request(good).has_value());
    for (std::string const& bad :
         {std::string(), std::string("step"), std::string("step 32 0 0 0"), good + " ", good + " 0",
          " " + good, good + '\0', std::string("step  32 0 0 0 0"), std::string("step 0 0 0 0 0"),
          std::string("step -1 0 0 0 0"), std::string("step 1000000001 0 0 0 0"),
          std::string("step 99999999999999999999 0 0 0 0"), std::string("step 32 nan 0 0 0"),
          std::string("step 32 0 0 0 nan"), std::string("step 32 0 x 0 0"), std::string("stop 32 0 0 0 0"),
          "step 32 0 0 0 0." + std::string(max_step_request, '0')})
        BOOST_TEST(!parse_step_request(bad).has_value(), bad);
}

BOOST_AUTO_TEST_CASE(a_program_is_greeted_and_told_what_its_robot_measures)
{
    Arena arena = driven_arena();
    BOOST_TEST(greeting(arena.world(), arena.world().robots.front()) == "robot 32 blue");
    BOOST_TEST(measurements(arena, 0) == "0 0.45 0.45 0.45 0.45 0.45 0.45 0.45 0 0 0 0 0");
    auto const line_break = [] {
        RobotDescription robot;
        robot.name = "a\nstep";
        return robot;
    }();
    BOOST_TEST(greeting(arena.world(), line_break) == "robot 32 a?step");
}

BOOST_AUTO_TEST_CASE(time_waits_for_programs_that_compute)
{
    LockStep programs;
    programs.reset(3); // the last has no program
    BOOST_TEST(programs.may_step());
    programs.begin(0);
    programs.begin(1);
    BOOST_TEST(!programs.may_step());
    BOOST_TEST(programs.ask(0, 0, 32));
    BOOST_TEST(!programs.ask(0, 0, 32), "asks twice");
    BOOST_TEST(!programs.ask(2, 0, 32), "has no program");
    BOOST_TEST(!programs.may_step());
    BOOST_TEST(programs.ask(1, 0, 50));
    BOOST_TEST(programs.may_step());
    BOOST_TEST(programs.due(16).empty());
    BOOST_TEST(programs.due(32) == std::vector<std::size_t>{0});
    BOOST_TEST(!programs.may_step());
    BOOST_TEST(programs.due(64) == std::vector<std::size_t>{1});
    programs.end(0);
    BOOST_TEST(!programs.may_step());
    programs.end(1);
    BOOST_TEST(programs.may_step());
}

BOOST_AUTO_TEST_CASE(a_robot_stands_until_it_is_told_to_move)
{
    Arena arena = driven_arena();
    step(arena, 100);
    BOOST_TEST(length(arena.robots().front().pose.position) == 0);
}

BOOST_AUTO_TEST_CASE(wheels_turn_on_or_to_a_position)
{
    Arena arena = driven_arena();
    Robot const& robot = arena.robots().front();
    arena.drive(0, {{infinity, 5}, {infinity, 5}});
    step(arena, 31); // 0.992 s
    BOOST_TEST(robot.turned.left == 5 * 0.992, boost::test_tools::tolerance(1e-9));
    BOOST_TEST(robot.pose.position.x == 5 * 0.992 * robot_model::wheel_radius,
               boost::test_tools::tolerance(1e-9));
    BOOST_TEST(robot.pose.position.y == 0);
    arena.drive(0, {{7, 2}, {0, -2}}); // there, and back to the beginning
    step(arena, 100);
    BOOST_TEST(robot.turned.left == 7, boost::test_tools::tolerance(1e-9));
    BOOST_TEST(std::abs(robot.turned.right) < 1e-9);
    BOOST_TEST(std::abs(robot.speed.left) < 1e-9);
}

BOOST_AUTO_TEST_CASE(a_robot_turns_as_its_wheels_do)
{
    Arena arena = driven_arena();
    arena.drive(0, {{infinity, -1}, {infinity, 1}});
    step(arena, 10);
    Robot const& robot = arena.robots().front();
    BOOST_TEST(robot.pose.heading == 0.32 * 2 * robot_model::wheel_radius / robot_model::axle,
               boost::test_tools::tolerance(1e-9));
    BOOST_TEST(length(robot.pose.position) < 1e-9);
}

BOOST_AUTO_TEST_CASE(who_reaches_the_goal_is_told_once_and_when)
{
    World world = driven_arena().world();
    GoalDescription goal;
    goal.outline = {{{1, 0}, 0}, {0.1, 0.1}};
    world.goals.push_back(goal);
    Arena arena(world);
    arena.drive(0, {{infinity, 20}, {infinity, 20}}); // 0.7 m/s: 0.9 m take 1.286 s
    std::vector<std::string> said;
    for (int i = 0; i < 60; ++i)
        for (auto const& line : arena.step())
            said.push_back(line);
    BOOST_REQUIRE(said.size() == 1U);
    BOOST_TEST(said.front() == "You did it: 1.3 s");

    world.robots.front().program.clear(); // who drives itself is not praised
    world.goals.front().outline = {{{0, 0}, 0}, {2, 2}};
    Arena unattended(world);
    for (int i = 0; i < 60; ++i)
        for (auto const& line : unattended.step())
            BOOST_TEST(!line.starts_with("You did it"), line);
}

BOOST_AUTO_TEST_SUITE_END()
