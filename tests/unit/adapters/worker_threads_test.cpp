#include "unit_test.hpp"

#include "adapters/worker_threads.hpp"

#include <atomic>
#include <memory>
#include <vector>

using namespace webots_cloud;
using adapters::WorkerThreads;

BOOST_AUTO_TEST_SUITE(worker_threads)

BOOST_AUTO_TEST_CASE(one_thread_does_jobs_in_order)
{
    std::vector<int> done;
    WorkerThreads threads(1);
    for (int i = 0; i < 3; ++i)
        threads.post([&done, i] { done.push_back(i); });
    threads.join();
    BOOST_TEST(done == std::vector({0, 1, 2}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(several_threads_do_each_job_once)
{
    std::vector<std::atomic<int>> done(1000);
    WorkerThreads threads(4);
    for (auto& times : done)
        threads.post([&times] { ++times; });
    threads.join();
    for (auto const& times : done)
        BOOST_TEST(times == 1);
}

BOOST_AUTO_TEST_CASE(jobs_that_wait_are_destroyed_with_the_threads)
{
    auto const owned = std::make_shared<int>();
    {
        WorkerThreads threads(0);
        threads.post([owned] { ++*owned; });
        BOOST_TEST(owned.use_count() == 2);
    }
    BOOST_TEST(owned.use_count() == 1);
    BOOST_TEST(*owned == 0);
}

BOOST_AUTO_TEST_SUITE_END()
