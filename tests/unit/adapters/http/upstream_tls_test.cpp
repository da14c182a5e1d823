#include "unit_test.hpp"

#include "forward_fixture.hpp"

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <unistd.h>

using namespace webots_cloud;

namespace {

/// A certificate that has signed itself, and its key, in files of their own.
class SignedItself
{
public:
    explicit SignedItself(std::string const& name,
                          char const* alternative_names = "DNS:localhost,IP:127.0.0.1",
                          long valid_for = 86'400)
        : folder_(std::filesystem::temp_directory_path() /
                  ("webots_cloud_upstream_tls_" + name + std::to_string(::getpid())))
    {
        std::filesystem::create_directories(folder_);
        auto* const key_pair = EVP_EC_gen("P-256");
        auto* const made = X509_new();
        X509_set_version(made, X509_VERSION_3);
        ASN1_INTEGER_set(X509_get_serialNumber(made), 1);
        X509_NAME_add_entry_by_txt(X509_get_subject_name(made), "CN", MBSTRING_ASC,
                                   reinterpret_cast<unsigned char const*>(name.c_str()), -1, -1, 0);
        X509_set_issuer_name(made, X509_get_subject_name(made));
        X509_gmtime_adj(X509_getm_notBefore(made), std::min(valid_for, 0L) - 60);
        X509_gmtime_adj(X509_getm_notAfter(made), valid_for);
        X509_set_pubkey(made, key_pair);
        auto* const names = X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, alternative_names);
        X509_add_ext(made, names, -1);
        X509_sign(made, key_pair, EVP_sha256());
        auto* const certificate_file = std::fopen(certificate().c_str(), "we");
        PEM_write_X509(certificate_file, made);
        std::fclose(certificate_file);
        auto* const key_file = std::fopen(key().c_str(), "we");
        PEM_write_PrivateKey(key_file, key_pair, nullptr, nullptr, 0, nullptr, nullptr);
        std::fclose(key_file);
        X509_EXTENSION_free(names);
        X509_free(made);
        EVP_PKEY_free(key_pair);
    }
    SignedItself(SignedItself const&) = delete;
    SignedItself& operator=(SignedItself const&) = delete;
    ~SignedItself() { std::filesystem::remove_all(folder_); }

    std::filesystem::path certificate() const { return folder_ / "certificate.pem"; }
    std::filesystem::path key() const { return folder_ / "key.pem"; }

    /// Of a server that shows it.
    HttpServerParams shown() const
    {
        HttpServerParams params;
        params.tls_certificate = certificate();
        params.tls_key = key();
        return params;
    }

    /// Of a gateway that trusts it.
    HttpServerParams trusted() const
    {
        HttpServerParams params;
        params.tls_authorities = certificate();
        return params;
    }

private:
    std::filesystem::path folder_;
};

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
