#include <webots_cloud/service_report.hpp>

namespace webots_cloud {

boost::asio::awaitable<result<>> report_to(ServiceManager& manager, Clock& clock)
{
    manager.tell("READY=1");
    auto const within = manager.watchdog();
    for (;;) {
        auto const next = within ? clock.now() + *within / 2 : TimePoint::max();
        auto const waited = co_await clock.wait_until(next);
        if (!waited) {
            manager.tell("STOPPING=1");
            co_return waited;
        }
        manager.tell("WATCHDOG=1");
    }
}

} // namespace webots_cloud
