// The arena as a scene that browsers draw themselves: X3D when they come, and updates of what has moved.
#include "scene.hpp"

#include "name_sign.hpp"
#include "text.hpp"

#include <boost/json.hpp>

#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>

namespace webots_cloud::demo {
namespace {

using namespace robot_model;

constexpr int first_fixed_id = 10;
constexpr int first_robot_id = 1000;
constexpr int ids_per_robot = 40;
constexpr int left_wheel_offset = 5;
constexpr int right_wheel_offset = 9;
constexpr int arrow_offset = 13;
constexpr int sign_offset = 17;

/// The angle of the camera that a viewer begins with, below the horizon, and its distance in each direction.
constexpr double camera_tilt = 0.7598;
constexpr double camera_height = 0.95; // where it is 1 away

std::string numbers(std::initializer_list<double> values)
{
    std::string text;
    for (double const value : values) {
        if (!text.empty())
            text += ' ';
        text += number_text(value);
    }
    return text;
}

std::string quoted(std::string_view name, std::string_view value)
{
    return std::string(" ").append(name).append("=\"").append(value).append("\"");
}

std::string id(int number)
{
    // Appended rather than added: g++ 12 warns of an overlap that is not there.
    return quoted("id", std::string("n").append(std::to_string(number)));
}

/// Scenes have linear colours; those of worlds are meant as pictures show them.
std::string colour_text(Colour const& c)
{
    constexpr double gamma = 2.2;
    return numbers({std::pow(c.red, gamma), std::pow(c.green, gamma), std::pow(c.blue, gamma)});
}

/// A turn as a quaternion with the real part `w`, which is not all of it, as axis and angle.
std::string axis_angle(double w, double x, double y, double z)
{
    double const length = std::sqrt(x * x + y * y + z * z);
    return numbers({x / length, y / length, z / length, 2 * std::atan2(length, w)});
}

/// A wheel turns about the robot's y axis; its cylinder stands along z, so that it is first laid down.
std::string wheel_rotation(double angle)
{
    // The quarter turn about x, then `angle` about y.
    double const c = std::cos(angle / 2) * std::numbers::sqrt2 / 2;
    double const s = std::sin(angle / 2) * std::numbers::sqrt2 / 2;
    return axis_angle(c, c, s, -s);
}

/// A robot's name faces the south, where the camera is as a viewer begins, wherever the robot goes.
std::string sign_rotation(double heading)
{
    // The tilt about x, then against the heading about z.
    double const tilt = (std::numbers::pi / 2 - camera_tilt) / 2;
    double const turn = -heading / 2;
    return axis_angle(std::cos(turn) * std::cos(tilt), std::cos(turn) * std::sin(tilt),
                      std::sin(turn) * std::sin(tilt), std::sin(turn) * std::cos(tilt));
}

class SceneWriter
{
public:
    explicit SceneWriter(Arena const& arena) : arena_(arena), w3d_(is_w3d_release(arena.world().version)) {}

    std::string write() &&
    {
        World const& world = arena_.world();
        text_ = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<X3D version=\"3.0\">\n<head>\n"
                "<meta name=\"generator\" content=\"webots_cloud demo simulator\" />\n<meta name=\"version\" "
                "content=\"" +
                xml_escaped(world.version) + "\" />\n</head>\n<Scene>\n";
        text_ += "<WorldInfo" + id(1) + quoted("title", xml_escaped(world.title)) +
                 quoted("basicTimeStep", std::to_string(world.time_step)) + "></WorldInfo>\n";
        write_viewpoint();
        text_ += "<Background" + id(3) + quoted("skyColor", "0.85 0.9 0.95") + "></Background>\n";
        text_ += "<DirectionalLight" + id(4) + quoted("direction", "0.4 0.5 -1") +
                 quoted("intensity", "3.6") + "></DirectionalLight>\n";
        write_room();
        for (GoalDescription const& goal : world.goals)
            write_box(goal.name, goal.outline, 0.002, goal.colour);
        for (BoxDescription const& box : world.boxes)
            write_box(box.name, box.outline, box.height, box.colour);
        for (std::size_t i = 0; i < arena_.robots().size(); ++i)
            write_robot(i);
        text_ += "</Scene>\n</X3D>\n";
        return std::move(text_);
    }

private:
    double away() const { return std::max(1.2 * arena_.world().size.x, 1.6 * arena_.world().size.y) + 0.45; }

    void write_viewpoint()
    {
        // South of the arena, looking north and down at the middle, and far enough away to see all of it in
        // pictures from 3:4 to 2:1, as phones have them: the angle of view is that of the longer side.
        text_ += "<Viewpoint" + id(2) + quoted("orientation", "-0.348 0.348 0.871 1.709") +
                 quoted("position", numbers({0, -away(), camera_height * away()})) +
                 quoted("fieldOfView", "0.785398") + "></Viewpoint>\n";
    }

    void write_room()
    {
        World const& world = arena_.world();
        Point const half = 0.5 * world.size;
        constexpr double thick = 0.015;
        Colour const grey{0.62, 0.66, 0.72};
        write_box("floor", {{{0, 0}, 0}, half}, -0.01, {0.955, 0.96, 0.97});
        write_tiles(half);
        write_box("north wall", {{{0, half.y + thick}, 0}, {half.x + 2 * thick, thick}}, world.wall_height,
                  grey);
        write_box("south wall", {{{0, -half.y - thick}, 0}, {half.x + 2 * thick, thick}}, world.wall_height,
                  grey);
        write_box("east wall", {{{half.x + thick, 0}, 0}, {thick, half.y}}, world.wall_height, grey);
        write_box("west wall", {{{-half.x - thick, 0}, 0}, {thick, half.y}}, world.wall_height, grey);
    }

    /// Just above the floor, so that nobody sees both at once.
    void write_tiles(Point half)
    {
        int const node = next_fixed_id_;
        next_fixed_id_ += 4;
        constexpr double above = 0.001;
        std::string points;
        std::string corners;
        int corner = 0;
        for (Rectangle const& tile : dark_tiles(half)) {
            for (Point const side : {Point{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
                Point const& centre = tile.pose.position;
                points +=
                    numbers({centre.x + side.x * tile.half.x, centre.y + side.y * tile.half.y, above}) + " ";
                corners += std::to_string(corner++) + " ";
            }
            corners += "-1 ";
        }
        write_shape(node, {0.88, 0.90, 0.925},
                    "<IndexedFaceSet" + id(node + 2) + quoted("coordIndex", corners) + "><Coordinate" +
                        id(node + 3) + quoted("point", points) + "></Coordinate></IndexedFaceSet>");
    }

    void open(std::string_view kind, int node, std::string_view name, std::string const& translation,
              std::string const& rotation, std::string const& more = {})
    {
        // R2023b and newer name the node's type; older clients know X3D's Transform with a flag.
        std::string const tag(w3d_ ? kind : std::string_view("Transform"));
        text_ += "<" + tag + id(node) + quoted("translation", translation) + quoted("rotation", rotation) +
                 quoted("name", xml_escaped(name));
        if (!w3d_)
            text_ += quoted("solid", "true");
        text_ += more + ">";
    }

    void close(std::string_view kind)
    {
        text_.append("</").append(w3d_ ? kind : std::string_view("Transform")).append(">\n");
    }

    void write_shape(int node, Colour const& colour, std::string const& geometry)
    {
        text_ += "<Shape" + id(node) + "><PBRAppearance" + id(node + 1) +
                 quoted("baseColor", colour_text(colour)) + quoted("roughness", "1") +
                 quoted("metalness", "0") + "></PBRAppearance>" + geometry + "</Shape>";
    }

    /// A negative height hangs the box below the floor.
    void write_box(std::string const& name, Rectangle const& outline, double height, Colour const& colour)
    {
        int const node = next_fixed_id_;
        next_fixed_id_ += 4;
        Point const centre = outline.pose.position;
        open("Solid", node, name, numbers({centre.x, centre.y, height / 2}),
             numbers({0, 0, 1, outline.pose.heading}));
        write_shape(node + 1, colour,
                    "<Box" + id(node + 3) +
                        quoted("size", numbers({2 * outline.half.x, 2 * outline.half.y, std::abs(height)})) +
                        "></Box>");
        close("Solid");
    }

    void write_cylinder(int node, Colour const& colour, double cylinder_radius, double cylinder_height)
    {
        write_shape(node, colour,
                    "<Cylinder" + id(node + 2) + quoted("radius", number_text(cylinder_radius)) +
                        quoted("height", number_text(cylinder_height)) + "></Cylinder>");
    }

    void write_wheel(int node, std::string_view name, double side, double angle)
    {
        open("Solid", node, name, numbers({0, side * axle / 2, wheel_radius}), wheel_rotation(angle));
        write_cylinder(node + 1, {0.1, 0.1, 0.12}, wheel_radius, 0.02);
        close("Solid");
    }

    /// On the body, towards the front.
    void write_arrow(int node)
    {
        constexpr double top = 0.02 + height + 0.001;
        std::string points;
        for (Point const corner : {Point{0.055, 0}, {-0.035, 0.038}, {-0.016, 0}, {-0.035, -0.038}})
            points += numbers({corner.x, corner.y, top}) + " ";
        write_shape(node, {1, 1, 1},
                    "<IndexedFaceSet" + id(node + 2) + quoted("coordIndex", "0 1 2 -1 0 2 3 -1") +
                        "><Coordinate" + id(node + 3) + quoted("point", points) +
                        "></Coordinate></IndexedFaceSet>");
    }

    /// As large as pictures show it. Webots' Billboard would be before the camera, wherever the robot is:
    /// this one stays above the robot, and a viewer that knows `billboard` turns it to whoever looks.
    void write_sign(int node, Robot const& robot)
    {
        double const high = 0.024 * away();
        double const half = 0.5 * sign_proportion(robot.description) * high;
        double const above = (radius * std::sin(camera_tilt) + 0.5 * high + 0.01) / std::cos(camera_tilt);
        open("Pose", node, "name", numbers({0, 0, 0.02 + height + above}), sign_rotation(robot.pose.heading),
             quoted("billboard", "true"));
        // Black, and lit by its own light: so it has the same colours on all sides.
        text_ += "<Shape" + id(node + 1) + quoted("castShadows", "false") + "><PBRAppearance" + id(node + 2) +
                 quoted("baseColor", "0 0 0") + quoted("roughness", "1") + quoted("metalness", "0") +
                 quoted("emissiveColor", "1 1 1") + ">";
        write_texture(node + 3, "baseColor", robot.description);
        write_texture(node + 4, "emissiveColor", robot.description);
        text_ += "</PBRAppearance><IndexedFaceSet" + id(node + 5) + quoted("coordIndex", "0 1 2 3 -1") +
                 quoted("texCoordIndex", "0 1 2 3 -1") + "><Coordinate" + id(node + 6) +
                 quoted("point", numbers({-half, -high / 2, 0, half, -high / 2, 0, half, high / 2, 0, -half,
                                          high / 2, 0})) +
                 "></Coordinate><TextureCoordinate" + id(node + 7) + quoted("point", "0 0 1 0 1 1 0 1") +
                 "></TextureCoordinate></IndexedFaceSet></Shape>";
        close("Pose");
    }

    void write_texture(int node, std::string_view role, RobotDescription const& robot)
    {
        text_ += "<ImageTexture" + id(node) + quoted("url", "&quot;" + sign_path(robot) + "&quot;") +
                 quoted("isTransparent", "true") + quoted(w3d_ ? "role" : "type", role) + "></ImageTexture>";
    }

    void write_robot(std::size_t index)
    {
        Robot const& robot = arena_.robots()[index];
        int const node = first_robot_id + static_cast<int>(index) * ids_per_robot;
        Point const position = robot.pose.position;
        open("Robot", node, robot.description.name, numbers({position.x, position.y, 0}),
             numbers({0, 0, 1, robot.pose.heading}));
        open("Pose", node + 1, "body", numbers({0, 0, 0.02 + height / 2}), "0 0 1 0");
        write_cylinder(node + 2, robot.description.colour, radius, height);
        close("Pose");
        write_wheel(node + left_wheel_offset, "left wheel", 1, robot.rotation.left);
        write_wheel(node + right_wheel_offset, "right wheel", -1, robot.rotation.right);
        write_arrow(node + arrow_offset);
        write_sign(node + sign_offset, robot);
        close("Robot");
    }

    Arena const& arena_;
    bool w3d_;
    int next_fixed_id_ = first_fixed_id;
    std::string text_;
};

boost::json::object node_update(int node)
{
    return {{"id", node}};
}

} // namespace

std::string scene_xml(Arena const& arena)
{
    return SceneWriter(arena).write();
}

std::string update_json(Arena const& arena)
{
    boost::json::array updates;
    for (std::size_t i = 0; i < arena.robots().size(); ++i) {
        Robot const& robot = arena.robots()[i];
        int const node = first_robot_id + static_cast<int>(i) * ids_per_robot;
        auto body = node_update(node);
        body["translation"] = numbers({robot.pose.position.x, robot.pose.position.y, 0});
        body["rotation"] = numbers({0, 0, 1, robot.pose.heading});
        updates.push_back(std::move(body));
        auto left = node_update(node + left_wheel_offset);
        left["rotation"] = wheel_rotation(robot.rotation.left);
        updates.push_back(std::move(left));
        auto right = node_update(node + right_wheel_offset);
        right["rotation"] = wheel_rotation(robot.rotation.right);
        updates.push_back(std::move(right));
        auto sign = node_update(node + sign_offset);
        sign["rotation"] = sign_rotation(robot.pose.heading);
        updates.push_back(std::move(sign));
    }
    boost::json::object state;
    state["time"] = arena.time();
    std::string const& version = arena.world().version;
    bool const old = !is_w3d_release(version) && version < "R2023a";
    state[old ? "poses" : "updates"] = std::move(updates);
    return "application/json:" + boost::json::serialize(state);
}

} // namespace webots_cloud::demo
