// The resource usage of process trees, from proc(5).
#pragma once

#include <webots_cloud/transport/host_metrics.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <sys/types.h>

#include <cstddef>
#include <cstdint>

namespace webots_cloud::adapters {

/// The usage of `root` and its descendants, of `max_processes` at most; nothing when `root` has ended.
///
/// With more than `enough_memory` of their own, what they share is divided among them. `graphics`: null:
/// nothing is known of graphics processors.
///
/// Reads two small files for each process: not for the event loop.
ProcessUsage process_usage(pid_t root, std::size_t max_processes = 256,
                           std::uint64_t enough_memory = ~std::uint64_t{0},
                           GraphicsTimes const* graphics = nullptr);

} // namespace webots_cloud::adapters
