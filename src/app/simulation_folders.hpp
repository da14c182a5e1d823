// Where a simulation server keeps what it works with.
#pragma once

#include "core/config/state_folder.hpp"
#include "environment.hpp"

#include <webots_cloud/config.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::app {

/// What was fetched with git; `state` is the folder of the working files.
std::filesystem::path cache_folder(SimulationConfig const& config, std::filesystem::path const& state);

/// Where it is if that one can't be used.
std::filesystem::path spare_cache_folder(SimulationConfig const& config, std::filesystem::path const& state);

/// The candidates for `stateDir`, the best first.
std::vector<core::StateFolder> state_folders(SimulationConfig const& config);

} // namespace webots_cloud::app
