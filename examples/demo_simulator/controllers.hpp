#pragma once

#include "world_file.hpp"

#include <filesystem>

namespace webots_cloud::demo {

/// Starts a world's controllers that are programs (`controllers/<name>/<name>`, executable)
/// beside the folder of the world, each in its own folder, as Webots does. They are not connected to the
/// robots, which the demo simulator drives itself; scripts for Webots are left alone, for want of its
/// libraries. What they print is printed.
void start_controllers(World const& world, std::filesystem::path const& world_file);

} // namespace webots_cloud::demo
