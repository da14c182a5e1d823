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
/// Whether they have more than `enough_memory` is found out exactly: where less can't be ruled out, what they
/// share is counted once, with files in memory (`shared_memory`). `graphics`: null: nothing is known of
/// graphics processors.
///
/// Reads two small files for each process, and near `enough_memory` much more: not for the event loop.
ProcessUsage process_usage(pid_t root, std::size_t max_processes = 256,
                           std::uint64_t enough_memory = ~std::uint64_t{0},
                           GraphicsTimes const* graphics = nullptr);

} // namespace webots_cloud::adapters
