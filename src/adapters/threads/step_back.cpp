#include "step_back.hpp"

#include <sys/resource.h>
#include <unistd.h>

namespace webots_cloud::adapters {
namespace {

// More would let projects starve where simulators keep every core busy.
constexpr int nice_level = 5;

} // namespace

void step_back() noexcept
{
    // On Linux a thread has a priority of its own. One that is lower already stays as it is.
    auto const thread = static_cast<id_t>(::gettid());
    if (::getpriority(PRIO_PROCESS, thread) < nice_level)
        (void)::setpriority(PRIO_PROCESS, thread, nice_level);
}

} // namespace webots_cloud::adapters
