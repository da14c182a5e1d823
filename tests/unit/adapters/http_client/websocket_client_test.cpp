#include "unit_test.hpp"

#include "adapters/network/network_fixture.hpp"
#include "adapters/tls/signed_itself.hpp"

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/use_future.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/websocket/stream.hpp>

using namespace webots_cloud;
using namespace std::chrono_literals;
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;

BOOST_AUTO_TEST_SUITE(websocket_client)

namespace {

using Connected = result<std::unique_ptr<Channel>>;
using ServerSide = websocket::stream<tcp::socket>;

/// The other side, on a thread of its own: `serve` has each connection, one after the other.
class Peer
{
public:
    explicit Peer(std::function<void(tcp::socket)> serve)
        : serve_(std::move(serve)), acceptor_(context_, {asio::ip::address_v4::loopback(), 0}),
          thread_([this] { accept(); })
    {}
    Peer(Peer const&) = delete;
    Peer& operator=(Peer const&) = delete;
    ~Peer()
    {
        ::shutdown(acceptor_.native_handle(), SHUT_RDWR);
        thread_.join();
    }

    std::string url() const
    {
        return "ws://127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port()) + "/client";
    }

private:
    void accept()
    {
        for (;;) {
            boost::system::error_code failed;
            tcp::socket socket(context_);
            acceptor_.accept(socket, failed);
            if (failed)
                return;
            serve_(std::move(socket));
        }
    }

    std::function<void(tcp::socket)> serve_;
    asio::io_context context_;
    tcp::acceptor acceptor_;
    std::thread thread_;
};

/// One that accepts the handshake.
std::function<void(tcp::socket)> after_handshake(std::function<void(ServerSide&)> serve)
{
    return [serve = std::move(serve)](tcp::socket socket) {
        ServerSide stream(std::move(socket));
        beast::error_code failed;
        stream.accept(failed);
        if (!failed)
            serve(stream);
    };
}

/// Says `answer` to whatever it is asked, and waits until the client has gone.
std::function<void(tcp::socket)> answering(std::string answer)
{
    return [answer = std::move(answer)](tcp::socket socket) {
        boost::system::error_code failed;
        asio::write(socket, asio::buffer(answer), failed);
        std::array<char, 4096> asked{};
        while (!failed)
            socket.read_some(asio::buffer(asked), failed);
    };
}

/// What the client has said, until it ended; then why.
struct Heard
{
    std::vector<std::string> texts;
    beast::error_code end;
    unsigned code = 0; ///< Of its close frame.
};

Heard listen(ServerSide& stream)
{
    Heard heard;
    for (;;) {
        beast::flat_buffer message;
        stream.read(message, heard.end);
        if (heard.end)
            break;
        heard.texts.push_back(stream.got_text() ? beast::buffers_to_string(message.data()) : "binary");
    }
    heard.code = stream.reason().code;
    return heard;
}

/// A client, on the test's thread.
struct Fixture
{
    explicit Fixture(std::filesystem::path authorities = {})
        : client(make_websocket_client(context.get_executor(), HttpClientConfig(std::move(authorities))))
    {}

    template<class T>
    T run(asio::awaitable<T> body)
    {
        return finish<T>(asio::co_spawn(context, std::move(body), asio::use_future));
    }

    template<class T>
    T finish(std::future<T> outcome)
    {
        auto const end = std::chrono::steady_clock::now() + patience;
        while (outcome.wait_for(0s) != std::future_status::ready && std::chrono::steady_clock::now() < end)
            context.run_one_for(100ms);
        BOOST_TEST_REQUIRE((outcome.wait_for(0s) == std::future_status::ready), "it did not end in time");
        return outcome.get();
    }

    Connected connect(WebSocketRequest request) { return run(client->connect(std::move(request))); }
    Connected connect(std::string url) { return connect(WebSocketRequest(std::move(url))); }
    std::unique_ptr<Channel> open(std::string url)
    {
        auto channel = connect(std::move(url));
        BOOST_TEST_REQUIRE(channel.has_value());
        return std::move(*channel);
    }

    asio::io_context context{1};
    asio::executor_work_guard<asio::io_context::executor_type> work{context.get_executor()};
    std::unique_ptr<WebSocketClient> client;
};

std::string url_of(RunningServer const& server, std::string const& path, std::string const& scheme = "ws",
                   std::string const& host = "127.0.0.1")
{
    return scheme + "://" + host + ":" + std::to_string(server.port()) + path;
}

} // namespace

BOOST_AUTO_TEST_CASE(texts_go_both_ways)
{
    RunningServer server;
    Fixture fixture;
    auto const channel = fixture.open(url_of(server, "/echo"));
    std::string const large(60'000, 'x');
    BOOST_TEST(channel->send("one").has_value());
    BOOST_TEST(channel->send("").has_value());
    BOOST_TEST(channel->send(large).has_value());
    BOOST_TEST(channel->queued() > large.size());
    BOOST_TEST((fixture.run(channel->receive()) == result<std::string>("one")));
    BOOST_TEST((fixture.run(channel->receive()) == result<std::string>("")));
    BOOST_TEST((fixture.run(channel->receive()) == result<std::string>(large)));
    BOOST_TEST(channel->queued() == 0U);
}

BOOST_AUTO_TEST_CASE(the_handshake_has_the_headers_of_the_request)
{
    RunningServer server;
    Fixture fixture;
    WebSocketRequest request(url_of(server, "/who"));
    request.headers.emplace_back("X-Forwarded-For", "10.0.0.9");
    auto const channel = fixture.connect(request);
    BOOST_TEST_REQUIRE(channel.has_value());
    auto const greeting = fixture.run((*channel)->receive());
    BOOST_TEST_REQUIRE(greeting.has_value());
    BOOST_TEST(greeting->starts_with("I am 10.0.0.9,"));
}

BOOST_AUTO_TEST_CASE(the_host_is_that_of_the_url_or_of_the_request)
{
    std::promise<std::string> first;
    std::promise<std::string> second;
    int connections = 0;
    Peer const peer([&](tcp::socket socket) {
        beast::flat_buffer buffer;
        beast::http::request<beast::http::empty_body> asked;
        beast::error_code failed;
        beast::http::read(socket, buffer, asked, failed);
        (++connections == 1 ? first : second).set_value(std::string(asked[beast::http::field::host]));
    });
    Fixture fixture;
    WebSocketRequest request(peer.url());
    BOOST_TEST(!fixture.connect(request).has_value());
    request.headers.emplace_back("host", "machine.example.org");
    BOOST_TEST((fixture.connect(request).error() == errc::protocol_error)); // it closed
    auto const host = first.get_future().get();
    BOOST_TEST(("ws://" + host + "/client") == peer.url());
    BOOST_TEST(second.get_future().get() == "machine.example.org");
}

BOOST_AUTO_TEST_CASE(tls_needs_a_certificate_that_is_trusted_and_for_that_host)
{
    SignedItself const certificate("websocket_client");
    SignedItself const other("websocket_client_other", "DNS:elsewhere.example.org");
    RunningServer server(certificate.shown());
    RunningServer elsewhere(other.shown());
    Fixture trusting(certificate.certificate());
    auto const channel = trusting.open(url_of(server, "/echo", "wss"));
    BOOST_TEST(channel->send("one").has_value());
    BOOST_TEST((trusting.run(channel->receive()) == result<std::string>("one")));

    auto const unknown = Fixture().connect(url_of(server, "/echo", "wss"));
    BOOST_TEST((unknown.error() == errc::unreachable));
    BOOST_TEST(unknown.error().detail().find("caFile") != std::string::npos);
    auto const misnamed = Fixture(other.certificate()).connect(url_of(elsewhere, "/echo", "wss"));
    BOOST_TEST((misnamed.error() == errc::unreachable));
    BOOST_TEST(misnamed.error().detail().find("elsewhere.example.org") != std::string::npos);
    BOOST_TEST(
        (trusting.connect(url_of(server, "/echo", "ws")).error().code() != boost::system::error_code()));
}

BOOST_AUTO_TEST_CASE(close_codes_pass_by_tls_too)
{
    SignedItself const certificate("websocket_client_close");
    RunningServer server(certificate.shown());
    Fixture fixture(certificate.certificate());
    auto const channel = fixture.open(url_of(server, "/echo", "wss"));
    server.stop(); // with 1001
    BOOST_TEST((fixture.run(channel->receive()).error() == errc::closed));
    BOOST_TEST(channel->farewell() == 1001);
}

BOOST_AUTO_TEST_CASE(addresses_that_lead_nowhere)
{
    Fixture fixture;
    for (std::string const url : {"", "http://127.0.0.1/client", "ws://", "ws://127.0.0.1:0/", "ws://a b/"})
        BOOST_TEST((fixture.connect(url).error() == errc::invalid_url), url);
    std::string unused;
    {
        Peer const peer([](tcp::socket) {});
        unused = peer.url();
    }
    BOOST_TEST((fixture.connect(unused).error() == errc::unreachable));
}

BOOST_AUTO_TEST_CASE(who_accepts_no_websocket)
{
    Fixture fixture;
    for (std::string const status : {"403 Forbidden", "404 Not Found", "200 OK", "503 Busy"}) {
        Peer const peer(answering("HTTP/1.1 " + status + "\r\nContent-Length: 2\r\n\r\nno"));
        auto const refused = fixture.connect(peer.url());
        BOOST_TEST((refused.error() == errc::protocol_error));
        BOOST_TEST(refused.error().detail().find(status) != std::string::npos, refused.error().detail());
    }
    Peer const other(answering("SSH-2.0-OpenSSH_9.2\r\n\r\n"));
    BOOST_TEST((fixture.connect(other.url()).error() == errc::protocol_error));
    Peer const liar(
        answering("HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: upgrade\r\n"
                  "Sec-WebSocket-Accept: AAAAAAAAAAAAAAAAAAAAAAAAAAA=\r\n\r\n"));
    BOOST_TEST((fixture.connect(liar.url()).error() == errc::protocol_error));
}

BOOST_AUTO_TEST_CASE(who_never_answers_the_handshake)
{
    Peer const peer(answering(""));
    Fixture fixture;
    WebSocketRequest request(peer.url());
    request.timeout = 100ms;
    BOOST_TEST((fixture.connect(request).error() == errc::timed_out));

    request.timeout = patience;
    asio::cancellation_signal cancel;
    auto connecting = asio::co_spawn(fixture.context, fixture.client->connect(request),
                                     asio::bind_cancellation_slot(cancel.slot(), asio::use_future));
    while (fixture.context.run_one_for(50ms) > 0)
        ; // until it waits for the answer
    cancel.emit(asio::cancellation_type::terminal);
    auto const abandoned = fixture.finish<Connected>(std::move(connecting));
    BOOST_TEST((abandoned.error().code() == asio::error::operation_aborted));
}

BOOST_AUTO_TEST_CASE(the_other_side_closes_with_a_code)
{
    Peer const peer(after_handshake([](ServerSide& stream) {
        beast::error_code failed;
        stream.write(asio::buffer("last", 4), failed);
        stream.binary(true);
        stream.write(asio::buffer("\x01", 1), failed);
        stream.close(websocket::close_reason(static_cast<websocket::close_code>(4001), "done"), failed);
    }));
    Fixture fixture;
    auto const channel = fixture.open(peer.url());
    BOOST_TEST((fixture.run(channel->receive()) == result<std::string>("last")));
    BOOST_TEST((fixture.run(channel->receive()) == result<std::string>("\x01")));
    BOOST_TEST((fixture.run(channel->receive()).error() == errc::closed));
    BOOST_TEST(channel->farewell() == 4001);
    BOOST_TEST((channel->send("late").error() == errc::closed));
}

BOOST_AUTO_TEST_CASE(a_lost_connection_is_not_a_closed_one)
{
    Peer const peer(after_handshake([](ServerSide& stream) {
        beast::error_code failed;
        stream.write(asio::buffer("last", 4), failed);
        stream.next_layer().close(failed);
    }));
    Fixture fixture;
    auto const channel = fixture.open(peer.url());
    BOOST_TEST((fixture.run(channel->receive()) == result<std::string>("last")));
    BOOST_TEST((fixture.run(channel->receive()).error() == errc::unreachable));
    BOOST_TEST(channel->farewell() == 0);
}

BOOST_AUTO_TEST_CASE(what_is_queued_and_the_close_frame_still_go_out)
{
    std::promise<Heard> heard;
    Peer const peer(after_handshake([&](ServerSide& stream) { heard.set_value(listen(stream)); }));
    Fixture fixture;
    auto channel = fixture.open(peer.url());
    BOOST_TEST(channel->send("one").has_value());
    BOOST_TEST(channel->send("two").has_value());
    channel->close(4000, std::string(200, 'r'));
    channel->close(4009);
    BOOST_TEST((channel->send("late").error() == errc::closed));
    BOOST_TEST((fixture.run(channel->receive()).error() == errc::closed));
    BOOST_TEST(channel->farewell() == 0);
    channel.reset();
    auto const said = fixture.finish<Heard>(heard.get_future());
    BOOST_TEST(said.texts == (std::vector<std::string>{"one", "two"}), boost::test_tools::per_element());
    BOOST_TEST((said.end == websocket::error::closed));
    BOOST_TEST(said.code == 4000U);
}

BOOST_AUTO_TEST_CASE(a_channel_that_is_destroyed_drops_its_connection)
{
    std::promise<Heard> heard;
    Peer const peer(after_handshake([&](ServerSide& stream) { heard.set_value(listen(stream)); }));
    Fixture fixture;
    auto channel = fixture.open(peer.url());
    channel.reset();
    auto ended = heard.get_future();
    BOOST_TEST_REQUIRE(
        (ended.wait_for(patience) == std::future_status::ready)); // without a turn of the event loop
    auto const said = ended.get();
    BOOST_TEST((said.end == asio::error::eof || said.end == asio::error::connection_reset));
    BOOST_TEST(said.code == 0U);
}

BOOST_AUTO_TEST_CASE(pings_are_answered)
{
    std::promise<std::string> answered;
    Peer const peer(after_handshake([&](ServerSide& stream) {
        stream.control_callback([&](websocket::frame_type kind, beast::string_view payload) {
            if (kind == websocket::frame_type::pong)
                answered.set_value(std::string(payload));
        });
        beast::error_code failed;
        stream.ping("are you there", failed);
        (void)listen(stream);
    }));
    Fixture fixture;
    auto const channel = fixture.open(peer.url());
    BOOST_TEST(fixture.finish<std::string>(answered.get_future()) == "are you there");
}

BOOST_AUTO_TEST_CASE(a_message_that_is_too_long_closes)
{
    std::promise<Heard> heard;
    Peer const peer(after_handshake([&](ServerSide& stream) {
        beast::error_code failed;
        stream.write(asio::buffer(std::string(100, 'x')), failed);
        stream.write(asio::buffer(std::string(101, 'x')), failed);
        heard.set_value(listen(stream));
    }));
    Fixture fixture;
    WebSocketRequest request(peer.url());
    request.max_message = 100;
    auto const channel = fixture.connect(request);
    BOOST_TEST_REQUIRE(channel.has_value());
    BOOST_TEST((fixture.run((*channel)->receive()) == result<std::string>(std::string(100, 'x'))));
    BOOST_TEST((fixture.run((*channel)->receive()).error() == errc::closed));
    BOOST_TEST((*channel)->farewell() == 0);
    BOOST_TEST(heard.get_future().get().code == 1009U);
}

BOOST_AUTO_TEST_CASE(who_never_reads_is_dropped)
{
    std::promise<void> over;
    Peer const peer(after_handshake([&](ServerSide&) { over.get_future().wait(); }));
    Fixture fixture;
    auto const channel = fixture.open(peer.url());
    BOOST_TEST(channel->send("").has_value());
    BOOST_TEST(channel->queued() > 0U); // what is empty takes memory, too
    result<> sent;
    std::size_t most = 0;
    for (int i = 0; i < 10'000 && sent; ++i) { // far more than the kernel buffers for a connection
        most = std::max(most, channel->queued());
        sent = channel->send(std::string(60'000, 'x'));
        fixture.context.poll();
    }
    BOOST_TEST((sent == result<>(Failure(errc::too_large))));
    BOOST_TEST(most <= WebSocketRequest().max_queued);
    BOOST_TEST((fixture.run(channel->receive()).error() == errc::unreachable));
    over.set_value();
}

BOOST_AUTO_TEST_CASE(who_floods_waits_until_somebody_receives)
{
    RunningServer server;
    Fixture fixture;
    auto const channel = fixture.open(url_of(server, "/flood"));
    auto const end = std::chrono::steady_clock::now() + patience;
    while (!server.endpoint.flood_refused && std::chrono::steady_clock::now() < end)
        fixture.context.run_one_for(10ms);
    BOOST_TEST(server.endpoint.flood_refused.load()); // the client has left the rest in the socket
    std::size_t messages = 0;
    result<std::string> message = std::string();
    while (message) {
        message = fixture.run(channel->receive());
        if (message)
            BOOST_TEST(message->size() == 60'000U);
        ++messages;
    }
    BOOST_TEST(messages > 1U);
    BOOST_TEST((message.error() == errc::unreachable));
}

BOOST_AUTO_TEST_CASE(who_stops_receiving_loses_nothing)
{
    RunningServer server;
    Fixture fixture;
    auto const channel = fixture.open(url_of(server, "/echo"));
    asio::cancellation_signal cancel;
    auto receiving = asio::co_spawn(fixture.context, channel->receive(),
                                    asio::bind_cancellation_slot(cancel.slot(), asio::use_future));
    fixture.context.poll();
    BOOST_TEST(channel->send("one").has_value());
    cancel.emit(asio::cancellation_type::terminal);
    auto const stopped = fixture.finish<result<std::string>>(std::move(receiving));
    BOOST_TEST((stopped.error().code() == asio::error::operation_aborted));
    BOOST_TEST((fixture.run(channel->receive()) == result<std::string>("one")));
}

BOOST_AUTO_TEST_CASE(an_event_loop_that_ends_leaves_nothing)
{
    RunningServer server;
    Peer const silent(answering(""));
    {
        Fixture fixture;
        auto channel = fixture.open(url_of(server, "/echo"));
        auto closing = fixture.open(url_of(server, "/echo"));
        asio::co_spawn(fixture.context, fixture.client->connect(WebSocketRequest(silent.url())),
                       asio::detached);
        asio::co_spawn(fixture.context, channel->receive(), asio::detached);
        fixture.context.run_for(50ms);
        closing->close(4000);
        closing.reset();
    }
    BOOST_TEST(server.stop());
}

BOOST_AUTO_TEST_SUITE_END()
