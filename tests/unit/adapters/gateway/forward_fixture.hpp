// Another server, to which the one under test passes requests on.
#pragma once

#include "adapters/network/network_fixture.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include <poll.h>
#include <string>
#include <string_view>

namespace webots_cloud {

/// A connection that the server has made to another one.
class UpstreamPeer : public BlockingConnection
{
public:
    explicit UpstreamPeer(boost::asio::ip::tcp::acceptor& acceptor)
    {
        pollfd waiting{acceptor.native_handle(), POLLIN, 0};
        BOOST_TEST_REQUIRE(::poll(&waiting, 1, std::chrono::milliseconds(patience).count()) == 1);
        acceptor.accept(socket_);
        limit_patience();
    }

    /// Reads a request's head.
    std::string read_request() { return read_to("\r\n\r\n"); }

    void close()
    {
        boost::system::error_code ignored;
        socket_.close(ignored);
    }
};

/// The other server.
class OtherServer
{
public:
    OtherServer() : acceptor(context, {boost::asio::ip::address_v4::loopback(), 0}) {}

    Forward forward(std::string target = "/there") const
    {
        Forward forward;
        forward.upstream = Upstream("127.0.0.1", acceptor.local_endpoint().port());
        forward.kind = UpstreamKind::machine;
        forward.target = std::move(target);
        return forward;
    }

    UpstreamPeer accept() { return UpstreamPeer(acceptor); }
    void close() { acceptor.close(); }
    std::uint16_t port() const { return acceptor.local_endpoint().port(); }

    boost::asio::io_context context;
    boost::asio::ip::tcp::acceptor acceptor;
};

inline std::string const forwarded_request = "GET /forward HTTP/1.1\r\nHost: h\r\n\r\n";

inline std::string answer(std::string_view body)
{
    return "HTTP/1.1 200 OK\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" +
           std::string(body);
}

inline constexpr std::string_view accepted = "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\n"
                                             "Connection: Upgrade\r\nSec-WebSocket-Accept: x\r\n\r\n";

inline std::string much(std::size_t size)
{
    std::string text;
    for (std::size_t i = 0; text.size() < size; ++i)
        text += std::to_string(i) + " ";
    text.resize(size);
    return text;
}

/// A tunnel for a WebSocket.
struct OpenTunnel
{
    OpenTunnel(RunningServer& server, OtherServer& other, int receive_buffer = 0)
        : browser(server, receive_buffer), upstream(asked(server, other, browser))
    {
        upstream.read_request();
        upstream.say(accepted);
        BOOST_TEST_REQUIRE(browser.read_to("\r\n\r\n").starts_with("HTTP/1.1 101 "));
    }

    static boost::asio::ip::tcp::acceptor& asked(RunningServer& server, OtherServer& other, Client& browser)
    {
        if (!server.endpoint.forward)
            server.endpoint.forward = other.forward();
        browser.ask_upgrade("/forward", {});
        return other.acceptor;
    }

    Client browser;
    UpstreamPeer upstream;
};

} // namespace webots_cloud
