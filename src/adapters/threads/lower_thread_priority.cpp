#include "lower_thread_priority.hpp"

#include <sys/resource.h>
#include <unistd.h>

namespace webots_cloud::adapters {
namespace {

// More would let projects starve where simulators keep every core busy.
constexpr int steps = 5;

} // namespace

void lower_thread_priority() noexcept
{
    // On Linux a thread has a priority of its own: that of the thread that started it, which may have lowered
    // its own. The process's is that of its first thread. A thread that is lower already stays as it is.
    auto const thread = static_cast<id_t>(::gettid());
    int const level = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::getpid())) + steps;
    if (::getpriority(PRIO_PROCESS, thread) < level)
        (void)::setpriority(PRIO_PROCESS, thread, level);
}

} // namespace webots_cloud::adapters
