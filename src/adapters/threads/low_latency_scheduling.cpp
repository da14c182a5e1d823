#include "low_latency_scheduling.hpp"

#include <chrono>
#include <cstdint>
#include <linux/sched.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace webots_cloud::adapters {
namespace {

// The shortest turn that the kernel grants. Its scheduler (EEVDF) prefers the thread whose turn would end
// first, and one that wakes up for a short turn interrupts one that is in a long turn, by default of 3 ms.
constexpr std::chrono::nanoseconds min_turn = std::chrono::microseconds(100);

/// What sched_getattr(2) and sched_setattr(2) take: the first version of `struct sched_attr`, whose header
/// can't be included beside the C library's <sched.h>.
struct SchedulingAttributes
{
    std::uint32_t size = sizeof(SchedulingAttributes);
    std::uint32_t policy = 0;
    std::uint64_t flags = 0;
    std::int32_t nice = 0;
    std::uint32_t priority = 0;
    std::uint64_t runtime = 0; ///< Nanoseconds; of threads with the normal policy the length of a turn.
    std::uint64_t deadline = 0;
    std::uint64_t period = 0;
};

constexpr long this_thread = 0;
constexpr unsigned no_flags = 0;

} // namespace

void use_low_latency_scheduling() noexcept
{
    SchedulingAttributes attributes;
    if (::syscall(SYS_sched_getattr, this_thread, &attributes, attributes.size, no_flags) != 0 ||
        attributes.policy != SCHED_NORMAL)
        return;
    attributes.flags = SCHED_FLAG_RESET_ON_FORK;
    attributes.runtime = static_cast<std::uint64_t>(min_turn.count());
    (void)::syscall(SYS_sched_setattr, this_thread, &attributes, no_flags);
}

} // namespace webots_cloud::adapters
