#include "unit_test.hpp"

#include "adapters/threads/blocking_pool.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_future.hpp>

#include <sys/resource.h>
#include <unistd.h>

#include <condition_variable>
#include <mutex>

using namespace webots_cloud;
namespace asio = boost::asio;

BOOST_AUTO_TEST_SUITE(blocking_pool)

namespace {

/// Work that waits until this many threads have begun it.
class Meeting
{
public:
    explicit Meeting(int expected) : expected_(expected) {}

    void attend()
    {
        std::unique_lock lock(mutex_);
        ++present_;
        arrived_.notify_all();
        arrived_.wait_for(lock, std::chrono::seconds(60), [this] { return present_ >= expected_; });
    }

    int present() const { return present_; }

private:
    int expected_;
    int present_ = 0;
    std::mutex mutex_;
    std::condition_variable arrived_;
};

asio::awaitable<void> share(adapters::BlockingPool& pool, std::size_t helpers, Meeting& meeting)
{
    auto work = [&pool, helpers, &meeting] {
        pool.share(helpers, [&meeting] { meeting.attend(); });
        return true;
    };
    co_await pool.run(std::move(work));
}

int meet(std::size_t threads, std::size_t helpers, int expected)
{
    asio::io_context context;
    adapters::BlockingPool pool(threads);
    Meeting meeting(expected);
    asio::co_spawn(context, share(pool, helpers, meeting), asio::detached);
    context.run();
    return meeting.present();
}

/// The nice value: 0 is the default priority, more is a lower one.
int niceness()
{
    return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()));
}

asio::awaitable<int> niceness_in(adapters::BlockingPool& pool)
{
    co_return co_await pool.run(&niceness);
}

int niceness_of(adapters::BlockingPool::Priority priority)
{
    asio::io_context context{1};
    adapters::BlockingPool pool(1, priority);
    auto found = asio::co_spawn(context, niceness_in(pool), asio::use_future);
    context.run();
    return found.get();
}

} // namespace

BOOST_AUTO_TEST_CASE(shared_work_is_done_by_as_many_threads_as_are_free)
{
    BOOST_TEST(meet(3, 2, 3) == 3);
}

BOOST_AUTO_TEST_CASE(shared_work_is_done_by_one_thread_when_there_is_no_other)
{
    BOOST_TEST(meet(1, 2, 1) == 1);
}

BOOST_AUTO_TEST_CASE(work_of_a_background_pool_lets_the_event_loop_go_first)
{
    BOOST_TEST(niceness_of(adapters::BlockingPool::Priority::background) > niceness());
}

BOOST_AUTO_TEST_CASE(work_of_any_other_pool_keeps_its_priority)
{
    BOOST_TEST(niceness_of(adapters::BlockingPool::Priority::normal) == niceness());
}

BOOST_AUTO_TEST_SUITE_END()
