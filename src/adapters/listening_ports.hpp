// Which TCP ports a tree of processes listens on, as the kernel tells.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <vector>

namespace webots_cloud::adapters {

/// Ports on which `root` or a descendant of it listens, ascending. Empty as well when the kernel does not tell.
///
/// Costs one question to the kernel about listening sockets, and a look at the open files of these processes.
std::vector<std::uint16_t> listening_ports(pid_t root);

} // namespace webots_cloud::adapters
