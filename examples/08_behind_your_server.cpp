// The Scheduler behind an HTTP server of your own, here a plain one of Boost.Beast: links webots_cloud::core
// alone. There is no LoadMonitor: the machines say their load themselves. "In your own program" in
// docs/scheduling.md says what a poller of your own has to do.
//
//     PUT /load/HOST:PORT   with the load as body: a number of percent, or the JSON of docs/scheduling.md
//                           ("What machines report")
//     GET /session          where the next browser goes
//     PUT /drain/HOST:PORT  the machine gets no more sessions, and keeps those that it has; DELETE takes it
//     back
//
//     08_behind_your_server PORT HOST:PORT...
//
// PORT is our own on 127.0.0.1 (0: any free one), HOST:PORT the simulation servers. It ends on SIGTERM or
// SIGINT.
#include <webots_cloud/scheduler.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>

#include <charconv>
#include <csignal>
#include <iostream>

using namespace webots_cloud;
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

/// The machines, and the scheduler that places browsers on them.
struct Site
{
    Site() { scheduler.follow(fleet); }

    Fleet fleet;
    Scheduler scheduler;
};

Response text(Request const& request, http::status status, std::string body)
{
    Response response(status, request.version(), std::move(body));
    response.set(http::field::content_type, "text/plain");
    response.set(http::field::access_control_allow_origin, "*"); // pages of other sites ask
    response.keep_alive(request.keep_alive());
    response.prepare_payload();
    return response;
}

// [routes]
/// A machine says its load. Who may do so is your server's business.
Response take_report(Site& site, Request const& request, std::string_view machine)
{
    auto const report = parse_load_report(request.body());
    if (!report)
        return text(request, http::status::bad_request, report.error().message());
    if (!site.scheduler.report(machine, *report, std::chrono::steady_clock::now()))
        return text(request, http::status::not_found, "There is no such machine.");
    return text(request, http::status::ok, "");
}

/// The operator drains a machine, or takes that back. Who is one is your server's business, too.
Response drain(Site& site, Request const& request, std::string_view machine)
{
    if (!site.fleet.drain(machine, request.method() == http::verb::put))
        return text(request, http::status::not_found, "There is no such machine.");
    return text(request, http::status::ok, "");
}

/// A browser asks where to go. The pages of Webots are silent about any other status than 200, so what is
/// wrong is in the text.
Response place(Site& site, Request const& request)
{
    auto const placement = site.scheduler.place(std::chrono::steady_clock::now());
    if (!placement)
        return text(request, http::status::ok, "Error: " + placement.error().message());
    return text(request, http::status::ok, "ws://" + std::string(placement->address));
}

Response answer(Site& site, Request const& request)
{
    std::string_view const target(request.target().data(), request.target().size());
    constexpr std::string_view load = "/load/";
    constexpr std::string_view drained = "/drain/";
    bool const is_put = request.method() == http::verb::put;
    if (is_put && target.starts_with(load))
        return take_report(site, request, target.substr(load.size()));
    if ((is_put || request.method() == http::verb::delete_) && target.starts_with(drained))
        return drain(site, request, target.substr(drained.size()));
    if (request.method() == http::verb::get && target == "/session")
        return place(site, request);
    return text(request, http::status::not_found, "There is nothing here.");
}
// [routes]

/// Answers the requests of one connection.
asio::awaitable<void> serve_connection(tcp::socket socket, Site& site)
{
    beast::tcp_stream stream(std::move(socket));
    beast::flat_buffer buffer;
    for (bool open = true; open;) {
        stream.expires_after(std::chrono::seconds(30));
        Request request;
        auto const [lost, received] =
            co_await http::async_read(stream, buffer, request, asio::as_tuple(asio::use_awaitable));
        if (lost) // closed, silent for too long, or no HTTP
            co_return;
        Response const response = answer(site, request);
        open = response.keep_alive();
        auto const [failed, sent] =
            co_await http::async_write(stream, response, asio::as_tuple(asio::use_awaitable));
        if (failed)
            co_return;
    }
}

/// A connection has ended; what went wrong in our own code ends the program.
void on_connection_ended(std::exception_ptr failure)
{
    if (failure)
        std::rethrow_exception(failure);
}

/// Accepts connections until that fails.
asio::awaitable<boost::system::error_code> accept_connections(tcp::acceptor& acceptor, Site& site)
{
    for (;;) {
        auto [error, socket] = co_await acceptor.async_accept(asio::as_tuple(asio::use_awaitable));
        if (error)
            co_return error;
        asio::co_spawn(acceptor.get_executor(), serve_connection(std::move(socket), site),
                       on_connection_ended);
    }
}

int main(int argc, char** argv)
{
    std::uint16_t port = 0;
    std::string_view const digits = argc > 2 ? argv[1] : "";
    auto const [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
    if (error != std::errc() || end != digits.data() + digits.size()) {
        std::cerr << "usage: " << argv[0] << " PORT HOST:PORT...\n";
        return 2;
    }
    Site site;
    for (int i = 2; i < argc; ++i)
        site.fleet.put(ServerSpec(argv[i]));

    asio::io_context context(1);
    tcp::acceptor acceptor(context);
    boost::system::error_code failed;
    acceptor.open(tcp::v4());
    acceptor.set_option(tcp::acceptor::reuse_address(true));
    acceptor.bind(tcp::endpoint(asio::ip::address_v4::loopback(), port), failed);
    if (!failed)
        acceptor.listen(asio::socket_base::max_listen_connections, failed);
    if (failed) {
        std::cerr << "port " << port << ": " << failed.message() << '\n';
        return 1;
    }
    std::cout << "listening on port " << acceptor.local_endpoint().port() << std::endl;

    int status = 0;
    asio::signal_set signals(context, SIGINT, SIGTERM);
    signals.async_wait([&](boost::system::error_code, int) { context.stop(); });
    auto const ended = [&](std::exception_ptr failure, boost::system::error_code why) {
        if (failure)
            std::rethrow_exception(failure);
        std::cerr << "no more connections: " << why.message() << '\n';
        status = 1;
        context.stop();
    };
    asio::co_spawn(context, accept_connections(acceptor, site), ended);
    context.run();
    return status;
}
