// Where a simulation server keeps what it works with.
#pragma once

#include "core/config/state_folder.hpp"
#include "environment.hpp"

#include <webots_cloud/config.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::app {

/// What was fetched.
std::filesystem::path cache_folder(SimulationConfig const& config);

/// The candidates for `stateDir`, the best first.
std::vector<core::StateFolder> state_folders(SimulationConfig const& config);

} // namespace webots_cloud::app
