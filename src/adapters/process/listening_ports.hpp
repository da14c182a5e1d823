// Which TCP port a tree of processes listens on, as the kernel tells.
#pragma once

#include <sys/types.h>

#include <cstdint>

namespace webots_cloud::adapters {

/// The lowest port from `first` to `last` that `root` or a descendant of it listens on; 0: none, also when
/// the kernel does not tell.
///
/// The kernel is asked for sockets that listen on these ports, and tells of each its inode but not its
/// process. Only when there is one, the open files of the tree are looked at: whether it is its own, and not
/// of another simulation of the same user that was quicker to take the port. That look ends after 64
/// processes and 8,192 files, about 20 ms: a simulator with more of them may not be found ready.
/// Not for the event loop.
std::uint16_t listening_port(pid_t root, std::uint16_t first, std::uint16_t last);

} // namespace webots_cloud::adapters
