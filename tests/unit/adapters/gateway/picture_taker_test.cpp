#include "unit_test.hpp"

#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/testing/recording_log.hpp>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/use_future.hpp>
#include <boost/asio/write.hpp>

#include <string>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(picture_taker)

namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

/// Answers one request with what the test says, and stays connected until that is closed.
struct OneAnswer
{
    static asio::awaitable<void> serve(OneAnswer& self)
    {
        auto socket = co_await self.acceptor.async_accept(asio::use_awaitable);
        auto const head = co_await asio::async_read_until(socket, asio::dynamic_buffer(self.asked),
                                                          "\r\n\r\n", asio::use_awaitable);
        self.asked.resize(head);
        co_await asio::async_write(socket, asio::buffer(self.answer), asio::use_awaitable);
        char byte = 0;
        boost::system::error_code ended;
        co_await socket.async_read_some(asio::buffer(&byte, 1),
                                        asio::redirect_error(asio::use_awaitable, ended));
    }

    result<std::string> take()
    {
        auto const taker = make_picture_taker(context.get_executor(), log.logger());
        asio::co_spawn(context, serve(*this), asio::detached);
        auto taken = asio::co_spawn(
            context, taker->take(Upstream("127.0.0.1", acceptor.local_endpoint().port())), asio::use_future);
        context.run();
        return taken.get();
    }

    std::string answer;
    std::string asked;
    testing::RecordingLog log;
    asio::io_context context;
    tcp::acceptor acceptor{context, tcp::endpoint(asio::ip::address_v4::loopback(), 0)};
};

constexpr auto stream_head =
    "HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=WebotsFrame\r\n\r\n";

} // namespace

BOOST_AUTO_TEST_CASE(one_picture_of_a_stream_without_end_is_taken)
{
    auto const jpeg = "\xff\xd8\xff" + std::string(200'000, 'x');
    OneAnswer simulator;
    simulator.answer =
        stream_head + ("--WebotsFrame\r\nContent-Type: image/jpeg\r\nContent-Length: " +
                       std::to_string(jpeg.size()) + "\r\n\r\n" + jpeg + "\r\n--WebotsFrame\r\n");
    auto const taken = simulator.take();
    BOOST_TEST_REQUIRE(taken.has_value());
    BOOST_TEST((*taken == jpeg));
    BOOST_TEST(simulator.asked.starts_with("GET /mjpeg HTTP/1.1\r\n"));
}

BOOST_AUTO_TEST_CASE(what_is_no_picture_is_an_error)
{
    for (auto const* body : {"--WebotsFrame\r\nContent-Length: 6\r\n\r\n<html>",
                             "--WebotsFrame\r\nContent-Length: 9999999\r\n\r\n"}) {
        OneAnswer simulator;
        simulator.answer = std::string(stream_head) + body;
        BOOST_TEST((simulator.take().error() == errc::protocol_error), body);
    }
    OneAnswer nobody;
    nobody.answer = "HTTP/1.0 404 Not Found\r\n\r\n";
    BOOST_TEST((nobody.take().error() == errc::protocol_error));
}

BOOST_AUTO_TEST_CASE(where_nobody_listens_there_is_no_picture)
{
    asio::io_context context;
    testing::RecordingLog log;
    auto const taker = make_picture_taker(context.get_executor(), log.logger());
    tcp::acceptor free_port(context, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
    Upstream const nobody("127.0.0.1", free_port.local_endpoint().port());
    free_port.close();
    auto taken = asio::co_spawn(context, taker->take(nobody), asio::use_future);
    context.run();
    BOOST_TEST((taken.get().error() == errc::unreachable));
}

BOOST_AUTO_TEST_SUITE_END()
