// The server side of HTTP and WebSocket as Boost.Beast has it, with a coroutine a connection and a deadline:
// what decision 007 compares with.
//
//     speed_beast http PORT         answers every GET alike
//     speed_beast websocket PORT    accepts WebSockets, sends each "1" and waits for what it says
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/stream.hpp>

#include <cstdlib>
#include <iostream>
#include <string_view>

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;

constexpr auto result = asio::as_tuple(asio::use_awaitable);

asio::awaitable<void> answer(beast::tcp_stream stream)
{
    beast::flat_buffer buffer;
    for (;;) {
        stream.expires_after(std::chrono::seconds(60));
        http::request<http::string_body> request;
        auto const [read_error, read] = co_await http::async_read(stream, buffer, request, result);
        if (read_error)
            co_return;
        http::response<http::string_body> response(http::status::ok, request.version());
        response.set(http::field::content_type, "text/html; charset=UTF-8");
        response.set(http::field::access_control_allow_origin, "*");
        response.set(http::field::access_control_allow_headers, "x-requested-with");
        response.set(http::field::access_control_allow_methods, "POST, GET, OPTIONS");
        response.keep_alive(request.keep_alive());
        response.body() = "ws://localhost:2000";
        response.prepare_payload();
        auto const [write_error, written] = co_await http::async_write(stream, response, result);
        if (write_error)
            co_return;
    }
}

/// As little memory as Beast can do with: a socket without timer, no compression, nothing received into but
/// one byte.
asio::awaitable<void> serve_websocket(tcp::socket socket)
{
    beast::websocket::stream<tcp::socket, false> stream(std::move(socket));
    stream.auto_fragment(false);
    stream.write_buffer_bytes(8);
    auto const [refused] = co_await stream.async_accept(result);
    if (refused)
        co_return;
    auto const [unsent, sent] = co_await stream.async_write(asio::buffer("1", 1), result);
    if (unsent)
        co_return;
    char byte = 0;
    (void)co_await stream.async_read_some(asio::buffer(&byte, 1), result);
}

asio::awaitable<void> listen(tcp::endpoint endpoint, bool websockets)
{
    auto const executor = co_await asio::this_coro::executor;
    tcp::acceptor acceptor(executor, endpoint);
    for (;;) {
        auto [error, socket] = co_await acceptor.async_accept(result);
        if (error)
            continue;
        boost::system::error_code ignored;
        socket.set_option(tcp::no_delay(true), ignored);
        if (websockets)
            asio::co_spawn(executor, serve_websocket(std::move(socket)), asio::detached);
        else
            asio::co_spawn(executor, answer(beast::tcp_stream(std::move(socket))), asio::detached);
    }
}

} // namespace

int main(int argc, char** argv)
{
    std::string_view const what = argc == 3 ? argv[1] : "";
    if (what != "http" && what != "websocket") {
        std::cerr << "usage: speed_beast http|websocket PORT\n";
        return 2;
    }
    asio::io_context context(1);
    auto const port = static_cast<std::uint16_t>(std::atoi(argv[2]));
    asio::co_spawn(context, listen({tcp::v4(), port}, what == "websocket"), asio::detached);
    context.run();
}
