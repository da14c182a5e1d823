// Lowers the priority of threads with long tasks.
#pragma once

namespace webots_cloud::adapters {

/// From now on the calling thread gets a third of the share of other threads, where both want the same
/// core, and the event loop that wakes up there goes first. Processes that the thread starts inherit it.
void lower_thread_priority() noexcept;

} // namespace webots_cloud::adapters
