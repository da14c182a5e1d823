#include "unit_test.hpp"

#include "adapters/gateway/tunnels.hpp"
#include "adapters/tls/signed_itself.hpp"
#include "adapters/tls/tls_certificate.hpp"
#include "adapters/tls/tls_socket.hpp"
#include "forward_fixture.hpp"

#include <boost/asio/local/stream_protocol.hpp>

#include <openssl/ssl.h>

#include <atomic>
#include <filesystem>
#include <netinet/tcp.h>
#include <sys/resource.h>
#include <thread>
#include <vector>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(tunnels)

namespace {

/// As much, or all there is until the other side ends.
std::string read_tls(SSL* tls, std::size_t size)
{
    std::string text(size, '\0');
    std::size_t got = 0;
    for (int part = 1; got < size && part > 0; got += static_cast<std::size_t>(std::max(part, 0)))
        part = SSL_read(tls, text.data() + got, static_cast<int>(size - got));
    text.resize(got);
    return text;
}

constexpr std::size_t far_too_much = 200'000'000; // for what the kernel buffers between two programs

/// How many bytes are relayed at most before others have their turn.
class TurnWatch
{
public:
    TurnWatch(RunningServer& server) : server_(server)
    {
        server_.run([this] { look(); });
    }
    ~TurnWatch()
    {
        server_.run([this] { is_over_ = true; });
        server_.run([] {}); // the last look has been
        server_.run([] {});
    }

    std::uint64_t most = 0;

private:
    void look()
    {
        if (is_over_)
            return;
        auto const moved = server_.statistics_now().tunnel_bytes_sent;
        most = std::max(most, moved - moved_);
        moved_ = moved;
        server_.post([this] { look(); });
    }

    RunningServer& server_;
    std::uint64_t moved_ = 0;
    bool is_over_ = false;
};

/// One side of a tunnel by itself: what the test holds of it.
struct SocketPair
{
    SocketPair()
    {
        BOOST_TEST_REQUIRE(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends) == 0);
    }
    SocketPair(SocketPair const&) = delete;
    SocketPair& operator=(SocketPair const&) = delete;
    ~SocketPair() { ::close(ends[1]); } // the first belongs to the tunnel

    int ends[2];
};

/// Both ends of a connection over TLS.
class TlsPair
{
public:
    explicit TlsPair(SSL_CTX* server_context)
        : client_(context_), client_context_(SSL_CTX_new(TLS_client_method())), tls_(SSL_new(client_context_))
    {
        using tcp = boost::asio::ip::tcp;
        tcp::acceptor acceptor(context_, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
        client_.connect(acceptor.local_endpoint());
        auto accepted = acceptor.accept();
        accepted.set_option(tcp::no_delay(true));
        server.descriptor = accepted.release();
        server.tls.reset(SSL_new(server_context));
        adapters::attach_tls(server.tls.get(), server.descriptor);
        SSL_set_fd(tls_, client_.native_handle());
        std::thread accepting([this] { SSL_accept(server.tls.get()); });
        bool const is_connected = SSL_connect(tls_) == 1;
        accepting.join();
        BOOST_TEST_REQUIRE(is_connected);
    }
    TlsPair(TlsPair const&) = delete;
    TlsPair& operator=(TlsPair const&) = delete;
    ~TlsPair()
    {
        SSL_free(tls_);
        SSL_CTX_free(client_context_);
    }

    /// By the client, with data.
    std::uint32_t packets_received()
    {
        // `tcpi_data_segs_in`, which the C library's own `tcp_info` has not got.
        constexpr std::size_t place = 152 / sizeof(std::uint32_t);
        std::array<std::uint32_t, place + 1> info{};
        socklen_t size = sizeof info;
        BOOST_TEST_REQUIRE(::getsockopt(client_.native_handle(), IPPROTO_TCP, TCP_INFO, info.data(), &size) ==
                           0);
        return info[place];
    }

    std::string read(std::size_t size) { return read_tls(tls_, size); }

    adapters::NetworkStream::Released server;

private:
    boost::asio::io_context context_;
    boost::asio::ip::tcp::socket client_;
    SSL_CTX* client_context_;
    SSL* tls_;
};

/// A browser over TLS.
class TlsClient
{
public:
    explicit TlsClient(RunningServer const& server)
        : connection_(server), context_(SSL_CTX_new(TLS_client_method())), tls_(SSL_new(context_))
    {
        SSL_set_fd(tls_, connection_.descriptor());
        BOOST_TEST_REQUIRE(SSL_connect(tls_) == 1);
    }
    TlsClient(TlsClient const&) = delete;
    TlsClient& operator=(TlsClient const&) = delete;
    ~TlsClient()
    {
        SSL_free(tls_);
        SSL_CTX_free(context_);
    }

    void say(std::string_view bytes) { SSL_write(tls_, bytes.data(), static_cast<int>(bytes.size())); }

    std::string read(std::size_t size) { return read_tls(tls_, size); }

    std::string read_to(std::string_view end)
    {
        std::string text;
        for (auto byte = read(1); !byte.empty(); byte = read(1)) {
            text += byte;
            if (text.ends_with(end))
                break;
        }
        return text;
    }

    /// Says that nothing more will come.
    void shut_down()
    {
        SSL_shutdown(tls_);
        connection_.shut_down();
    }

    /// Whether the server has said that nothing more will come, instead of just going away.
    bool is_ended() { return read(1).empty() && (SSL_get_shutdown(tls_) & SSL_RECEIVED_SHUTDOWN) != 0; }

private:
    Client connection_;
    SSL_CTX* context_;
    SSL* tls_;
};

} // namespace

BOOST_AUTO_TEST_CASE(browsers_may_come_over_tls)
{
    SignedItself const certificate("tunnels");
    HttpServerParams params;
    params.network.ssl_certificate = certificate.certificate();
    params.network.ssl_key = certificate.key();
    RunningServer server(params);
    OtherServer other;
    server.endpoint.forward = other.forward();
    TlsClient browser(server);
    auto const file = much(3'000'000);
    for (int i = 0; i < 2; ++i) { // a file, over a connection that is used again
        browser.say(forwarded_request + "GET /own HTTP/1.1\r\nHost: h\r\n\r\n");
        auto upstream = other.accept();
        upstream.read_request();
        std::thread writer([&] { upstream.say(answer(file)); });
        browser.read_to("\r\n\r\n");
        BOOST_TEST((browser.read(file.size()) == file));
        writer.join();
        BOOST_TEST(browser.read_to("/own").ends_with("\r\n\r\n/own"));
    }
    browser.say("GET /forward HTTP/1.1\r\nHost: h\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\nearly");
    auto upstream = other.accept();
    upstream.read_request();
    upstream.say(accepted);
    BOOST_TEST(browser.read_to("\r\n\r\n").starts_with("HTTP/1.1 101 "));
    BOOST_TEST(upstream.read(5) == "early");
    auto const down = much(20'000'000);
    auto const up = much(1'000'000);
    std::thread writer([&] { upstream.say(down); });
    browser.say(up);
    BOOST_TEST((upstream.read(up.size()) == up));
    BOOST_TEST((browser.read(down.size()) == down));
    writer.join();
    browser.shut_down();
    BOOST_TEST(upstream.read_all() == "");
    upstream.say("last words");
    upstream.shut_down();
    BOOST_TEST(browser.read(10) == "last words");
    BOOST_TEST(browser.is_ended());
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 0));
}

// Each packet wakes the browser, which costs as much as encryption.
BOOST_AUTO_TEST_CASE(records_of_tls_share_packets)
{
    SignedItself const certificate("tunnels");
    auto const context = adapters::load_tls_context(certificate.certificate(), certificate.key());
    BOOST_TEST_REQUIRE(bool(context));
    TlsPair pair(context->get());
    adapters::TunnelEnd end(std::move(pair.server));
    std::string const two_records(30'000, 'x');
    // The kernel sends what it was told to hold back after a fifth of a second: once we may be that slow.
    bool is_one_packet = false;
    for (int i = 0; i < 10 && !is_one_packet; ++i) {
        auto const before = pair.packets_received();
        BOOST_TEST_REQUIRE(end.write(two_records) == two_records.size());
        BOOST_TEST_REQUIRE((pair.read(two_records.size()) == two_records));
        is_one_packet = pair.packets_received() == before + 1;
    }
    BOOST_TEST(is_one_packet);
}

BOOST_AUTO_TEST_CASE(everything_arrives_in_order_in_both_directions_at_once)
{
    RunningServer server;
    OtherServer other;
    OpenTunnel tunnel(server, other);
    auto const down = much(30'000'000);
    auto const up = much(5'000'000);
    std::thread upstream_writer([&] { tunnel.upstream.say(down); });
    std::thread browser_writer([&] { tunnel.browser.say(up); });
    std::string arrived_up;
    std::thread upstream_reader([&] { arrived_up = tunnel.upstream.read(up.size()); });
    BOOST_TEST((tunnel.browser.read(down.size()) == down));
    for (auto* const thread : {&upstream_writer, &browser_writer, &upstream_reader})
        thread->join();
    BOOST_TEST((arrived_up == up));
    auto const statistics = server.statistics();
    BOOST_TEST(statistics.tunnel_bytes_sent >= down.size());
    BOOST_TEST(statistics.tunnel_bytes_received >= up.size());
}

BOOST_AUTO_TEST_CASE(a_browser_that_does_not_read_holds_the_other_server_back_and_gets_all_in_the_end)
{
    RunningServer server;
    OtherServer other;
    OpenTunnel tunnel(server, other, 4096);
    auto const all = much(20'000'000);
    std::thread writer([&] { tunnel.upstream.say(all); });
    // It stands still, long before all of it has been taken.
    std::uint64_t before = 0;
    BOOST_TEST(eventually([&] {
        auto const now = server.statistics().tunnel_bytes_sent;
        bool const is_still = now > 0 && now == before;
        before = now;
        if (!is_still)
            server.run([] {});
        return is_still;
    }));
    BOOST_TEST(server.statistics().tunnel_bytes_sent < all.size());
    BOOST_TEST((tunnel.browser.read(all.size()) == all));
    writer.join();
}

BOOST_AUTO_TEST_CASE(a_browser_that_takes_nothing_for_too_long_is_cut)
{
    HttpServerParams params;
    params.write_timeout = std::chrono::seconds(1);
    RunningServer server(params);
    OtherServer other;
    OpenTunnel tunnel(server, other, 4096);
    tunnel.upstream.say(std::string(far_too_much, 'x')); // until the connection ends
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 0));
    BOOST_TEST(server.statistics().timed_out == 1u);
    BOOST_TEST(server.statistics().tunnel_bytes_sent < far_too_much);
}

BOOST_AUTO_TEST_CASE(a_silent_tunnel_is_closed_and_one_that_speaks_is_not)
{
    HttpServerParams params;
    params.tunnel_idle_timeout = std::chrono::seconds(2);
    RunningServer server(params);
    OtherServer other;
    OpenTunnel silent(server, other);
    OpenTunnel living(server, other);
    std::atomic<bool> is_over = false;
    std::thread speaker([&] {
        while (!is_over) {
            living.upstream.say("x");
            (void)living.browser.read(1);
        }
    });
    BOOST_TEST(silent.browser.read_all() == "");
    BOOST_TEST(silent.upstream.read_all() == "");
    BOOST_TEST(server.statistics().tunnels == 1u);
    is_over = true;
    speaker.join();
}

BOOST_AUTO_TEST_CASE(who_has_said_all_is_not_waited_for_for_ever)
{
    HttpServerParams params;
    params.write_timeout = std::chrono::seconds(1);
    RunningServer server(params);
    OtherServer other;
    OpenTunnel tunnel(server, other);
    tunnel.browser.shut_down();
    BOOST_TEST(tunnel.upstream.read_all() == "");
    BOOST_TEST(tunnel.browser.read_all() == "");
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 0));
}

BOOST_AUTO_TEST_CASE(a_broker_that_hands_out_nothing_is_late)
{
    namespace local = boost::asio::local;
    auto const path = std::filesystem::temp_directory_path() /
                      ("webots_cloud_mute_" + std::to_string(::getpid()) + ".sock");
    std::filesystem::remove(path);
    boost::asio::io_context context;
    local::stream_protocol::acceptor mute(context, local::stream_protocol::endpoint(path.string()));
    HttpServerParams params;
    params.connect_timeout = std::chrono::seconds(1);
    RunningServer server(params);
    server.endpoint.forward.emplace();
    server.endpoint.forward->upstream.broker = path;
    server.endpoint.forward->target = "/";
    Client browser(server);
    browser.say(forwarded_request);
    BOOST_TEST(browser.read_to("moment.\r\n").starts_with("HTTP/1.1 504 "));
    std::filesystem::remove(path);
}

BOOST_AUTO_TEST_CASE(a_browser_that_goes_away_from_an_endless_answer_ends_it)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward();
    auto browser = std::make_unique<Client>(server);
    browser->say(forwarded_request);
    auto upstream = other.accept();
    upstream.read_request();
    upstream.say("HTTP/1.1 200 OK\r\n\r\npicture");
    BOOST_TEST(browser->read_to("picture").ends_with("picture"));
    browser.reset();
    BOOST_TEST(upstream.read_all() == "");
    upstream.close();
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 0));
}

// The event loop belongs to nobody alone.
BOOST_AUTO_TEST_CASE(however_much_there_is_to_relay_others_have_their_turn)
{
    RunningServer server;
    OtherServer other;
    constexpr int count = 8;
    constexpr std::size_t size = 10'000'000;
    std::vector<std::unique_ptr<OpenTunnel>> tunnels;
    for (int i = 0; i < count; ++i)
        tunnels.push_back(std::make_unique<OpenTunnel>(server, other));
    TurnWatch watch(server);
    std::vector<std::thread> threads;
    for (auto& tunnel : tunnels) {
        threads.emplace_back([&] { tunnel->upstream.say(std::string(size, 'x')); });
        threads.emplace_back([&] { BOOST_TEST(tunnel->browser.read(size).size() == size); });
    }
    for (auto& thread : threads)
        thread.join();
    BOOST_TEST(watch.most > 0u);
    BOOST_TEST(watch.most <= 1'200'000u);
}

BOOST_AUTO_TEST_CASE(a_group_over_its_limit_waits_without_keeping_the_event_loop_busy)
{
    boost::asio::io_context context{1};
    HttpServerParams const params;
    HttpServerStatistics statistics;
    adapters::Tunnels tunnels(context.get_executor(), params, statistics);
    auto const group = std::make_shared<TunnelGroup>(400'000);
    SocketPair browser;
    SocketPair upstream;
    adapters::TunnelPlan plan;
    plan.browser.descriptor = browser.ends[0];
    plan.upstream.descriptor = upstream.ends[0];
    plan.is_two_way = true;
    plan.group = group;
    tunnels.open(std::move(plan));
    std::string const part(10'000, 'x');
    std::array<char, 16'384> read{};
    std::size_t arrived = 0;
    int handlers = 0;
    auto const begin = std::chrono::steady_clock::now();
    while (arrived < 300'000 && std::chrono::steady_clock::now() < begin + patience) {
        // There is always more to relay than may be.
        while (::send(upstream.ends[1], part.data(), part.size(), MSG_NOSIGNAL) > 0)
            ;
        handlers += static_cast<int>(context.run_one());
        for (ssize_t size; (size = ::recv(browser.ends[1], read.data(), read.size(), 0)) > 0;)
            arrived += static_cast<std::size_t>(size);
    }
    BOOST_TEST(arrived >= 300'000u);
    BOOST_TEST(group->sent() >= arrived);
    BOOST_TEST(handlers < 1000, "spinning, it would be tens of thousands");
    group->close();
    while (tunnels.descriptors() > 0)
        context.run_one();
}

BOOST_AUTO_TEST_CASE(when_the_server_stops_tunnels_are_cut_in_time)
{
    RunningServer server;
    OtherServer other;
    OpenTunnel tunnel(server, other);
    Client downloading(server);
    downloading.say(forwarded_request);
    auto upstream = other.accept();
    upstream.read_request();
    upstream.say("HTTP/1.1 200 OK\r\nContent-Length: 1000\r\n\r\nhalf");
    BOOST_TEST(downloading.read_to("half").ends_with("half"));
    Client asking(server);
    asking.say(forwarded_request);
    auto mute = other.accept();
    mute.read_request();
    BOOST_TEST(server.stop());
    for (BlockingConnection* const end :
         {static_cast<BlockingConnection*>(&tunnel.browser),
          static_cast<BlockingConnection*>(&tunnel.upstream), static_cast<BlockingConnection*>(&downloading),
          static_cast<BlockingConnection*>(&upstream), static_cast<BlockingConnection*>(&mute)})
        BOOST_TEST(end->read_all() == "");
}

BOOST_AUTO_TEST_CASE(a_tunnel_is_one_of_the_connections_of_its_address)
{
    HttpServerParams params;
    params.network.connections_per_address = 2;
    params.network.trusted_proxies.clear();
    RunningServer server(params);
    OtherServer other;
    auto first = std::make_unique<OpenTunnel>(server, other);
    OpenTunnel second(server, other);
    Client refused(server);
    BOOST_TEST(refused.read_all().starts_with("HTTP/1.1 503 "));
    first.reset();
    BOOST_TEST_REQUIRE(server.eventually_counts(&HttpServerStatistics::tunnels, 1));
    OpenTunnel third(server, other);
}

BOOST_AUTO_TEST_CASE(tunnels_through_a_proxy_are_counted_by_client)
{
    HttpServerParams params;
    params.network.connections_per_address = 1;
    RunningServer server(params);
    OtherServer other;
    server.endpoint.forward = other.forward();
    std::string const client = "X-Forwarded-For: 203.0.113.7\r\n";
    Client first(server);
    first.ask_upgrade("/forward", client);
    auto upstream = other.accept();
    upstream.read_request();
    upstream.say(accepted);
    BOOST_TEST(first.read_to("\r\n\r\n").starts_with("HTTP/1.1 101 "));
    Client second(server);
    second.ask_upgrade("/forward", client);
    BOOST_TEST(second.read_to("moment.\r\n").starts_with("HTTP/1.1 429 "));
    // An answer that may never end counts as well; one with an end does not.
    second.say("GET /forward HTTP/1.1\r\nHost: h\r\n" + client + "\r\n");
    {
        auto endless = other.accept();
        endless.read_request();
        endless.say("HTTP/1.1 200 OK\r\n\r\npicture");
        BOOST_TEST(second.read_to("moment.\r\n").starts_with("HTTP/1.1 429 "));
        BOOST_TEST(endless.read_all() == "");
    }
    second.say("GET /forward HTTP/1.1\r\nHost: h\r\n" + client + "\r\n");
    auto finite = other.accept();
    finite.read_request();
    finite.say(answer("file"));
    BOOST_TEST(second.read_to("file").starts_with("HTTP/1.1 200 "));
}

BOOST_AUTO_TEST_CASE(a_tunnel_takes_two_descriptors_of_those_that_there_are)
{
    rlimit usual{};
    BOOST_TEST_REQUIRE(::getrlimit(RLIMIT_NOFILE, &usual) == 0);
    auto few = usual;
    few.rlim_cur = 64;
    BOOST_TEST_REQUIRE(::setrlimit(RLIMIT_NOFILE, &few) == 0);
    HttpServerParams params;
    params.spare_descriptors = 1000; // half of all, at most
    RunningServer server(params);
    ::setrlimit(RLIMIT_NOFILE, &usual);
    OtherServer other;
    std::vector<std::unique_ptr<OpenTunnel>> tunnels;
    for (int i = 0; i < 15; ++i)
        tunnels.push_back(std::make_unique<OpenTunnel>(server, other));
    BOOST_TEST_REQUIRE(server.eventually_counts(&HttpServerStatistics::tunnels, 15));
    tunnels.push_back(std::make_unique<OpenTunnel>(server, other)); // the last one that fits
    BOOST_TEST_REQUIRE(server.eventually_counts(&HttpServerStatistics::tunnels, 16));
    Client refused(server);
    BOOST_TEST(refused.read_all().starts_with("HTTP/1.1 503 "));
    BOOST_TEST(server.statistics().refused_no_room == 1u);
    tunnels.pop_back();
    BOOST_TEST_REQUIRE(server.eventually_counts(&HttpServerStatistics::tunnels, 15));
    Client first(server);
    BOOST_TEST_REQUIRE(server.eventually_counts(&HttpServerStatistics::connections, 16));
    Client second(server);
    second.say(
        forwarded_request); // there is no room for the other server's connection but that of who is silent
    auto upstream = other.accept();
    upstream.read_request();
    upstream.say(answer("file"));
    BOOST_TEST(second.read_to("file").starts_with("HTTP/1.1 200 "));
    BOOST_TEST(first.read_all() == "");
}

BOOST_AUTO_TEST_SUITE_END()
