#pragma once

#include "geometry.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::demo {

struct Colour
{
    double red = 0.5;
    double green = 0.5;
    double blue = 0.5;
};

inline constexpr double default_cruise = 8;
inline constexpr double max_cruise = 20;

/// What is to be done with the file of a program.
enum class ProgramKind
{
    executable,
    python,
    source ///< C or C++ that nobody has compiled yet
};

struct RobotDescription
{
    std::string name;
    Pose pose;
    Colour colour;
    std::string controller;         ///< Its name.
    bool may_be_programmed = false; ///< A TwoWheeledRobot whose controller the world names.
    std::filesystem::path program;  ///< What drives it; empty: it drives itself.
    ProgramKind program_kind{};
    double cruise = default_cruise; ///< How fast its wheels turn on a free way, radians per second.
};

/// A box that stands on the floor.
struct BoxDescription
{
    std::string name;
    Rectangle outline;
    double height = 0.1; ///< metres
    Colour colour;
};

/// A place on the floor that a robot whose program finds the way is praised for.
struct GoalDescription
{
    std::string name;
    Rectangle outline;
    Colour colour;
};

/// What the demo simulator understands of a Webots world; every other node is ignored.
struct World
{
    std::string version = "R2025a"; ///< release that the world's first line names
    std::string title = "Untitled world";
    int time_step = 32;         ///< WorldInfo.basicTimeStep, milliseconds, 1 to 1000
    int frames_per_second = 60; ///< WorldInfo.FPS, 1 to 100
    Point size{2, 2};           ///< floor of the arena, metres
    double wall_height = 0.12;
    std::vector<RobotDescription> robots; ///< at least one
    std::vector<BoxDescription> boxes;
    std::vector<GoalDescription> goals;
    std::vector<std::string> controllers; ///< names; not of robots that may be programmed
    std::vector<std::string> warnings;    ///< sentences for the console
};

inline constexpr std::size_t max_robots = 16;
inline constexpr std::size_t max_boxes = 64;
inline constexpr std::size_t max_goals = 8;
inline constexpr std::size_t max_controllers = 16;

/// Builds a world from the text of a world file. Never fails: what cannot be read is left at its default
/// and named in `warnings`; a world without robots gets three.
World world_from_text(std::string_view text);

/// Reads a world file of at most 16 MiB. Throws std::runtime_error with a sentence that names the file.
World world_from_file(std::filesystem::path const& file);

/// True for R2023b and newer: `w3d` instead of `x3d`, `updates` instead of `poses` (R2023a has both kinds).
bool is_w3d_release(std::string_view version);

} // namespace webots_cloud::demo
