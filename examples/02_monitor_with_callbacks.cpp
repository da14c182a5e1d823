// Watches the load of a simulation server, in the three ways in which a program may wait: in a coroutine,
// with a callback, with a future. Every operation of the library is an awaitable; co_spawn turns it into
// whatever you prefer.
#include <webots_cloud/adapters.hpp>
#include <webots_cloud/load_monitor.hpp>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_future.hpp>

#include <iostream>

using namespace webots_cloud;
namespace asio = boost::asio;

/// Something to watch: answers GET /load, as a simulation server does.
class Machine final : public Endpoint
{
public:
    Answer respond(IncomingRequest const&) override { return HttpResponse(200, "text/html", "12.5"); }
    asio::awaitable<void> serve_websocket(ChannelInfo, Channel&) override { co_return; }
};

/// In a coroutine: simply co_await.
asio::awaitable<void> print_next(LoadMonitor& monitor)
{
    auto const events = co_await monitor.next_events();
    if (events)
        for (LoadEvent const& event : *events)
            std::cout << "coroutine: load " << event.server.report.load << " %\n";
}

int main()
{
    asio::io_context context(1);
    auto const executor = context.get_executor();
    auto const clock = make_steady_clock(executor);
    auto const http = make_http_client(executor);
    Machine machine;
    auto const server = make_http_server(executor, HttpServerParams(), Logger());
    if (auto const listening = server->listen(); !listening) {
        std::cerr << listening.error().message() << '\n';
        return 1;
    }

    LoadMonitorParams params;
    params.interval = std::chrono::milliseconds(50);
    auto made = LoadMonitor::make(params, *http, *clock);
    if (!made) { // an interval that is not positive, for example
        std::cerr << made.error().message() << '\n';
        return 1;
    }
    auto& monitor = *made;
    monitor.set_servers({"127.0.0.1:" + std::to_string(server->port())});

    asio::cancellation_signal stop_monitor;
    asio::cancellation_signal stop_server;
    auto const ended = [](std::exception_ptr failure, result<> const&) {
        if (failure) // a mistake in a program: context.run() throws it
            std::rethrow_exception(failure);
    };
    asio::co_spawn(executor, monitor.run(), asio::bind_cancellation_slot(stop_monitor.slot(), ended));
    asio::co_spawn(executor, server->run(machine), asio::bind_cancellation_slot(stop_server.slot(), ended));

    // With a future: run the context, then get() the outcome. (With another thread running the context, get()
    // would wait.)
    auto future = asio::co_spawn(executor, print_next(monitor), asio::use_future);
    while (future.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
        context.run_one();
    future.get();

    // With a callback: the outcome comes as arguments.
    auto const on_events = [&](std::exception_ptr failure, result<std::vector<LoadEvent>> const& events) {
        if (failure)
            std::rethrow_exception(failure);
        if (events)
            std::cout << "callback: load " << events->front().server.report.load << " %\n";
        stop_monitor.emit(asio::cancellation_type::terminal);
        stop_server.emit(asio::cancellation_type::terminal);
    };
    asio::co_spawn(executor, monitor.next_events(), on_events);
    context.run(); // ends when nothing is left to do
}
