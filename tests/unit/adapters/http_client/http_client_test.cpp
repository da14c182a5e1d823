#include "unit_test.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/use_future.hpp>
#include <boost/asio/write.hpp>

#include <atomic>
#include <functional>
#include <sys/socket.h>
#include <thread>
#include <vector>

using namespace webots_cloud;
using namespace std::chrono_literals;
namespace asio = boost::asio;
using asio::ip::tcp;

// The rows of the table in protocol section 3, with a real peer: which failures mean down, and which merely
// slow.
BOOST_AUTO_TEST_SUITE(http_client)

namespace {

constexpr std::string_view good = "HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n42";

/// A server: `answer` returns what to send for each request of each connection; if nothing, it closes.
class Peer
{
public:
    using Answer = std::function<std::string(int connection, int request)>;

    explicit Peer(Answer answer)
        : answer_(std::move(answer)), acceptor_(context_, {asio::ip::address_v4::loopback(), 0}),
          thread_([this] { serve(); })
    {}

    ~Peer()
    {
        ::shutdown(acceptor_.native_handle(), SHUT_RDWR);
        thread_.join();
    }

    std::string url(std::string const& scheme = "http") const
    {
        return scheme + "://127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port()) + "/load";
    }

    std::atomic<int> connections = 0;
    std::atomic<std::size_t> written = 0; ///< Bytes sent, including those buffered by the kernel.

private:
    void serve()
    {
        for (;;) {
            boost::system::error_code failed;
            tcp::socket socket(context_);
            acceptor_.accept(socket, failed);
            if (failed)
                return;
            serve_websocket(socket, ++connections);
        }
    }

    void serve_websocket(tcp::socket& socket, int connection)
    {
        std::string text;
        for (int request = 1;; ++request) {
            boost::system::error_code failed;
            auto const size = asio::read_until(socket, asio::dynamic_buffer(text), "\r\n\r\n", failed);
            if (failed)
                return;
            text.erase(0, size);
            auto const bytes = answer_(connection, request);
            if (bytes.empty())
                return;
            written += asio::write(socket, asio::buffer(bytes), failed);
        }
    }

    Answer answer_;
    asio::io_context context_;
    tcp::acceptor acceptor_;
    std::thread thread_;
};

/// A client and its io_context.
struct Client
{
    result<HttpResponse> get(std::string url, Duration timeout = 30s)
    {
        HttpRequest request(std::move(url));
        request.timeout = timeout;
        return send(std::move(request));
    }

    result<HttpResponse> send(HttpRequest request)
    {
        auto answer = asio::co_spawn(context, http->send(std::move(request)), asio::use_future);
        context.restart();
        context.run();
        return answer.get();
    }

    asio::io_context context{1};
    std::unique_ptr<HttpClient> http = make_http_client(context.get_executor());
};

/// The error when the peer sends this answer and then waits for the client to close.
Failure failure_of(std::string const& bytes, Duration timeout = 30s)
{
    Peer peer([&](int, int) { return bytes; });
    auto const answer = Client().get(peer.url(), timeout);
    BOOST_TEST_REQUIRE(!answer.has_value(), bytes);
    return answer.error();
}

} // namespace

BOOST_AUTO_TEST_CASE(whatever_the_status_an_answer_is_an_answer)
{
    for (auto const* status : {"200 OK", "302 Found", "404 Not Found", "503 Busy"}) {
        Peer peer([&](int, int) {
            return std::string("HTTP/1.1 ") + status +
                   "\r\nLocation: http://example.org/\r\nContent-Length: 1\r\n\r\nx";
        });
        auto const answer = Client().get(peer.url());
        BOOST_TEST(std::to_string(answer.value().status) == std::string(status, 3));
        BOOST_TEST(answer->body == "x");
    }
}

BOOST_AUTO_TEST_CASE(a_port_where_nobody_listens_is_unreachable)
{
    asio::io_context context;
    tcp::acceptor closed(context, {asio::ip::address_v4::loopback(), 0});
    auto const port = std::to_string(closed.local_endpoint().port());
    closed.close();
    BOOST_TEST((Client().get("http://127.0.0.1:" + port + "/load").error() == errc::unreachable));
}

BOOST_AUTO_TEST_CASE(a_name_that_nobody_knows_is_unreachable)
{
    auto const nobody = Client().get("http://" + std::string(300, 'x') + "/load");
    BOOST_TEST((nobody.error() == errc::unreachable));
    BOOST_TEST(nobody.error().message().find("can't be resolved") != std::string::npos);
}

// A name server, or who announces a machine, leads us to no service of our own machine.
BOOST_AUTO_TEST_CASE(who_is_elsewhere_is_not_reached_on_the_loopback)
{
    Peer peer([&](int, int) { return std::string("HTTP/1.1 200 OK\r\nContent-Length: 1\r\n\r\nx"); });
    auto url = peer.url();
    auto const host = url.find("127.0.0.1");
    BOOST_TEST_REQUIRE(host != std::string::npos);
    for (std::string const name : {"localhost", "127.0.0.1", "[::ffff:127.0.0.1]", "[64:ff9b::127.0.0.1]"}) {
        HttpRequest request(std::string(url).replace(host, 9, name));
        request.elsewhere = true;
        auto const answer = Client().send(std::move(request));
        BOOST_TEST_REQUIRE(!answer.has_value(), name);
        BOOST_TEST((answer.error() == errc::unreachable));
        BOOST_TEST(answer.error().message().find("discoverLoopback") != std::string::npos,
                   answer.error().message());
    }
    BOOST_TEST(Client().send(HttpRequest(url.replace(host, 9, "localhost"))).has_value());
}

BOOST_AUTO_TEST_CASE(a_peer_that_lets_nobody_in_is_unreachable)
{
    asio::io_context context;
    tcp::acceptor full(context, tcp::v4());
    full.bind({asio::ip::address_v4::loopback(), 0});
    full.listen(0); // queues one or two connections, which are never accepted
    std::vector<tcp::socket> crowd;
    for (int i = 0; i < 8; ++i) {
        crowd.emplace_back(context);
        crowd.back().open(tcp::v4());
        crowd.back().native_non_blocking(true);
        auto const where = full.local_endpoint();
        (void)::connect(crowd.back().native_handle(), where.data(),
                        static_cast<socklen_t>(where.size())); // does not wait
    }
    auto const url = "http://127.0.0.1:" + std::to_string(full.local_endpoint().port()) + "/load";
    BOOST_TEST((Client().get(url, 300ms).error() == errc::unreachable));
}

BOOST_AUTO_TEST_CASE(a_peer_that_speaks_no_tls_is_unreachable_for_https)
{
    asio::io_context context;
    tcp::acceptor plain(context, {asio::ip::address_v4::loopback(), 0});
    std::thread talks([&plain] {
        auto socket = plain.accept();
        asio::write(socket, asio::buffer(good));
        std::string hello;
        boost::system::error_code closed;
        asio::read(socket, asio::dynamic_buffer(hello), closed); // until the client has gone
    });
    auto const url = "https://127.0.0.1:" + std::to_string(plain.local_endpoint().port()) + "/load";
    BOOST_TEST((Client().get(url).error() == errc::unreachable));
    talks.join();
}

BOOST_AUTO_TEST_CASE(a_peer_that_does_not_shake_hands_in_time_is_slow)
{
    Peer waits([](int, int) { return std::string(good); }); // for an empty line, which TLS does not send
    BOOST_TEST((Client().get(waits.url("https"), 300ms).error() == errc::timed_out));
}

BOOST_AUTO_TEST_CASE(only_an_answer_that_is_late_is_slowness)
{
    BOOST_TEST((failure_of("HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\n12", 300ms) == errc::timed_out));
    BOOST_TEST((failure_of("HTTP/1.1 200 O", 300ms) == errc::timed_out));
}

BOOST_AUTO_TEST_CASE(who_closes_before_the_end_of_the_answer_or_talks_nonsense_breaks_the_protocol)
{
    BOOST_TEST((failure_of("") == errc::protocol_error));
    BOOST_TEST((failure_of("hello\r\n\r\n") == errc::protocol_error));
}

BOOST_AUTO_TEST_CASE(answers_without_end_are_read_no_further)
{
    BOOST_TEST((failure_of("HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\n") == errc::too_large));
    BOOST_TEST((failure_of("HTTP/1.1 200 OK\r\nX: " + std::string(100'000, 'x')) == errc::too_large));
}

// Once it took 2.8 GB of memory and blocked the event loop for 4.9 s.
BOOST_AUTO_TEST_CASE(what_surrounds_the_chunks_of_an_answer_does_not_grow_without_end)
{
    constexpr std::size_t more = 64 << 20;
    std::string const chunked = "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n";
    auto const repeated = [](std::string const& text) {
        std::string all;
        while (all.size() < more)
            all += text;
        return all;
    };
    struct Attack
    {
        char const* name;
        std::string bytes;
    };
    std::vector<Attack> attacks;
    attacks.push_back({"an extension", chunked + "1;" + repeated("x")});
    attacks.push_back({"extensions", chunked + repeated("1;" + std::string(8000, 'x') + "\r\na\r\n")});
    attacks.push_back({"a trailer", chunked + "1\r\na\r\n0\r\nX: " + repeated("x")});
    attacks.push_back({"trailers", chunked + "1\r\na\r\n0\r\n" + repeated("X: y\r\n")});
    attacks.push_back({"headers", "HTTP/1.1 200 OK\r\n" + repeated("X: y\r\n")});
    attacks.push_back({"a body", chunked + repeated("1\r\na\r\n")});
    for (auto const& attack : attacks) {
        Peer peer([&](int, int) { return attack.bytes; });
        {
            auto const answer = Client().get(peer.url());
            BOOST_TEST_REQUIRE(!answer.has_value(), attack.name);
            BOOST_TEST((answer.error() == errc::too_large), attack.name);
        }
        BOOST_TEST(peer.written < more / 2, attack.name << ": " << peer.written);
    }
}

BOOST_AUTO_TEST_CASE(chunks_with_extensions_and_trailers_are_understood)
{
    Peer peer([](int, int) {
        return "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n1;a=b\r\n4\r\n1;" +
               std::string(4000, 'x') + "\r\n2\r\n0\r\nX: y\r\n\r\n";
    });
    Client client;
    for (int i = 0; i < 3; ++i)
        BOOST_TEST(client.get(peer.url()).value().body == "42");
    BOOST_TEST(peer.connections == 1);
}

BOOST_AUTO_TEST_CASE(an_answer_may_be_as_long_as_its_limit)
{
    Peer peer([](int, int) {
        return "HTTP/1.1 200 OK\r\nContent-Length: 65536\r\n\r\n" + std::string(65536, 'x');
    });
    BOOST_TEST(Client().get(peer.url()).value().body.size() == 65536u);
}

BOOST_AUTO_TEST_CASE(a_connection_is_kept_for_the_next_request)
{
    Peer peer([](int, int) { return std::string(good); });
    Client client;
    for (int i = 0; i < 3; ++i)
        BOOST_TEST(client.get(peer.url()).value().body == "42");
    BOOST_TEST(peer.connections == 1);
}

BOOST_AUTO_TEST_CASE(a_kept_connection_that_the_peer_has_closed_costs_nothing_but_another)
{
    Peer peer([](int, int request) { return request == 1 ? std::string(good) : std::string(); });
    Client client;
    for (int i = 0; i < 3; ++i)
        BOOST_TEST(client.get(peer.url()).value().body == "42");
    BOOST_TEST(peer.connections == 3);
}

BOOST_AUTO_TEST_CASE(what_is_no_address_of_a_web_server_is_an_invalid_url)
{
    for (auto const* url : {"", "nonsense", "ftp://h/", "http://", "http://h:0/", "http://h:99999/",
                            "http://h:080/", "http://h:/"})
        BOOST_TEST((Client().get(url).error() == errc::invalid_url), url);
}

BOOST_AUTO_TEST_SUITE_END()
