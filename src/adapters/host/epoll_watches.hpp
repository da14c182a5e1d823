// Whether Asio can wait on this machine.
#pragma once

#include <webots_cloud/error.hpp>

namespace webots_cloud::adapters {

/// Whether the kernel has watches of epoll left for the user of this program, which all programs of a user
/// share. To be asked before anything waits by Asio: without watches that waits for ever, since Asio does not
/// check that it could watch what wakes it.
///
/// Errors: `unavailable`, with what to do.
/// Thread-safety: any thread.
result<> find_watches();

} // namespace webots_cloud::adapters
