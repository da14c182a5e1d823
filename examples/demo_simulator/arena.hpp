#pragma once

#include "geometry.hpp"
#include "world_file.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace webots_cloud::demo {

/// Measures of the one robot model, in metres, metres per second and radians.
namespace robot_model {
inline constexpr double radius = 0.075;
inline constexpr double height = 0.06;
inline constexpr double wheel_radius = 0.035;
inline constexpr double axle = 0.13;             ///< between the wheels
inline constexpr double top_speed = 0.35;        ///< of a robot that drives itself
inline constexpr double max_wheel_velocity = 20; ///< radians per second, of one that a program drives
inline constexpr double sensor_range = 0.45;     ///< from the body's edge
inline constexpr std::array<double, 7> sensor_angles{1.5, 0.85, 0.4, 0, -0.4, -0.85, -1.5};
} // namespace robot_model

struct Wheels
{
    double left = 0;
    double right = 0;
};

/// What a program tells a wheel's motor, as Webots has it.
struct WheelDrive
{
    double position = 0; ///< Radians, where it turns to and stops; infinite: it turns on.
    double velocity = 0; ///< Radians per second; its sign matters while the position is infinite.
};

struct Drive
{
    WheelDrive left;
    WheelDrive right;
};

struct Robot
{
    RobotDescription description;
    Pose pose;
    Wheels speed;    ///< metres per second
    Wheels rotation; ///< radians, -pi to pi
    Wheels turned;   ///< radians turned since the start
    Drive drive;     ///< of a robot that a program drives
    /// What each distance sensor measures from the body's edge: 0 to sensor_range.
    std::array<double, robot_model::sensor_angles.size()> distances{};
    int escape = 0;               ///< 1 or -1 while it turns away from something straight ahead
    std::int64_t next_remark = 0; ///< simulated milliseconds before which it says nothing
    bool has_arrived = false;     ///< in a goal, once
};

/// Simulates the robots of a world. Pure: no clock, no I/O, and the same steps always give the same poses.
class Arena
{
public:
    explicit Arena(World world);

    /// Advances by World::time_step. Returns console lines ("robot blue: wall ahead"), usually none.
    std::vector<std::string> step();

    /// What a robot does that a program drives, until it is told otherwise. At first, they stand.
    void drive(std::size_t robot, Drive const& drive) { robots_[robot].drive = drive; }

    /// Puts every robot back and the time to 0.
    void reset();

    void set_cruise(std::string const& robot, double cruise);

    std::int64_t time() const { return time_; } ///< simulated milliseconds
    World const& world() const { return world_; }
    std::vector<Robot> const& robots() const { return robots_; }

private:
    struct Sighting
    {
        double distance = none;
        std::string const* what = nullptr;
    };

    Sighting look(std::size_t robot, double angle) const;
    void sense(std::size_t robot);
    void steer(std::size_t robot);
    void obey(Robot& robot) const;
    bool arrives(Robot& robot) const;
    std::string remark(std::size_t robot);
    void move(Robot& robot) const;
    void separate();
    void keep_inside(Robot& robot) const;

    World world_;
    std::vector<Robot> robots_;
    std::int64_t time_ = 0;
};

} // namespace webots_cloud::demo
