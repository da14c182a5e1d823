// The processes of this machine, as proc(5) shows them to us.
#pragma once

#include "servers.hpp"

#include <webots_cloud/time.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace webots_cloud::site {

/// All that live and have a command line. One that only calls itself a server of ours has in its place what
/// it is.
std::vector<Process> all_processes();

/// Nothing: it has ended, even where nobody has waited for it, as in a container without an init.
std::optional<Process> read_process(pid_t id);

/// The same process still lives: another one with its number counts as its end.
bool is_alive(Process const& process);

/// Whether /proc keeps the processes of others from us (its option `hidepid`), and with them our own servers,
/// whose memory nobody may read (PR_SET_DUMPABLE).
bool are_hidden();

WallTime beginning_of(Process const& process);

/// The numbers of the sockets that a process has open; nothing of those that we may not look into.
std::vector<std::uint64_t> sockets_of(Process const& process);

} // namespace webots_cloud::site
