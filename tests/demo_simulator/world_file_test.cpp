#include "vrml.hpp"
#include "world_file.hpp"

#include <boost/test/unit_test.hpp>

#include <fstream>
#include <iterator>
#include <random>

using namespace webots_cloud::demo;

namespace {

std::string const arena_file = WEBOTS_DEMO_PROJECTS "/robots/worlds/arena.wbt";

std::string text_of(std::string const& file)
{
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

} // namespace

BOOST_AUTO_TEST_SUITE(world_file)

BOOST_AUTO_TEST_CASE(the_demo_world_is_read)
{
    World const world = world_from_file(arena_file);
    BOOST_TEST(world.warnings.empty());
    BOOST_TEST(world.version == "R2025a");
    BOOST_TEST(world.title == "Robots in an arena");
    BOOST_TEST(world.time_step == 32);
    BOOST_TEST(world.size.x == 2.4);
    BOOST_TEST(world.size.y == 1.8);
    BOOST_REQUIRE(world.robots.size() == 4u);
    BOOST_TEST(world.robots[1].name == "red");
    BOOST_TEST(world.robots[1].pose.position.x == 0.7);
    BOOST_TEST(world.robots[1].pose.heading == -2.6);
    BOOST_TEST(world.robots[1].colour.red == 0.88);
    BOOST_REQUIRE(world.boxes.size() == 2u);
    BOOST_TEST(world.boxes[1].outline.half.x == 0.25);
}

BOOST_AUTO_TEST_CASE(every_demo_world_is_read_without_warnings)
{
    for (char const* file : {"/robots/worlds/duel.wbt", "/robots/worlds/corridor.wbt"})
        BOOST_TEST(world_from_file(std::string(WEBOTS_DEMO_PROJECTS) + file).warnings.empty(), file);
}

BOOST_AUTO_TEST_CASE(a_world_of_another_kind_gets_robots_and_a_warning)
{
    World const world =
        world_from_text("#VRML_SIM R2023b utf8\nWorldInfo { }\nDEF X Solid { children [ USE Y ] }\n");
    BOOST_TEST(world.robots.size() == 3u);
    BOOST_TEST(world.warnings.size() == 1u);
}

BOOST_AUTO_TEST_CASE(mistakes_are_named_by_line_and_what_came_before_is_kept)
{
    World const world = world_from_text("#VRML_SIM R2025a utf8\nXRobot { name \"a\" }\nXRobot {\n ] }\n");
    BOOST_REQUIRE(world.robots.size() == 1u);
    BOOST_REQUIRE(world.warnings.size() == 1u);
    BOOST_TEST(world.warnings[0].find("line 4") != std::string::npos, world.warnings[0]);
}

BOOST_AUTO_TEST_CASE(absurd_numbers_are_cut_to_sane_ones)
{
    World const world =
        world_from_text("#VRML_SIM R2025a utf8\nWorldInfo { basicTimeStep 1e300 FPS -4 }\n"
                        "XArena { floorSize 1e99 0 wallHeight nan }\nXRobot { translation -1e9 inf 0 }\n");
    BOOST_TEST(world.time_step == 1000);
    BOOST_TEST(world.frames_per_second == 1);
    BOOST_TEST(world.size.x == 100);
    BOOST_TEST(world.size.y == 0.5);
}

BOOST_AUTO_TEST_CASE(worlds_with_too_much_in_them_are_cut)
{
    std::string many = "#VRML_SIM R2025a utf8\n";
    for (int i = 0; i < 1000; ++i)
        many += "XRobot { } XBox { }\n";
    World const world = world_from_text(many);
    BOOST_TEST(world.robots.size() == max_robots);
    BOOST_TEST(world.boxes.size() == max_boxes);
    BOOST_TEST(!vrml::read("#VRML_SIM R2025a utf8\n" + std::string(5'000'000, '[')).problem.empty());
    std::string deep = "#VRML_SIM R2025a utf8\n";
    for (int i = 0; i < 100'000; ++i)
        deep += "G{c ";
    BOOST_TEST(!vrml::read(deep).problem.empty());
}

BOOST_AUTO_TEST_CASE(damaged_worlds_never_harm)
{
    std::string const good = text_of(arena_file);
    BOOST_REQUIRE(!good.empty());
    std::mt19937 random(7);
    for (int i = 0; i < 3000; ++i) {
        std::string damaged = good;
        for (int hits = 0; hits < 1 + i % 20; ++hits)
            damaged[random() % damaged.size()] = static_cast<char>(random() % 256);
        damaged.resize(random() % (damaged.size() + 1));
        World const world = world_from_text(damaged);
        BOOST_REQUIRE(!world.robots.empty());
        BOOST_REQUIRE(world.size.x >= 0.5 && world.size.x <= 100);
        BOOST_REQUIRE(world.time_step >= 1 && world.time_step <= 1000);
    }
}

BOOST_AUTO_TEST_CASE(releases_are_told_apart)
{
    BOOST_TEST(is_w3d_release("R2025a"));
    BOOST_TEST(is_w3d_release("R2023b"));
    BOOST_TEST(!is_w3d_release("R2023a"));
    BOOST_TEST(!is_w3d_release("R2021b"));
}

BOOST_AUTO_TEST_SUITE_END()
