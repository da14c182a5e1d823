// The robots of a world and how they move, step by step: driven by their programs, or else steered by what
// their sensors see.
#include "arena.hpp"

#include <algorithm>
#include <numbers>

namespace webots_cloud::demo {
namespace {

using namespace robot_model;

constexpr std::size_t ahead = sensor_angles.size() / 2;
constexpr std::int64_t quiet_time = 3000; ///< simulated milliseconds between two remarks of a robot

double nearness(Robot const& robot, std::size_t sensor)
{
    return 1 - robot.distances[sensor] / sensor_range;
}

bool is_programmed(Robot const& robot)
{
    return !robot.description.program.empty();
}

/// Metres per second. A motor that turns to a position slows down in the last step, so as to meet it.
double driven_speed(WheelDrive const& wheel, double turned, double seconds)
{
    if (std::isinf(wheel.position))
        return wheel_radius * wheel.velocity;
    double const reach = std::abs(wheel.velocity) * seconds;
    return wheel_radius * std::clamp(wheel.position - turned, -reach, reach) / seconds;
}

} // namespace

Arena::Arena(World world) : world_(std::move(world))
{
    reset();
}

void Arena::set_cruise(std::string const& robot, double cruise)
{
    for (Robot& each : robots_)
        if (each.description.name == robot)
            each.description.cruise = cruise;
}

void Arena::reset()
{
    time_ = 0;
    robots_.clear();
    for (RobotDescription const& description : world_.robots) {
        Robot robot;
        robot.description = description;
        robot.pose = description.pose;
        robots_.push_back(std::move(robot));
    }
    separate();
    for (std::size_t i = 0; i < robots_.size(); ++i)
        sense(i);
}

std::vector<std::string> Arena::step()
{
    time_ += world_.time_step;
    for (std::size_t i = 0; i < robots_.size(); ++i)
        is_programmed(robots_[i]) ? obey(robots_[i]) : steer(i);
    for (Robot& robot : robots_)
        move(robot);
    separate();
    std::vector<std::string> remarks;
    for (std::size_t i = 0; i < robots_.size(); ++i) {
        sense(i);
        if (std::string text = remark(i); !text.empty())
            remarks.push_back(std::move(text));
    }
    return remarks;
}

/// What a robot says of its own accord. Where a program drives it, that is the program's business, except for
/// the success.
std::string Arena::remark(std::size_t index)
{
    Robot& robot = robots_[index];
    if (is_programmed(robot)) {
        if (!arrives(robot))
            return {};
        auto const tenths = (time_ + 50) / 100;
        return "You did it: " + std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + " s" +
               (robots_.size() > 1 ? " (" + robot.description.name + ")" : "");
    }
    if (nearness(robot, ahead) < 0.5 || time_ < robot.next_remark)
        return {};
    robot.next_remark = time_ + quiet_time;
    Sighting const sighting = look(index, 0);
    return sighting.what ? "robot " + robot.description.name + ": " + *sighting.what + " ahead" : "";
}

bool Arena::arrives(Robot& robot) const
{
    auto const& goals = world_.goals;
    if (robot.has_arrived)
        return false;
    robot.has_arrived = std::any_of(goals.begin(), goals.end(), [&robot](GoalDescription const& goal) {
        Point const local = goal.outline.to_local(robot.pose.position);
        return std::abs(local.x) <= goal.outline.half.x && std::abs(local.y) <= goal.outline.half.y;
    });
    return robot.has_arrived;
}

Arena::Sighting Arena::look(std::size_t index, double angle) const
{
    static std::string const wall = "wall";
    Pose const& pose = robots_[index].pose;
    Ray const ray{pose.position, unit(pose.heading + angle)};
    Sighting nearest{distance_to_room(ray, 0.5 * world_.size), &wall};
    auto const consider = [&nearest](double distance, std::string const& what) {
        if (distance < nearest.distance)
            nearest = {distance, &what};
    };
    for (BoxDescription const& box : world_.boxes)
        consider(distance_to_rectangle(ray, box.outline), box.name);
    for (std::size_t i = 0; i < robots_.size(); ++i)
        if (i != index)
            consider(distance_to_circle(ray, robots_[i].pose.position, radius), robots_[i].description.name);
    return nearest;
}

void Arena::sense(std::size_t index)
{
    for (std::size_t i = 0; i < sensor_angles.size(); ++i)
        robots_[index].distances[i] =
            std::clamp(look(index, sensor_angles[i]).distance - radius, 0.0, sensor_range);
}

/// A Braitenberg vehicle: what is near on one side speeds up the wheel of that side. What is straight ahead
/// makes it choose a side and keep to it until the way is free, or it would dither in front of a wall.
void Arena::steer(std::size_t index)
{
    Robot& robot = robots_[index];
    constexpr std::array<double, ahead> weights{0.15, 0.55, 0.8};
    double left = 0;
    double right = 0;
    for (std::size_t i = 0; i < ahead; ++i) {
        left += weights[i] * nearness(robot, i);
        right += weights[i] * nearness(robot, sensor_angles.size() - 1 - i);
    }
    double const front = std::max(
        {nearness(robot, ahead), 0.8 * nearness(robot, ahead - 1), 0.8 * nearness(robot, ahead + 1)});
    if (front > 0.45 && robot.escape == 0)
        robot.escape = right >= left ? 1 : -1;
    else if (front < 0.15)
        robot.escape = 0;

    // A slow sway, different for each robot, keeps them from circling for ever.
    double const seconds = static_cast<double>(time_) / 1000;
    double const sway =
        0.18 * std::sin(seconds * (0.45 + 0.07 * static_cast<double>(index)) + static_cast<double>(index));
    double const turn = robot.escape != 0 ? 0.6 * robot.escape : std::clamp(right - left, -0.8, 0.8) + sway;
    double const forward = std::max(0.08, 1 - 1.1 * front);
    double const speed = top_speed * 0.8 * (robot.description.cruise / default_cruise);
    robot.speed = {speed * (forward - turn), speed * (forward + turn)};
}

void Arena::obey(Robot& robot) const
{
    double const seconds = world_.time_step / 1000.0;
    robot.speed = {driven_speed(robot.drive.left, robot.turned.left, seconds),
                   driven_speed(robot.drive.right, robot.turned.right, seconds)};
}

void Arena::move(Robot& robot) const
{
    double const seconds = world_.time_step / 1000.0;
    double const turned = (robot.speed.right - robot.speed.left) / axle * seconds;
    double const travelled = (robot.speed.right + robot.speed.left) / 2 * seconds;
    // Along the chord of the arc, so that big time steps do not spiral outwards.
    robot.pose.position = robot.pose.position + travelled * unit(robot.pose.heading + turned / 2);
    robot.pose.heading = std::remainder(robot.pose.heading + turned, 2 * std::numbers::pi);
    robot.turned.left += robot.speed.left / wheel_radius * seconds;
    robot.turned.right += robot.speed.right / wheel_radius * seconds;
    robot.rotation = {std::remainder(robot.turned.left, 2 * std::numbers::pi),
                      std::remainder(robot.turned.right, 2 * std::numbers::pi)};
}

/// Moves overlapping robots apart, then out of boxes and walls. Walls come last: they never give way.
void Arena::separate()
{
    for (int round = 0; round < 3; ++round) {
        for (std::size_t i = 0; i < robots_.size(); ++i) {
            for (std::size_t j = i + 1; j < robots_.size(); ++j) {
                Point const apart = robots_[j].pose.position - robots_[i].pose.position;
                double const distance = length(apart);
                if (distance >= 2 * radius)
                    continue;
                Point const direction =
                    distance > 1e-9 ? (1 / distance) * apart : unit(static_cast<double>(j));
                Point const half_way = (radius - distance / 2) * direction;
                robots_[i].pose.position = robots_[i].pose.position - half_way;
                robots_[j].pose.position = robots_[j].pose.position + half_way;
            }
        }
        for (Robot& robot : robots_)
            keep_inside(robot);
    }
}

void Arena::keep_inside(Robot& robot) const
{
    Point& position = robot.pose.position;
    for (BoxDescription const& box : world_.boxes)
        position = position + push_out_of_rectangle(position, radius, box.outline);
    double const reach_x = world_.size.x / 2 - radius;
    double const reach_y = world_.size.y / 2 - radius;
    position = {std::clamp(position.x, -reach_x, reach_x), std::clamp(position.y, -reach_y, reach_y)};
}

} // namespace webots_cloud::demo
