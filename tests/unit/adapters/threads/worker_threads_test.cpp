#include "unit_test.hpp"

#include "adapters/threads/worker_threads.hpp"

#include <atomic>
#include <barrier>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <memory>
#include <vector>

using namespace webots_cloud;
using adapters::WorkerThreads;

BOOST_AUTO_TEST_SUITE(worker_threads)

namespace {

std::ptrdiff_t threads_of_this_process()
{
    return std::distance(std::filesystem::directory_iterator("/proc/self/task"), {});
}

} // namespace

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

BOOST_AUTO_TEST_CASE(threads_start_when_there_is_work_for_them)
{
    auto const before = threads_of_this_process();
    WorkerThreads threads(8);
    BOOST_TEST(threads_of_this_process() == before + 1);
    std::barrier all_at_once(8); // no job goes on before all have started
    for (int i = 0; i < 8; ++i)
        threads.post([&all_at_once] { all_at_once.arrive_and_wait(); });
    threads.join();
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
