#include "unit_test.hpp"

#include "adapters/network/network_stream.hpp"
#include "adapters/tls/signed_itself.hpp"
#include "adapters/tls/tls_certificate.hpp"
#include "forward_fixture.hpp"

#include <openssl/ssl.h>

#include <algorithm>
#include <filesystem>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <thread>

using namespace webots_cloud;

// The way between the servers.
BOOST_AUTO_TEST_SUITE(upstream_tls)

namespace {

/// To a server of ours, by TLS.
Forward by_tls(std::uint16_t port, std::string target, std::string host = "127.0.0.1")
{
    Forward forward;
    forward.upstream = Upstream(std::move(host), port);
    forward.upstream.tls = true;
    forward.target = std::move(target);
    return forward;
}

/// The status line of the answer to one request.
std::string ask(RunningServer const& gateway)
{
    Client browser(gateway);
    browser.say(forwarded_request);
    auto head = browser.read_to("\r\n\r\n");
    return head.substr(0, head.find('\r'));
}

/// A server by TLS that says what a test wants it to say.
class TlsPeer
{
public:
    explicit TlsPeer(SignedItself const& certificate)
    {
        auto loaded = adapters::load_tls_context(certificate.certificate(), certificate.key());
        BOOST_TEST_REQUIRE(bool(loaded));
        context_ = std::move(*loaded);
    }

    /// Waits for the next connection, and forgets the one before.
    void accept()
    {
        peer_.reset();
        peer_ = std::make_unique<UpstreamPeer>(server_.acceptor);
        tls_.reset(SSL_new(context_.get()));
        SSL_set_fd(tls_.get(), peer_->descriptor());
        BOOST_TEST_REQUIRE(SSL_accept(tls_.get()) == 1);
    }

    std::string read_request()
    {
        std::string text;
        char byte = 0;
        while (!text.ends_with("\r\n\r\n") && SSL_read(tls_.get(), &byte, 1) == 1)
            text += byte;
        return text;
    }

    void say(std::string_view bytes) { SSL_write(tls_.get(), bytes.data(), static_cast<int>(bytes.size())); }

    /// Waits until the other side has all that was said, though it may not have read it. While the kernel has
    /// much to do, what is sent later on another connection may arrive first.
    void await_arrival()
    {
        BOOST_TEST_REQUIRE(eventually([this] {
            int unacknowledged = -1;
            return ::ioctl(peer_->descriptor(), SIOCOUTQ, &unacknowledged) == 0 && unacknowledged == 0;
        }));
    }

    void close() { peer_.reset(); }

    std::uint16_t port() const { return server_.port(); }

private:
    OtherServer server_;
    adapters::TlsContext context_;
    std::unique_ptr<UpstreamPeer> peer_;
    adapters::TlsConnection tls_;
};

/// The body of the answer to one more request of a browser.
std::string ask_again(Client& browser, std::size_t size)
{
    browser.say(forwarded_request);
    BOOST_TEST(browser.read_to("\r\n\r\n").starts_with("HTTP/1.1 200 OK"));
    return browser.read(size);
}

constexpr std::string_view good = "HTTP/1.1 200 OK";
constexpr std::string_view bad = "HTTP/1.1 502 Bad Gateway";

} // namespace

BOOST_AUTO_TEST_CASE(websockets_come_from_a_server_that_speaks_tls)
{
    SignedItself const certificate("relay");
    RunningServer machine(certificate.shown());
    RunningServer gateway(certificate.trusted());
    gateway.endpoint.forward = by_tls(machine.port(), "/echo");
    Client browser(gateway);
    browser.upgrade("/forward");
    // Masked with zeros, a message of a browser is what it says.
    for (std::size_t const size : {std::size_t{5}, std::size_t{60'000}}) {
        auto const text = much(size);
        std::string frame = "\x81";
        if (size < 126)
            frame += static_cast<char>(0x80 | size);
        else
            frame += std::string("\xfe") + static_cast<char>(size >> 8) + static_cast<char>(size & 0xff);
        browser.say(frame + std::string(4, '\0') + text);
        BOOST_TEST((browser.read(size + (size < 126 ? 2 : 4)).ends_with(text)));
    }
    BOOST_TEST(gateway.statistics().tunnels == 1u);
    browser.say(std::string("\x88\x80") + std::string(4, '\0'));
    BOOST_TEST(browser.read_all() == std::string("\x88\x00", 2));
    browser.shut_down();
    BOOST_TEST(gateway.eventually_counts(&HttpServerStatistics::tunnels, 0));
    BOOST_TEST(machine.statistics().tls_failures == 0u);
}

BOOST_AUTO_TEST_CASE(one_handshake_verifies_for_those_that_follow)
{
    SignedItself const certificate("resumed");
    RunningServer machine(certificate.shown());
    RunningServer gateway(certificate.trusted());
    gateway.endpoint.forward = by_tls(machine.port(), "/x");
    for (int i = 0; i < 5; ++i)
        BOOST_TEST(ask(gateway) == good);
    auto const statistics = gateway.statistics();
    BOOST_TEST(statistics.upstream_tls_full == 1u);
    BOOST_TEST(statistics.upstream_tls_resumed == 4u);
    gateway.run([&] { gateway.endpoint.forward = by_tls(machine.port(), "/x", "localhost"); });
    BOOST_TEST(ask(gateway) == good);
    BOOST_TEST(gateway.statistics().upstream_tls_full == 2u, "its certificate was verified for another name");
}

// The machines of one name, at addresses of their own.
BOOST_AUTO_TEST_CASE(the_certificate_may_be_for_a_name_instead_of_the_address)
{
    SignedItself const certificate("named", "DNS:machines.example.org");
    RunningServer machine(certificate.shown());
    RunningServer gateway(certificate.trusted());
    gateway.endpoint.forward = by_tls(machine.port(), "/x");
    BOOST_TEST(ask(gateway) == bad);
    gateway.run([&] { gateway.endpoint.forward->upstream.name = "machines.example.org"; });
    BOOST_TEST(ask(gateway) == good);
    gateway.run([&] { gateway.endpoint.forward->upstream.name = "others.example.org"; });
    BOOST_TEST(ask(gateway) == bad, "no session is resumed that another name has verified");
}

// What a name server, or whoever announces a machine, says leads browsers to no service of our own machine.
BOOST_AUTO_TEST_CASE(a_machine_that_was_found_is_not_reached_on_the_loopback)
{
    SignedItself const certificate("own", "DNS:localhost,IP:127.0.0.1");
    RunningServer machine(certificate.shown());
    RunningServer gateway(certificate.trusted());
    for (auto const* host :
         {"localhost", "127.0.0.1", "::ffff:127.0.0.1", "64:ff9b::127.0.0.1", "2002:7f00:1::"}) {
        gateway.run([&] {
            gateway.endpoint.forward = by_tls(machine.port(), "/x", host);
            gateway.endpoint.forward->upstream.name = "localhost";
            gateway.endpoint.forward->upstream.elsewhere = true;
        });
        BOOST_TEST(ask(gateway) == bad, host);
    }
    BOOST_TEST(machine.statistics().accepted == 0u);
    gateway.run([&] { gateway.endpoint.forward = by_tls(machine.port(), "/x", "localhost"); });
    BOOST_TEST(ask(gateway) == good, "an operator may name a server of this machine");
}

BOOST_AUTO_TEST_CASE(requests_of_one_browser_share_a_connection_and_those_of_another_do_not)
{
    SignedItself const certificate("kept");
    RunningServer machine(certificate.shown());
    machine.endpoint.shared = std::make_shared<SharedBody const>(much(3'000'000));
    RunningServer gateway(certificate.trusted());
    gateway.endpoint.forward = by_tls(machine.port(), "/shared");
    auto const& file = machine.endpoint.shared->text;
    Client browser(gateway);
    BOOST_TEST((ask_again(browser, file.size()) == file));
    BOOST_TEST((ask_again(browser, file.size()) == file));
    gateway.run([&] { gateway.endpoint.forward = by_tls(machine.port(), "/small"); });
    BOOST_TEST(ask_again(browser, 6) == "/small");
    BOOST_TEST(ask_again(browser, 6) == "/small");
    BOOST_TEST(machine.statistics().accepted == 1u);
    Client other(gateway);
    BOOST_TEST(ask_again(other, 6) == "/small");
    BOOST_TEST(machine.statistics().accepted == 2u);
    // A request that must not be made twice never meets a connection that may have been closed.
    std::string const post = "POST /forward HTTP/1.1\r\nHost: h\r\nContent-Length: 0\r\n\r\n";
    browser.say(post);
    BOOST_TEST(browser.read_to("\r\n\r\n").starts_with("HTTP/1.1 405 "));
    BOOST_TEST(machine.statistics().accepted == 3u);
    // Another machine has connections of its own.
    RunningServer second(certificate.shown());
    gateway.run([&] { gateway.endpoint.forward = by_tls(second.port(), "/x"); });
    BOOST_TEST(ask_again(other, 2) == "/x");
    BOOST_TEST(second.statistics().accepted == 1u);
    BOOST_TEST(machine.statistics().accepted == 3u);
}

BOOST_AUTO_TEST_CASE(a_kept_connection_ends_soon_and_with_its_browser)
{
    SignedItself const certificate("ends");
    RunningServer machine(certificate.shown());
    RunningServer gateway(certificate.trusted());
    gateway.endpoint.forward = by_tls(machine.port(), "/x");
    {
        Client leaving(gateway);
        BOOST_TEST(ask_again(leaving, 2) == "/x");
        BOOST_TEST(machine.statistics().connections == 1u);
    }
    BOOST_TEST(machine.eventually_counts(&HttpServerStatistics::connections, 0));
    Client waiting(gateway);
    BOOST_TEST(ask_again(waiting, 2) == "/x");
    BOOST_TEST(machine.statistics().connections == 1u);
    BOOST_TEST(machine.eventually_counts(&HttpServerStatistics::connections, 0));
    BOOST_TEST(gateway.statistics().connections == 1u);
    BOOST_TEST(ask_again(waiting, 2) == "/x");
}

BOOST_AUTO_TEST_CASE(a_kept_connection_that_was_closed_costs_no_request)
{
    SignedItself const certificate("closed");
    TlsPeer machine(certificate);
    RunningServer gateway(certificate.trusted());
    gateway.endpoint.forward = by_tls(machine.port(), "/x");
    Client browser(gateway);
    browser.say(forwarded_request);
    machine.accept();
    BOOST_TEST(machine.read_request().ends_with("Connection: keep-alive\r\n\r\n"));
    machine.say(answer("first"));
    BOOST_TEST(browser.read_to("\r\n\r\n").starts_with(good));
    BOOST_TEST(browser.read(5) == "first");
    // Closed as the next request arrives: it is made again.
    browser.say(forwarded_request);
    BOOST_TEST(!machine.read_request().empty());
    machine.accept();
    BOOST_TEST(!machine.read_request().empty());
    machine.say(answer("again"));
    BOOST_TEST(browser.read_to("\r\n\r\n").starts_with(good));
    BOOST_TEST(browser.read(5) == "again");
    // Closed before: nobody even tries.
    machine.close();
    browser.say(forwarded_request);
    machine.accept();
    BOOST_TEST(!machine.read_request().empty());
    machine.close(); // a new connection is not tried again
    BOOST_TEST(browser.read_to("\r\n\r\n").starts_with(bad));
}

BOOST_AUTO_TEST_CASE(what_nobody_has_asked_for_is_no_answer_to_the_next_request)
{
    SignedItself const certificate("unasked");
    TlsPeer machine(certificate);
    RunningServer gateway(certificate.trusted());
    gateway.endpoint.forward = by_tls(machine.port(), "/x");
    Client browser(gateway);
    for (bool const is_at_once : {true, false, true}) {
        browser.say(forwarded_request);
        machine.accept(); // each time a new connection
        BOOST_TEST(!machine.read_request().empty());
        machine.say(answer("right") + (is_at_once ? answer("evil") : ""));
        BOOST_TEST(browser.read_to("\r\n\r\n").starts_with(good));
        BOOST_TEST(browser.read(5) == "right");
        if (!is_at_once) {
            machine.say(answer("evil"));
            machine.await_arrival();
        }
    }
}

BOOST_AUTO_TEST_CASE(who_is_not_to_be_trusted_is_sent_nothing)
{
    SignedItself const trusted("trusted");
    SignedItself const stranger("stranger");
    SignedItself const expired("expired", "IP:127.0.0.1", -60);
    SignedItself const other("other", "DNS:example.org,IP:127.0.0.2");
    for (auto const* shown : {&stranger, &expired, &other}) {
        RunningServer machine(shown->shown());
        RunningServer gateway((shown == &stranger ? &trusted : shown)->trusted());
        gateway.endpoint.forward = by_tls(machine.port(), "/x");
        for (int i = 0; i < 2; ++i)
            BOOST_TEST(ask(gateway) == bad);
        BOOST_TEST(gateway.statistics().upstream_tls_failures == 2u);
        BOOST_TEST(gateway.statistics().bad_gateways == 2u);
        BOOST_TEST(machine.statistics().requests == 0u);
    }
}

BOOST_AUTO_TEST_CASE(whom_to_trust_is_read_again_when_it_changes)
{
    SignedItself const first("first");
    SignedItself const second("second");
    RunningServer machine(first.shown());
    auto const file = first.certificate().parent_path() / "trusted.pem";
    std::filesystem::copy_file(first.certificate(), file);
    HttpServerParams params;
    params.tls_authorities = file;
    RunningServer gateway(params);
    gateway.endpoint.forward = by_tls(machine.port(), "/x");
    BOOST_TEST(ask(gateway) == good);
    std::filesystem::copy_file(second.certificate(), file.string() + ".new");
    std::filesystem::rename(file.string() + ".new", file);
    BOOST_TEST(ask(gateway) == bad, "no earlier session counts");
    std::filesystem::copy_file(first.certificate(), file.string() + ".new");
    std::filesystem::rename(file.string() + ".new", file);
    BOOST_TEST(ask(gateway) == good);
    std::filesystem::remove(file);
    BOOST_TEST(ask(gateway) == good, "it stays as it was");
}

BOOST_AUTO_TEST_CASE(whom_to_trust_is_known_from_the_start)
{
    SignedItself const certificate("start");
    RunningServer machine(certificate.shown());
    auto const file = certificate.certificate().parent_path() / "trusted.pem";
    std::filesystem::copy_file(certificate.certificate(), file);
    HttpServerParams params;
    params.tls_authorities = file;
    RunningServer gateway(params);
    std::filesystem::remove(file);
    gateway.endpoint.forward = by_tls(machine.port(), "/x");
    BOOST_TEST(ask(gateway) == good);
}

BOOST_AUTO_TEST_CASE(a_file_that_was_never_good_trusts_nobody)
{
    SignedItself const certificate("unread");
    RunningServer machine(certificate.shown());
    HttpServerParams params;
    params.tls_authorities = certificate.key(); // no certificate is in there
    RunningServer gateway(params);
    gateway.endpoint.forward = by_tls(machine.port(), "/x");
    BOOST_TEST(ask(gateway) == bad);
    BOOST_TEST(check_authorities(params.tls_authorities).error().message().find("\"caFile\"") !=
               std::string::npos);
    BOOST_TEST(check_authorities(certificate.certificate()).has_value());
}

BOOST_AUTO_TEST_CASE(who_speaks_no_tls_or_nothing_at_all_delays_nobody)
{
    SignedItself const certificate("silent");
    auto params = certificate.trusted();
    params.connect_timeout = std::chrono::seconds(1);
    RunningServer gateway(params);
    RunningServer plain;
    gateway.endpoint.forward = by_tls(plain.port(), "/x");
    BOOST_TEST(ask(gateway) == bad);
    OtherServer silent;
    gateway.run([&] { gateway.endpoint.forward = by_tls(silent.port(), "/x"); });
    Client patient(gateway);
    patient.say(forwarded_request);
    auto const accepted = silent.accept();
    Client bystander(gateway);
    bystander.say("GET /own HTTP/1.1\r\nHost: h\r\n\r\n");
    BOOST_TEST(bystander.read_to("/own").ends_with("\r\n\r\n/own"));
    BOOST_TEST(patient.read_to("\r\n").starts_with("HTTP/1.1 504 "));
    BOOST_TEST(gateway.statistics().late_gateways == 1u);
}

BOOST_AUTO_TEST_CASE(a_name_that_is_none_is_a_bad_gateway)
{
    RunningServer gateway;
    gateway.endpoint.forward = by_tls(1, "/x", "no-such-machine.invalid");
    BOOST_TEST(ask(gateway) == bad);
}

BOOST_AUTO_TEST_CASE(a_browser_that_does_not_read_holds_the_other_server_back)
{
    SignedItself const certificate("stalled");
    RunningServer machine(certificate.shown());
    RunningServer gateway(certificate.trusted());
    gateway.endpoint.forward = by_tls(machine.port(), "/flood");
    Client browser(gateway, 4096);
    browser.upgrade("/forward");
    BOOST_TEST(eventually([&] { return machine.endpoint.flood_refused.load(); }));
    BOOST_TEST(gateway.statistics().tunnels == 1u);
    BOOST_TEST(gateway.statistics().tunnel_bytes_sent < 100'000'000u);
}

BOOST_AUTO_TEST_SUITE_END()
