#include "unit_test.hpp"

#include "adapters/files/mount_thread.hpp"

#include <webots_cloud/adapters.hpp>

#include <set>
#include <thread>
#include <vector>

using namespace webots_cloud;
using adapters::mount_elsewhere;

BOOST_AUTO_TEST_SUITE(mount_thread)

namespace {

std::thread::id where()
{
    std::thread::id id;
    BOOST_TEST(mount_elsewhere([&] {
                   id = std::this_thread::get_id();
                   return 7;
               }) == 7);
    return id;
}

} // namespace

BOOST_AUTO_TEST_CASE(mounts_are_made_on_it_while_it_exists)
{
    BOOST_TEST((where() == std::this_thread::get_id()));
    {
        auto const thread = make_mount_thread();
        auto const id = where();
        BOOST_TEST((id != std::this_thread::get_id()));
        BOOST_TEST((where() == id));
    }
    BOOST_TEST((where() == std::this_thread::get_id()));
}

BOOST_AUTO_TEST_CASE(many_threads_use_it_and_each_gets_its_own_outcome)
{
    auto const thread = make_mount_thread();
    std::vector<int> outcomes(16);
    std::vector<std::thread> callers;
    for (int i = 0; i < 16; ++i)
        callers.emplace_back([&outcomes, i] {
            for (int n = 0; n < 100; ++n)
                outcomes[static_cast<std::size_t>(i)] += mount_elsewhere([i] { return i; });
        });
    for (auto& each : callers)
        each.join();
    for (int i = 0; i < 16; ++i)
        BOOST_TEST(outcomes[static_cast<std::size_t>(i)] == 100 * i);
}

BOOST_AUTO_TEST_SUITE_END()
