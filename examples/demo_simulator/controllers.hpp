#pragma once

#include "world_file.hpp"

#include <filesystem>

namespace webots_cloud::demo {

/// Starts a world's other controllers that are programs (`controllers/<name>/<name>`, executable): those of
/// supervisors, and of robots that drive themselves. Each runs in its own folder, as in Webots, but is not
/// connected to its robot, and time does not wait for it; scripts for Webots are left alone, for want of its
/// libraries. What they print is printed. Programs that drive robots: programs.hpp.
void start_controllers(World const& world, std::filesystem::path const& world_file);

} // namespace webots_cloud::demo
