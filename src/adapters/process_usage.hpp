// What process trees consume, as proc(5) tells it.
#pragma once

#include <webots_cloud/transport/process_host.hpp>

#include <sys/types.h>

namespace webots_cloud::adapters {

/// The usage of `root` and everything below it; nothing when it has gone.
ProcessUsage process_usage(pid_t root);

} // namespace webots_cloud::adapters
