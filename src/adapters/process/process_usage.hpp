// The resource usage of process trees, from proc(5).
#pragma once

#include <webots_cloud/transport/process_host.hpp>

#include <sys/types.h>

#include <cstddef>

namespace webots_cloud::adapters {

/// The usage of `root` and its descendants, of `max_processes` at most; nothing when `root` has ended.
///
/// Reads two small files for each process: not for the event loop.
ProcessUsage process_usage(pid_t root, std::size_t max_processes = 256);

} // namespace webots_cloud::adapters
