// What process trees consume, as proc(5) tells it.
#pragma once

#include <webots_cloud/transport/process_host.hpp>

#include <sys/types.h>

#include <cstddef>

namespace webots_cloud::adapters {

/// The usage of `root` and what is below it, of `max_processes` at most; nothing when it has gone.
///
/// Reads two small files for each process: not for the event loop.
ProcessUsage process_usage(pid_t root, std::size_t max_processes = 256);

} // namespace webots_cloud::adapters
