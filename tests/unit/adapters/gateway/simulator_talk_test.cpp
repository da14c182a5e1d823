#include "unit_test.hpp"

#include "adapters/messages/websocket_frames.hpp"

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
#include <vector>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(simulator_talk)

namespace {

namespace asio = boost::asio;
using adapters::WebSocketEvent;
using asio::ip::tcp;
using Texts = std::vector<std::string>;

/// Accepts one WebSocket, answers each message by `answers`, in order, and notes what it gets.
struct Simulator
{
    static asio::awaitable<void> serve(Simulator& self)
    {
        auto socket = co_await self.acceptor.async_accept(asio::use_awaitable);
        std::string head;
        auto const end = co_await asio::async_read_until(socket, asio::dynamic_buffer(head), "\r\n\r\n",
                                                         asio::use_awaitable);
        self.head = head.substr(0, end);
        co_await asio::async_write(socket, asio::buffer(self.handshake), asio::use_awaitable);
        adapters::WebSocketFrameReader reader(1024);
        std::string bytes(1024, '\0');
        for (;;) {
            boost::system::error_code error;
            auto const got = co_await socket.async_read_some(
                asio::buffer(bytes), asio::redirect_error(asio::use_awaitable, error));
            if (error)
                co_return;
            auto const answer = self.answer(reader, std::string_view(bytes).substr(0, got));
            co_await asio::async_write(socket, asio::buffer(answer), asio::use_awaitable);
        }
    }

    std::string answer(adapters::WebSocketFrameReader& reader, std::string_view bytes)
    {
        std::string frames;
        while (!bytes.empty()) {
            auto const event = reader.next(bytes);
            is_wrong |= event.kind == WebSocketEvent::Kind::fault;
            if (event.kind == WebSocketEvent::Kind::message) {
                got.push_back(event.payload);
                for (auto const& text : got.size() <= answers.size() ? answers[got.size() - 1] : Texts())
                    adapters::append_text_frame(frames, text);
                adapters::append_ping_frame(frames);
            } else if (event.kind == WebSocketEvent::Kind::pong) {
                ++pongs;
            } else if (event.kind == WebSocketEvent::Kind::close) {
                is_closed = true;
                for (auto const& text : late)
                    adapters::append_text_frame(frames, text);
                adapters::append_close_frame(frames, 1000, {});
            }
        }
        return frames;
    }

    Texts talk(Texts words, std::string last)
    {
        auto const talk = make_simulator_talk(context.get_executor(), log.logger());
        asio::co_spawn(context, serve(*this), asio::detached);
        auto heard = asio::co_spawn(context,
                                    talk->talk(Upstream("127.0.0.1", acceptor.local_endpoint().port()),
                                               std::move(words), std::move(last)),
                                    asio::use_future);
        context.run();
        return heard.get();
    }

    std::string handshake = "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\n\r\n";
    std::vector<Texts> answers; ///< To the first message, to the second, and so on.
    Texts late;                 ///< What is on the way when it hears that the other side closes.

    std::string head;
    Texts got;
    int pongs = 0;
    bool is_closed = false;
    bool is_wrong = false;
    testing::RecordingLog log;
    asio::io_context context;
    tcp::acceptor acceptor{context, tcp::endpoint(asio::ip::address_v4::loopback(), 0)};
};

} // namespace

BOOST_AUTO_TEST_CASE(a_simulator_is_heard_until_it_has_closed_its_side)
{
    Simulator simulator;
    auto const long_line = "stdout:" + std::string(100'000, 'x');
    simulator.answers = {{"multimedia: mjpeg pause ", long_line}, {"real-time"}};
    simulator.late = {"stdout:a word more"};
    auto const heard = simulator.talk({"mjpeg: 4x3", "real-time:-1"}, "real-time");
    BOOST_TEST((heard == Texts{"multimedia: mjpeg pause ", long_line, "real-time", "stdout:a word more"}));
    BOOST_TEST(simulator.got == (Texts{"mjpeg: 4x3", "real-time:-1"}), boost::test_tools::per_element());
    BOOST_TEST(simulator.head.starts_with("GET / HTTP/1.1\r\n"));
    BOOST_TEST(simulator.is_closed);
    BOOST_TEST(!simulator.is_wrong);
    BOOST_TEST(simulator.pongs > 0);
}

BOOST_AUTO_TEST_CASE(what_came_before_the_time_was_over_counts)
{
    Simulator simulator;
    simulator.answers = {{"stdout:hello"}};
    BOOST_TEST(simulator.talk({"mjpeg: 4x3"}, "real-time") == Texts{"stdout:hello"},
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(what_is_no_simulator_says_nothing)
{
    for (auto const* answer : {"HTTP/1.0 404 Not Found\r\n\r\n", "HTTP/1.1 200 OK\r\n\r\n\x81\x01x"}) {
        Simulator simulator;
        simulator.handshake = answer;
        BOOST_TEST(simulator.talk({"pause"}, "paused by client").empty(), answer);
    }
    Simulator endless;
    endless.handshake = std::string(20'000, 'x');
    BOOST_TEST(endless.talk({"pause"}, "paused by client").empty());
}

BOOST_AUTO_TEST_CASE(a_simulator_that_never_stops_talking_is_left)
{
    Simulator simulator;
    simulator.answers = {Texts(40, std::string(60'000, 'x'))};
    BOOST_TEST(simulator.talk({"pause"}, "paused by client").size() < 20u);
    Simulator silent; // which says nothing, again and again
    silent.answers = {Texts(100'000)};
    BOOST_TEST(silent.talk({"pause"}, "paused by client").size() < 40'000u);
}

BOOST_AUTO_TEST_CASE(where_nobody_listens_nothing_is_heard)
{
    asio::io_context context;
    testing::RecordingLog log;
    auto const talk = make_simulator_talk(context.get_executor(), log.logger());
    tcp::acceptor free_port(context, tcp::endpoint(asio::ip::address_v4::loopback(), 0));
    Upstream const nobody("127.0.0.1", free_port.local_endpoint().port());
    free_port.close();
    auto heard = asio::co_spawn(context, talk->talk(nobody, {"pause"}, "paused by client"), asio::use_future);
    context.run();
    BOOST_TEST(heard.get().empty());
}

BOOST_AUTO_TEST_SUITE_END()
