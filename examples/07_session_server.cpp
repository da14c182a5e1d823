// Composes a session server by hand from the library's parts: a Fleet is the list of the machines, a
// LoadMonitor polls them, a Scheduler places browsers on them, a SessionService speaks with the browsers,
// AccessControl checks where requests come from, and an HTTP server brings them. Take it as a start when you
// want to replace or add a part; webots_cloud/servers.hpp has the whole server in one function.
//
//     07_session_server PORT HOST:PORT...
//
// PORT is our own (0: any free one), HOST:PORT the simulation servers. It ends in order on SIGTERM or SIGINT.
#include <webots_cloud/access_control.hpp>
#include <webots_cloud/adapters.hpp>
#include <webots_cloud/session_service.hpp>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>

#include <charconv>
#include <csignal>
#include <iostream>

using namespace webots_cloud;
namespace asio = boost::asio;

// [composition]
asio::awaitable<result<>> serve(asio::any_io_executor executor, std::uint16_t port,
                                std::vector<ServerSpec> machines)
{
    using namespace asio::experimental::awaitable_operators;
    Logger const log([](LogLevel, std::string_view line) { std::cout << line << std::endl; });
    auto const clock = make_steady_clock(executor);
    auto const http = make_http_client(executor);

    Fleet fleet; // what changes in this list later, all the others follow
    fleet.set(machines);
    LoadMonitor monitor(*http, *clock);
    Scheduler scheduler;
    SessionConfig config;
    config.address.ssl = false; // browsers are sent to ws://
    config.address.port = port;
    SessionService service(config, fleet, monitor, scheduler, *clock, log);

    AccessControl access(config.access, GuardedServer(), service, *clock, log);
    access.follow(fleet); // without machines elsewhere, foreign web pages may not use it
    auto const server = make_http_server(executor, HttpServerParams(config.network, port), log);
    if (auto const listening = server->listen(); !listening)
        co_return listening.error();
    std::cout << "listening on port " << server->port() << std::endl;

    // Nothing polls, places or answers before it is awaited. What ends first ends the others.
    auto const ended = co_await (server->run(access) || service.run() || monitor.run());
    co_return std::visit([](result<> const& outcome) { return outcome; }, ended);
}
// [composition]

int main(int argc, char** argv)
{
    std::uint16_t port = 0;
    std::string_view const digits = argc > 2 ? argv[1] : "";
    auto const [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
    if (error != std::errc() || end != digits.data() + digits.size()) {
        std::cerr << "usage: " << argv[0] << " PORT HOST:PORT...\n";
        return 2;
    }
    std::vector<ServerSpec> machines;
    for (int i = 2; i < argc; ++i)
        machines.emplace_back(argv[i]);

    asio::io_context context(1);
    asio::cancellation_signal stop;
    asio::signal_set signals(context, SIGINT, SIGTERM);
    signals.async_wait([&](boost::system::error_code cancelled, int) {
        if (!cancelled)
            stop.emit(asio::cancellation_type::terminal);
    });
    int status = 1;
    auto const ended = [&](std::exception_ptr failure, result<> const& outcome) {
        signals.cancel();
        if (failure)
            std::rethrow_exception(failure);
        if (outcome || outcome.error().code() == asio::error::operation_aborted)
            status = 0;
        else
            std::cerr << outcome.error().message() << '\n';
    };
    asio::co_spawn(context, serve(context.get_executor(), port, machines),
                   asio::bind_cancellation_slot(stop.slot(), ended));
    context.run();
    return status;
}
