// The folders and ports that a server uses: both doctors look at them, and so does `--check-config`.
#pragma once

#include "core/doctor/finding.hpp"
#include "core/doctor/machine_findings.hpp"
#include "core/doctor/network_findings.hpp"

#include <webots_cloud/config.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::app {

/// A folder that a server writes into, and makes if need be.
struct FolderUse
{
    FolderUse() = default;
    FolderUse(std::string subject, std::string key, std::filesystem::path folder, std::uint64_t wanted,
              bool is_essential)
        : subject(std::move(subject)), key(std::move(key)), folder(std::move(folder)), wanted(wanted),
          is_essential(is_essential)
    {}

    std::string subject;
    std::string key; ///< With its quotes, or the environment variable that names the folder.
    std::filesystem::path folder;
    std::uint64_t wanted = 0;  ///< Bytes.
    bool is_essential = false; ///< The server does not start without it.
};

std::vector<FolderUse> folders_of(SessionConfig const& config);
std::vector<FolderUse> folders_of(SimulationConfig const& config);

/// Where the server of a configuration writes its log; empty: to standard output.
std::filesystem::path log_file_of(SessionConfig const& config);
std::filesystem::path log_file_of(SimulationConfig const& config);

/// Whether this process has a file open that is there now. For the server itself, and its log.
/// Thread-safety: any thread.   Blocks where a network drive hangs.
bool has_open(std::filesystem::path const& file);

/// Thread-safety: any thread.   Blocks where a network drive hangs.
core::FolderReading read_folder(std::filesystem::path const& folder);

/// `port`, and `redirectPort` where there is one. `is_running`: a server with this configuration runs.
core::Findings port_findings(std::uint16_t port, NetworkConfig const& network, bool is_running);

/// For a server that does not run: the ports of its simulators; nothing where simulations are in containers.
core::Findings simulation_port_findings(SimulationConfig const& config);

/// Which of the folders for projects of websites can't be read; none with containers, which have no such
/// projects.   Blocks where a network drive hangs.
core::Findings website_findings(SimulationConfig const& config);

} // namespace webots_cloud::app
