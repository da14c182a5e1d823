#include "unit_test.hpp"

#include "async/cancellation.hpp"
#include "async/deadline.hpp"
#include "async/first_of.hpp"
#include "async/interruptible.hpp"
#include "async/task_count.hpp"
#include "async/task_group.hpp"

#include <webots_cloud/testing/world.hpp>

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

using namespace webots_cloud;
using namespace std::chrono_literals;
namespace asio = boost::asio;

BOOST_AUTO_TEST_SUITE(async_primitives)

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

/// Ends after `delay`, or when it is cancelled: then it needs a second to tidy up. Adds its name to `story`.
asio::awaitable<result<>> part(Clock& clock, Duration delay, std::string name,
                               std::vector<std::string>& story)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    story.push_back(name + " begins");
    auto const waited = co_await clock.wait_until(clock.now() + delay);
    if (!waited) {
        co_await asio::this_coro::reset_cancellation_state(); // so that it can wait once more
        (void)co_await clock.wait_until(clock.now() + 1s);
    }
    story.push_back(name + (waited ? " ends" : " is cancelled"));
    co_return Failure(errc::not_found, name);
}

asio::awaitable<void> task(asio::awaitable<result<>> body)
{
    (void)co_await std::move(body);
}

/// Has a part for as long as it is not cancelled.
asio::awaitable<result<>> owner(Clock& clock, std::vector<std::string>& story)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    async::TaskGroup tasks(co_await asio::this_coro::executor);
    tasks.spawn(task(part(clock, 10s, "a", story)));
    auto const ended = co_await async::until_cancelled();
    co_await tasks.end();
    story.emplace_back("the owner ends");
    co_return ended;
}

asio::awaitable<result<>> break_after(Clock& clock, Duration delay)
{
    (void)co_await clock.wait_until(clock.now() + delay);
    throw std::runtime_error("broken");
}

asio::awaitable<result<int>> number_of(asio::awaitable<result<>> parts)
{
    auto const ended = co_await std::move(parts);
    co_return ended ? result<int>(0) : result<int>(ended.error());
}

/// Work that must come to its end, and what its caller can still do.
struct Story
{
    bool is_done = false;
    bool was_cancelled = false;
    bool was_cancelled_before = false;
    bool has_waited_again = false;
};

asio::awaitable<void> tidy_up(Clock& clock, Story& story, bool fails)
{
    (void)co_await clock.wait_until(clock.now() + 5s);
    story.was_cancelled = co_await async::is_cancelled();
    story.is_done = true;
    if (fails)
        throw std::runtime_error("broken");
}

asio::awaitable<result<>> caller(Clock& clock, Story& story, bool fails)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    try {
        co_await async::uncancellable(tidy_up(clock, story, fails));
    } catch (std::runtime_error const&) {
        // as it would have been without
    }
    story.was_cancelled_before = co_await async::is_cancelled();
    auto const waited = co_await clock.wait_until(clock.now() + 10s); // can be cancelled again
    story.has_waited_again = waited.has_value();
    co_return waited;
}

} // namespace

BOOST_AUTO_TEST_CASE(work_that_must_not_be_cancelled_comes_to_its_end_and_its_caller_knows)
{
    testing::World world;
    Story story;
    auto const began = world.clock.now();
    auto const ended = world.run(
        async::with_deadline(world.clock, began + 2s, number_of(caller(world.clock, story, false))));
    BOOST_TEST(story.is_done);
    BOOST_TEST(!story.was_cancelled);
    BOOST_TEST(story.was_cancelled_before);
    BOOST_TEST((ended.error() == errc::timed_out));
}

BOOST_AUTO_TEST_CASE(whoever_has_awaited_such_work_can_be_cancelled_as_before_also_when_it_has_failed)
{
    for (bool const fails : {false, true}) {
        testing::World world;
        Story story;
        auto const began = world.clock.now();
        auto const ended = world.run(
            async::with_deadline(world.clock, began + 7s, number_of(caller(world.clock, story, fails))));
        BOOST_TEST(story.is_done);
        BOOST_TEST(!story.was_cancelled_before);
        BOOST_TEST(!story.has_waited_again);
        BOOST_TEST((world.clock.now() - began == Duration(7s)));
        BOOST_TEST((ended.error() == errc::timed_out));
    }
}

namespace {

asio::awaitable<void> run_interruptible(async::Interruptible& operations, Clock& clock,
                                        std::vector<result<int>>& results)
{
    auto ended = co_await operations.run(number_after(clock, 10s, 7));
    results.push_back(std::move(ended));
}

} // namespace

BOOST_AUTO_TEST_CASE(operations_that_are_interrupted_end_at_once_and_none_begins_any_more)
{
    testing::World world;
    async::Interruptible operations;
    std::vector<result<int>> results;
    async::TaskGroup tasks(world.executor());
    tasks.spawn(run_interruptible(operations, world.clock, results));
    tasks.spawn(run_interruptible(operations, world.clock, results));
    world.settle();
    BOOST_TEST(operations.size() == 2u);
    world.advance(10s);
    BOOST_TEST_REQUIRE(results.size() == 2u);
    BOOST_TEST(results[0].value() == 7);
    BOOST_TEST(operations.size() == 0u);

    tasks.spawn(run_interruptible(operations, world.clock, results));
    world.settle();
    operations.interrupt();
    world.settle();
    BOOST_TEST_REQUIRE(results.size() == 3u);
    BOOST_TEST((results[2].error().code() == asio::error::operation_aborted));
    BOOST_TEST(world.clock.pending() == 0u);
    tasks.spawn(run_interruptible(operations, world.clock, results));
    world.settle();
    BOOST_TEST_REQUIRE(results.size() == 4u);
    BOOST_TEST((results[3].error().code() == asio::error::operation_aborted));
    world.run(tasks.join());
}

BOOST_AUTO_TEST_CASE(the_first_of_several_parts_ends_the_others_and_its_result_counts)
{
    std::vector<std::string> const names{"a", "b", "c", "d"};
    for (std::size_t first = 0; first < names.size(); ++first) {
        testing::World world;
        std::vector<std::string> story;
        auto const delay = [first](std::size_t index) { return index == first ? 2s : 10s; };
        auto const began = world.clock.now();
        auto const ended = world.run(async::first_of(
            part(world.clock, delay(0), "a", story), part(world.clock, delay(1), "b", story),
            part(world.clock, delay(2), "c", story), part(world.clock, delay(3), "d", story)));
        BOOST_TEST(ended.error().message().find(names[first]) != std::string::npos);
        BOOST_TEST((world.clock.now() - began == Duration(3s))); // all have tidied up
        BOOST_TEST(world.clock.pending() == 0u);
        auto const begun = std::vector<std::string>{"a begins", "b begins", "c begins", "d begins"};
        BOOST_TEST((std::vector(story.begin(), story.begin() + 4) == begun));
        BOOST_TEST(story.at(4) == names[first] + " ends");
        BOOST_TEST(std::count_if(story.begin(), story.end(),
                                 [](auto const& line) { return line.ends_with("is cancelled"); }) == 3);
    }
}

BOOST_AUTO_TEST_CASE(a_part_that_throws_ends_the_others_too)
{
    for (bool const comes_first : {true, false}) {
        testing::World world;
        std::vector<std::string> story;
        auto const began = world.clock.now();
        auto lasting = part(world.clock, 10s, "a", story);
        auto broken = break_after(world.clock, 2s);
        auto parts = comes_first ? async::first_of(std::move(broken), std::move(lasting))
                                 : async::first_of(std::move(lasting), std::move(broken));
        BOOST_CHECK_THROW(world.run(std::move(parts)), std::runtime_error);
        BOOST_TEST((world.clock.now() - began == Duration(3s)));
        BOOST_TEST(story.back() == "a is cancelled");
    }
}

BOOST_AUTO_TEST_CASE(whoever_waits_for_the_first_part_can_cancel_all)
{
    testing::World world;
    std::vector<std::string> story;
    auto parts = async::first_of(part(world.clock, 10s, "a", story), part(world.clock, 10s, "b", story),
                                 part(world.clock, 10s, "c", story));
    auto const began = world.clock.now();
    auto const ended = world.run(async::with_deadline(world.clock, began + 2s, number_of(std::move(parts))));
    BOOST_TEST((ended.error() == errc::timed_out));
    BOOST_TEST((world.clock.now() - began == Duration(3s)));
    BOOST_TEST(story.size() == 6u);
}

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

BOOST_AUTO_TEST_CASE(who_is_cancelled_ends_after_the_tasks_that_it_owns)
{
    testing::World world;
    std::vector<std::string> story;
    auto const began = world.clock.now();
    auto const ended =
        world.run(async::with_deadline(world.clock, began + 2s, number_of(owner(world.clock, story))));
    BOOST_TEST((ended.error() == errc::timed_out));
    BOOST_TEST((world.clock.now() - began == Duration(3s)));
    auto const expected = std::vector<std::string>{"a begins", "a is cancelled", "the owner ends"};
    BOOST_TEST(story == expected, boost::test_tools::per_element());
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
