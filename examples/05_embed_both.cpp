// Runs a session server and a simulation server inside one program, on one thread: what a site with one
// machine needs.
//
//     05_embed_both PROGRAMS EXAMPLES SESSION_PORT SIMULATION_PORT
//
// PROGRAMS is the folder of webots-process-guard and webots-demo-simulator, EXAMPLES the folder that holds
// demo_projects. It ends in order on SIGTERM or SIGINT.
#include <webots_cloud/servers.hpp>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>

#include <sys/prctl.h>

#include <charconv>
#include <csignal>
#include <iostream>

using namespace webots_cloud;
namespace asio = boost::asio;

asio::awaitable<result<>> serve_both(asio::any_io_executor executor, SessionConfig session,
                                     SimulationConfig simulation, std::filesystem::path programs)
{
    using namespace asio::experimental::awaitable_operators;
    Logger const log([](LogLevel, std::string_view line) { std::cout << line << std::endl; });
    auto const ended = co_await (serve_simulations(executor, simulation, nullptr, programs, log) ||
                                 serve_sessions(executor, session, nullptr, log));
    co_return std::visit([](result<> const& outcome) { return outcome; }, ended);
}

/// 0: `text` is no port.
std::uint16_t port_of(std::string_view text)
{
    std::uint16_t port = 0;
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
    return error == std::errc() && end == text.data() + text.size() ? port : 0;
}

int main(int argc, char** argv)
{
    auto const session_port = argc == 5 ? port_of(argv[3]) : std::uint16_t{0};
    auto const simulation_port = argc == 5 ? port_of(argv[4]) : std::uint16_t{0};
    if (session_port == 0 || simulation_port == 0) {
        std::cerr << "usage: " << argv[0] << " PROGRAMS EXAMPLES SESSION_PORT SIMULATION_PORT\n";
        return 2;
    }
    SimulationConfig simulation;
    simulation.address.ssl = false;
    simulation.address.port_rewrite = false;
    simulation.address.port = simulation_port;
    simulation.forges = {ForgeConfig("local:")};
    simulation.forges.front().directory = argv[2];
    simulation.service.repositories.allowed = {"local:/demo_projects"};

    SessionConfig session;
    session.address.ssl = false;
    session.address.port = session_port;
    session.simulation_servers = {ServerSpec("localhost:" + std::to_string(simulation.address.port))};

    // Simulations run as this user: they must not trace this program, and one that ends must not end it.
    ::prctl(PR_SET_DUMPABLE, 0);
    std::signal(SIGPIPE, SIG_IGN);
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
    asio::co_spawn(context, serve_both(context.get_executor(), session, simulation, argv[1]),
                   asio::bind_cancellation_slot(stop.slot(), ended));
    context.run();
    return status;
}
