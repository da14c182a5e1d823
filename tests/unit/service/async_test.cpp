#include "unit_test.hpp"

#include "async/deadline.hpp"
#include "async/task_count.hpp"
#include "async/task_group.hpp"

#include <webots_cloud/testing/world.hpp>

using namespace webots_cloud;
using namespace std::chrono_literals;
namespace asio = boost::asio;

namespace {

asio::awaitable<result<int>> number_after(Clock& clock, Duration delay, int number)
{
    auto const waited = co_await clock.wait_until(clock.now() + delay);
    if (!waited)
        co_return waited.error();
    co_return number;
}

asio::awaitable<result<int>> with_two_seconds(Clock& clock, Duration delay)
{
    co_return co_await async::with_deadline(clock, clock.now() + 2s, number_after(clock, delay, 7));
}

asio::awaitable<void> nap(Clock& clock, Duration length, int& awake)
{
    (void)co_await clock.wait_until(clock.now() + length);
    ++awake;
}

asio::awaitable<void> wait_for_ever(async::Wakeup& event)
{
    (void)co_await event.wait();
}

} // namespace

BOOST_AUTO_TEST_SUITE(async_primitives)

BOOST_AUTO_TEST_CASE(a_deadline_lets_what_is_in_time_through_and_leaves_no_timer)
{
    testing::World world;
    BOOST_TEST(world.run(with_two_seconds(world.clock, 1s)).value() == 7);
    BOOST_TEST(world.clock.pending() == 0u);
}

BOOST_AUTO_TEST_CASE(a_deadline_cancels_what_is_late)
{
    testing::World world;
    auto const began = world.clock.now();
    BOOST_TEST((world.run(with_two_seconds(world.clock, 3s)).error() == errc::timed_out));
    BOOST_TEST((world.clock.now() - began == Duration(2s)));
    BOOST_TEST(world.clock.pending() == 0u);
}

BOOST_AUTO_TEST_CASE(a_task_count_waits_for_its_last_task)
{
    testing::World world;
    async::TaskCount tasks(world.executor());
    int awake = 0;
    for (auto const length : {2s, 1s, 3s})
        tasks.spawn(nap(world.clock, length, awake));
    world.run(tasks.join());
    BOOST_TEST(awake == 3);
    world.run(tasks.join()); // with nothing left, at once
}

BOOST_AUTO_TEST_CASE(a_deadlock_in_a_test_is_a_failure)
{
    testing::World world;
    async::TaskGroup tasks(world.executor());
    async::Wakeup never(world.executor());
    tasks.spawn(wait_for_ever(never));
    BOOST_CHECK_THROW(world.run(tasks.join()), std::logic_error);
    tasks.cancel_all();
    world.settle();
}

BOOST_AUTO_TEST_SUITE_END()
