// What of the file system a simulation server needs.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/own_files.hpp>

#include <filesystem>
#include <vector>

namespace webots_cloud::core {

/// What a configuration does not say. All paths are absolute.
struct SimulationFilesContext
{
    SimulationFilesContext() = default;

    std::filesystem::path config_file;         ///< Where the configuration comes from.
    std::filesystem::path socket;              ///< The operator's.
    std::filesystem::path instances;           ///< The directories of simulations.
    std::filesystem::path caches;              ///< What is fetched from servers; of all ports.
    std::filesystem::path templates;           ///< Of websites.
    std::vector<std::filesystem::path> groups; ///< Where control groups are made.
};

/// The files and folders that threads of a simulation server with this configuration open while it runs, but
/// for those that start programs and look at them. All paths must be absolute.
///
/// Of what somebody may replace while the server runs it is the folder, as of `session_server_files`.
OwnFiles simulation_server_files(SimulationConfig const& config, SimulationFilesContext const& context);

} // namespace webots_cloud::core
