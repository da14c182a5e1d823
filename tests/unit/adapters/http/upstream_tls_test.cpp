#include "unit_test.hpp"

#include "forward_fixture.hpp"
#include "signed_itself.hpp"

#include <algorithm>
#include <filesystem>

using namespace webots_cloud;

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

constexpr std::string_view good = "HTTP/1.1 200 OK";
constexpr std::string_view bad = "HTTP/1.1 502 Bad Gateway";

} // namespace

// Issue 20: the way between the servers.
BOOST_AUTO_TEST_SUITE(upstream_tls)

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

// Issue 24: the machines of one name, at addresses of their own.
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
