// How a simulator is confined by bubblewrap: what it sees of the file system, as a command line.
#pragma once

#include "visible.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::core {

/// The simulator's home in the folder for temporary files.
inline constexpr char const* sandbox_home = "/tmp/home";
/// Its `XDG_RUNTIME_DIR`.
inline constexpr char const* sandbox_runtime = "/tmp/runtime";

/// The command line that runs `argv` so. It sees no other processes, has no capability and can't get any,
/// and dies with whoever started it. Of `/etc` it sees what libraries look up, and nothing that could be a
/// secret. Those files that it gets copies of must be open in the program: see `ProcessSpec::opened`.
///
/// The network is not bubblewrap's: see `ProcessNetwork`.
std::vector<std::string> bubblewrap_command(std::filesystem::path const& bubblewrap, Visible const& visible,
                                            std::vector<std::string> const& argv);

} // namespace webots_cloud::core
