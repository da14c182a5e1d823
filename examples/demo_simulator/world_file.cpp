// What this simulator understands of a world file: arena, robots, boxes, goals, controllers. Other nodes
// are passed over.
#include "world_file.hpp"

#include "text.hpp"
#include "vrml.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <numbers>
#include <stdexcept>

namespace webots_cloud::demo {
namespace {

constexpr std::array<Colour, 6> palette{Colour{0.16, 0.44, 0.86}, {0.88, 0.26, 0.21}, {0.20, 0.65, 0.33},
                                        {0.95, 0.68, 0.12},       {0.58, 0.34, 0.80}, {0.10, 0.66, 0.68}};

constexpr std::size_t max_world_file = std::size_t{16} << 20;

double number(vrml::Node const& node, std::string_view field, std::size_t index, double otherwise, double min,
              double max)
{
    auto const& numbers = node.field(field).numbers;
    return index < numbers.size() ? std::clamp(numbers[index], min, max) : otherwise;
}

std::string word(vrml::Node const& node, std::string_view field, std::string otherwise)
{
    auto const& words = node.field(field).words;
    return words.empty() ? std::move(otherwise) : printable(words.front(), 60);
}

Point floor_position(vrml::Node const& node)
{
    return {number(node, "translation", 0, 0, -50, 50), number(node, "translation", 1, 0, -50, 50)};
}

/// The turn about the vertical axis; a rotation about another axis counts as none.
double heading(vrml::Node const& node)
{
    double const up = number(node, "rotation", 2, 1, -1, 1);
    double const angle = number(node, "rotation", 3, 0, -100, 100);
    return std::abs(up) < 0.7 ? 0 : std::copysign(1.0, up) * angle;
}

Colour colour(vrml::Node const& node, Colour otherwise)
{
    return {number(node, "color", 0, otherwise.red, 0, 1), number(node, "color", 1, otherwise.green, 0, 1),
            number(node, "color", 2, otherwise.blue, 0, 1)};
}

bool is_robot(vrml::Node const& node)
{
    static constexpr std::array<std::string_view, 6> known{"E-puck",   "Thymio2",          "Pioneer3dx",
                                                           "Khepera3", "TurtleBot3Burger", "TIAGoBase"};
    bool const disembodied = node.type == "Robot" && node.field("children").nodes.empty();
    return (node.type.ends_with("Robot") && !disembodied) ||
           std::find(known.begin(), known.end(), node.type) != known.end();
}

bool may_be_programmed(vrml::Node const& node)
{
    return node.type == "TwoWheeledRobot" && !word(node, "controller", "").empty();
}

void read_world_info(World& world, vrml::Node const& node)
{
    world.title = word(node, "title", world.title);
    world.time_step = static_cast<int>(number(node, "basicTimeStep", 0, world.time_step, 1, 1000));
    world.frames_per_second = static_cast<int>(number(node, "FPS", 0, world.frames_per_second, 1, 100));
}

void read_arena(World& world, vrml::Node const& node, std::string_view size_field)
{
    world.size = {number(node, size_field, 0, world.size.x, 0.5, 100),
                  number(node, size_field, 1, world.size.y, 0.5, 100)};
    world.wall_height = number(node, "wallHeight", 0, world.wall_height, 0.01, 2);
}

void read_robot(World& world, vrml::Node const& node)
{
    if (world.robots.size() == max_robots) {
        world.warnings.push_back("only the first " + std::to_string(max_robots) + " robots are simulated");
        return;
    }
    std::size_t const index = world.robots.size();
    RobotDescription robot;
    robot.name = word(node, "name", "robot " + std::to_string(index + 1));
    robot.pose = {floor_position(node), heading(node)};
    robot.colour = colour(node, palette[index % palette.size()]);
    robot.controller = word(node, "controller", "avoid_walls");
    robot.may_be_programmed = may_be_programmed(node);
    world.robots.push_back(std::move(robot));
}

void read_box(World& world, vrml::Node const& node)
{
    if (world.boxes.size() == max_boxes)
        return;
    BoxDescription box;
    box.name = word(node, "name", "box");
    box.outline.pose = {floor_position(node), heading(node)};
    box.outline.half = {number(node, "size", 0, 0.2, 0.01, 50) / 2,
                        number(node, "size", 1, 0.2, 0.01, 50) / 2};
    box.height = number(node, "size", 2, 0.1, 0.01, 5);
    box.colour = colour(node, {0.76, 0.60, 0.42});
    world.boxes.push_back(std::move(box));
}

void read_goal(World& world, vrml::Node const& node)
{
    if (world.goals.size() == max_goals)
        return;
    GoalDescription goal;
    goal.name = word(node, "name", "goal");
    goal.outline.pose = {floor_position(node), heading(node)};
    goal.outline.half = {number(node, "size", 0, 0.3, 0.01, 50) / 2,
                         number(node, "size", 1, 0.3, 0.01, 50) / 2};
    goal.colour = colour(node, {0.3, 0.75, 0.4});
    world.goals.push_back(std::move(goal));
}

void read_controller(World& world, vrml::Node const& node)
{
    auto name = word(node, "controller", "");
    if (!name.empty() && !may_be_programmed(node) && world.controllers.size() < max_controllers)
        world.controllers.push_back(std::move(name));
}

void read_node(World& world, vrml::Node const& node)
{
    read_controller(world, node);
    if (node.type == "WorldInfo")
        read_world_info(world, node);
    else if (node.type.ends_with("Arena"))
        read_arena(world, node, "floorSize");
    else if (node.type == "Floor")
        read_arena(world, node, "size");
    else if (node.type.ends_with("Box") || node.type == "Wall")
        read_box(world, node);
    else if (node.type == "Goal")
        read_goal(world, node);
    else if (is_robot(node))
        read_robot(world, node);
}

void add_default_robots(World& world)
{
    constexpr std::array<char const*, 3> names{"blue", "red", "green"};
    double const ring = std::min(world.size.x, world.size.y) / 4;
    for (std::size_t i = 0; i < names.size(); ++i) {
        double const angle = 2 * std::numbers::pi * static_cast<double>(i) / names.size() + 0.3;
        RobotDescription robot;
        robot.name = names[i];
        robot.pose = {ring * unit(angle), angle + 2};
        robot.colour = palette[i];
        world.robots.push_back(std::move(robot));
    }
    world.warnings.push_back(
        "the world has no robot that the demo simulator knows: it shows three of its own");
}

} // namespace

World world_from_text(std::string_view text)
{
    vrml::Document const document = vrml::read(text);
    World world;
    if (document.version.empty())
        world.warnings.push_back("the first line is not '#VRML_SIM <release> utf8'");
    else
        world.version = printable(document.version, 16);
    for (vrml::Node const& node : document.nodes)
        read_node(world, node);
    if (!document.problem.empty())
        world.warnings.push_back("the rest of the world was not read: " + printable(document.problem));
    if (world.robots.empty())
        add_default_robots(world);
    return world;
}

World world_from_file(std::filesystem::path const& file)
{
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error))
        throw std::runtime_error("could not open file: '" + file.string() + "'");
    if (std::filesystem::file_size(file, error) > max_world_file || error)
        throw std::runtime_error("file is larger than 16 MiB: '" + file.string() + "'");
    std::ifstream stream(file, std::ios::binary);
    std::string const text{std::istreambuf_iterator<char>(stream), {}};
    if (!stream.is_open() || stream.bad())
        throw std::runtime_error("could not read file: '" + file.string() + "'");
    return world_from_text(text);
}

bool is_w3d_release(std::string_view version)
{
    // Releases are R<year><letter>, so their names sort by age.
    return version.size() != 6 || version[0] != 'R' || version >= "R2023b";
}

} // namespace webots_cloud::demo
