#include "unit_test.hpp"

#include "adapters/blocking_pool.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_future.hpp>

#include <sys/resource.h>
#include <unistd.h>

namespace asio = boost::asio;
using webots_cloud::adapters::BlockingPool;

namespace {

/// 0 for the priority that programs have by themselves, more for a lower one.
int niceness()
{
    return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()));
}

asio::awaitable<int> niceness_in(BlockingPool& pool)
{
    co_return co_await pool.run(&niceness);
}

int niceness_of(BlockingPool::Priority priority)
{
    asio::io_context context{1};
    BlockingPool pool(1, priority);
    auto found = asio::co_spawn(context, niceness_in(pool), asio::use_future);
    context.run();
    return found.get();
}

} // namespace

BOOST_AUTO_TEST_SUITE(BlockingPoolPriority)

BOOST_AUTO_TEST_CASE(WorkOfABackgroundPoolLetsTheEventLoopGoFirst)
{
    BOOST_TEST(niceness_of(BlockingPool::Priority::background) > niceness());
}

BOOST_AUTO_TEST_CASE(WorkOfAnyOtherPoolDoesNotStepBack)
{
    BOOST_TEST(niceness_of(BlockingPool::Priority::normal) == niceness());
}

BOOST_AUTO_TEST_SUITE_END()
