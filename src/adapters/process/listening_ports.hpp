// Finds the TCP port that a tree of processes listens on.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

namespace webots_cloud::adapters {

/// The lowest port from `first` to `last` that `root` or a descendant of it listens on; 0: none, also when
/// the kernel does not report it.
///
/// The kernel is queried for sockets that listen on these ports, and reports each one's inode but not its
/// process. Only when there is one, the open files of the tree are searched for it, since it could belong to
/// another simulation of the same user that took the port first. That search ends after 64
/// processes and 8,192 files, about 20 ms: a simulator with more of them may not be found ready.
/// Not for the event loop.
std::uint16_t listening_port(pid_t root, std::uint16_t first, std::uint16_t last);

/// Whether anybody listens on the port in our network.
bool has_listener(std::uint16_t port);

/// Whether anybody in our network listens on the Unix socket that was bound by this name.
bool has_listener(std::string const& unix_socket);

} // namespace webots_cloud::adapters
