// The priority of threads that work for long, beside those that answer.
#pragma once

namespace webots_cloud::adapters {

/// From now on the calling thread gets a third of the share of a thread that has not stepped back, where both want the same
/// core, and the event loop that wakes up there goes first. Processes that the thread starts inherit it.
void step_back() noexcept;

} // namespace webots_cloud::adapters
