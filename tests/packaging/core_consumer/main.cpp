// An outside program with no transport of its own: it polls two scripted machines and places a session on the
// idler one.
#include <webots_cloud/fleet.hpp>
#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/scheduler.hpp>
#include <webots_cloud/testing/scripted_http.hpp>
#include <webots_cloud/testing/world.hpp>

#include <boost/asio/experimental/awaitable_operators.hpp>

#include <iostream>

namespace {

using namespace webots_cloud;

boost::asio::awaitable<result<>> tell_scheduler(LoadMonitor& monitor, Scheduler& scheduler, Clock& clock)
{
    for (std::size_t reports = 0; reports < 2;) {
        auto const events = co_await monitor.next_events();
        if (!events)
            co_return events.error();
        for (auto const& event : *events) {
            scheduler.take(event, clock.now());
            ++reports;
        }
    }
    co_return result<>();
}

} // namespace

int main()
{
    using namespace boost::asio::experimental::awaitable_operators;

    testing::World world;
    testing::ScriptedHttp http(world.clock);
    http.expect("GET http://busy:2000/load").always().reply(200, "40");
    http.expect("GET http://idle:2000/load").always().reply(200, "10.5");

    Fleet fleet;
    fleet.set({ServerSpec("busy:2000"), ServerSpec("idle:2000")});
    LoadMonitor monitor(http, world.clock);
    monitor.follow(fleet);
    Scheduler scheduler;
    scheduler.follow(fleet);
    world.run(monitor.run() || tell_scheduler(monitor, scheduler, world.clock));

    auto const placement = scheduler.place(world.clock.now());
    std::cout << "placed on " << (placement ? placement->address : std::string_view("nothing")) << std::endl;
    return placement && placement->address == "idle:2000" ? 0 : 1;
}
