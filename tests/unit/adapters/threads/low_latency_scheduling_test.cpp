#include "unit_test.hpp"

#include "adapters/threads/low_latency_scheduling.hpp"

#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <thread>

using namespace webots_cloud;
using adapters::use_low_latency_scheduling;

BOOST_AUTO_TEST_SUITE(low_latency_scheduling)

namespace {

/// The calling thread's time slice in nanoseconds: the sixth field of sched_getattr(2). 0 where the kernel
/// has one slice for all threads.
std::uint64_t length_of_turns()
{
    std::array<unsigned char, 48> attributes{};
    ::syscall(SYS_sched_getattr, 0, attributes.data(), static_cast<unsigned>(attributes.size()), 0u);
    std::uint64_t length = 0;
    std::memcpy(&length, attributes.data() + 24, sizeof length);
    return length;
}

struct Observed
{
    std::uint64_t before = 0;
    std::uint64_t after = 0;
    std::uint64_t of_child = 0;
    int policy = -1;
    int nice = -1;
};

/// Runs on a thread of its own, so that the test's own keeps its settings.
Observed observe(int nice)
{
    Observed observed;
    std::thread thread([&observed, nice] {
        ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), nice);
        observed.before = length_of_turns();
        use_low_latency_scheduling();
        observed.after = length_of_turns();
        observed.policy = ::sched_getscheduler(0);
        observed.nice = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()));
        std::thread child([&observed] { observed.of_child = length_of_turns(); });
        child.join();
    });
    thread.join();
    return observed;
}

} // namespace

BOOST_AUTO_TEST_CASE(turns_become_shorter_where_the_kernel_can_and_threads_it_starts_are_as_before)
{
    auto const observed = observe(0);
    if (observed.before == 0) {
        BOOST_TEST_MESSAGE("skipped: this kernel (before 6.12) knows only one length of turns");
        return;
    }
    BOOST_TEST(observed.after < observed.before);
    BOOST_TEST(observed.of_child == observed.before);
}

BOOST_AUTO_TEST_CASE(policy_and_priority_stay)
{
    auto const observed = observe(3);
    BOOST_TEST((observed.policy & ~SCHED_RESET_ON_FORK) == SCHED_OTHER);
    BOOST_TEST(observed.nice == 3);
}

BOOST_AUTO_TEST_SUITE_END()
