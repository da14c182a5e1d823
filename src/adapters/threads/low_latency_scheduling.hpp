// The event loop's thread among all others that want a processor.
#pragma once

namespace webots_cloud::adapters {

/// For the thread of an event loop: from now on it waits for a processor as briefly as the kernel allows, and
/// works in shorter turns for it; its share of the processor stays the same.
///
/// Threads and processes that it starts don't inherit that, nor a negative nice value. Without effect on
/// Linux before 6.12, and where the thread has another scheduling policy than the normal one.
void use_low_latency_scheduling() noexcept;

} // namespace webots_cloud::adapters
