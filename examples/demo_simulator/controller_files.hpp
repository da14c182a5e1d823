#pragma once

#include "world_file.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// The files of the robots' controllers in the project: shown to the editor of a web page, and changed by it.
namespace webots_cloud::demo {

struct ControllerFile
{
    std::string name; ///< Without folder.
    std::string content;
};

/// The files of `controllers/<controller>` beside the folder of the world, the one that Webots runs first;
/// without `runtime.ini`, folders, links, and what is no text. Empty where there is no such controller.
std::vector<ControllerFile> controller_files(std::filesystem::path const& world_file,
                                             std::string const& controller);

/// Changes, or adds, a file of a controller that exists. Returns what is wrong, or nothing.
std::string save_controller_file(std::filesystem::path const& world_file, std::string const& controller,
                                 std::string const& file, std::string_view content);

/// Finds the program of each robot that may have one, in Webots' order: `controllers/<name>/<name>` if it is
/// executable, `<name>.py`, C or C++ that is not compiled yet.
void find_programs(World& world, std::filesystem::path const& world_file);

/// Has each robot that drives itself do so as fast as its controller says: a line `CRUISE = <number>` of
/// `controllers/<name>/<name>.py`, in radians per second. Adds to the warnings of the world.
void read_cruise(World& world, std::filesystem::path const& world_file);

} // namespace webots_cloud::demo
