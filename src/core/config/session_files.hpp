// What of the file system a session server needs.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/own_files.hpp>

#include <filesystem>
#include <span>
#include <vector>

namespace webots_cloud::core {

/// What libraries read when a name is resolved, a certificate checked, memory allocated or a machine
/// measured.
std::span<char const* const> folders_of_libraries() noexcept;

/// Single files that either server reads while it runs: its configuration, and what that names. Empty paths
/// where there is none.
std::vector<std::filesystem::path> files_of_configuration(std::filesystem::path const& config_file,
                                                          NetworkConfig const& network,
                                                          AccessConfig const& access);

/// What either server reads: folders of libraries, those of `files_of_configuration`, and that of challenges.
std::vector<std::filesystem::path> read_by_each_server(std::filesystem::path const& config_file,
                                                       NetworkConfig const& network,
                                                       AccessConfig const& access);

/// The files and folders that a session server with this configuration opens while it runs. All paths must be
/// absolute. `config_file` is where the configuration comes from, `socket` the operator's.
///
/// Of what somebody may replace while the server runs, by renaming a new file to its name, it is the folder:
/// certificates, the configuration, and `/etc/resolv.conf`.
OwnFiles session_server_files(SessionConfig const& config, std::filesystem::path const& config_file,
                              std::filesystem::path const& socket);

} // namespace webots_cloud::core
