#include "unit_test.hpp"

#include "async/task_group.hpp"

#include <webots_cloud/service_report.hpp>
#include <webots_cloud/testing/world.hpp>

#include <string>
#include <vector>

using namespace webots_cloud;
using namespace std::chrono_literals;

namespace {

class RecordingManager final : public ServiceManager
{
public:
    void tell(std::string_view state) noexcept override { told.emplace_back(state); }
    std::optional<Duration> watchdog() const noexcept override { return within; }

    std::vector<std::string> told;
    std::optional<Duration> within;
};

boost::asio::awaitable<void> run(ServiceManager& manager, Clock& clock)
{
    (void)co_await report_to(manager, clock);
}

struct ServiceReportFixture
{
    void start()
    {
        tasks.spawn(run(manager, world.clock));
        world.settle();
    }

    testing::World world;
    RecordingManager manager;
    async::TaskGroup tasks{world.executor()};
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(service_report, ServiceReportFixture)

BOOST_AUTO_TEST_CASE(a_manager_hears_of_the_beginning_and_the_end)
{
    start();
    world.advance(1000s);
    BOOST_TEST(manager.told == (std::vector<std::string>{"READY=1"}), boost::test_tools::per_element());
    tasks.cancel_all();
    world.settle();
    BOOST_TEST(manager.told.back() == "STOPPING=1");
    BOOST_TEST(tasks.size() == 0u);
}

BOOST_AUTO_TEST_CASE(a_manager_that_wants_signs_of_life_gets_them_twice_as_often)
{
    manager.within = 30s;
    start();
    world.advance(60s);
    BOOST_TEST(manager.told.size() == 5u);
    BOOST_TEST(manager.told.back() == "WATCHDOG=1");
    tasks.cancel_all();
    world.settle();
}

BOOST_AUTO_TEST_SUITE_END()
