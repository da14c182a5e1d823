#include "core/access/asked_name.hpp"
#include "unit_test.hpp"

#include <string>
#include <utility>
#include <vector>

BOOST_AUTO_TEST_SUITE(asked_name_)

namespace {

using namespace webots_cloud;
using namespace webots_cloud::core;

PublicAddress address(std::string host, bool port_rewrite)
{
    PublicAddress address;
    address.host = std::move(host);
    address.port = 2000;
    address.port_rewrite = port_rewrite;
    return address;
}

/// `path` and `tls` are the proxy's words.
AskedAddress asked(std::string host, std::string path = {}, bool tls = false)
{
    AskedAddress asked;
    asked.host = std::move(host);
    asked.path = std::move(path);
    asked.tls = tls;
    return asked;
}

std::string machine(std::string_view entry, std::string host)
{
    return machine_reached_at(entry, address("sim.example.org", true), asked(std::move(host)));
}

BOOST_AUTO_TEST_CASE(a_server_with_a_name_is_reached_there)
{
    BOOST_TEST(reached_at(address("sim.example.org", true), asked("192.168.1.5:1999")).host ==
               "sim.example.org");
    BOOST_TEST(machine("sim.example.org/2000", "192.168.1.5:1999") == "wss://sim.example.org/2000");
}

BOOST_AUTO_TEST_CASE(one_without_is_reached_where_it_was_asked)
{
    BOOST_TEST(reached_at(address("*", true), asked("192.168.1.5:1999")).host == "192.168.1.5:1999");
    BOOST_TEST(reached_at(address("*", false), asked("192.168.1.5:2000")).host == "192.168.1.5");
    BOOST_TEST(reached_at(address("*", false), asked("[fe80::1]:2000")).host == "[fe80::1]");
    BOOST_TEST(machine("*/2000", "teacher.local:1999") == "wss://teacher.local:1999/2000");
    BOOST_TEST(machine("*:2000", "teacher.local:1999") == "wss://teacher.local:2000");
}

BOOST_AUTO_TEST_CASE(a_machine_with_our_name_is_found_at_our_port)
{
    PublicAddress own = address("sim.example.org", false);
    own.port = 8443;
    own.ssl = true;
    BOOST_TEST(path_at_own_port(own, "sim.example.org/2000") == "/2000");
    BOOST_TEST(path_at_own_port(own, "other.example.org/2000").empty());
    BOOST_TEST(path_at_own_port(own, "sim.example.org.evil/2000").empty());
    BOOST_TEST(path_at_own_port(own, "sim.example.org:2000").empty(), "at a port of its own");
    own.port = 443;
    BOOST_TEST(path_at_own_port(own, "sim.example.org/2000").empty(), "the entry says it");
    own.ssl = false;
    BOOST_TEST(path_at_own_port(own, "sim.example.org/2000") == "/2000", "of http it is another");
    own.port_rewrite = true;
    BOOST_TEST(path_at_own_port(own, "sim.example.org/2000").empty(), "the port is the proxy's");
}

BOOST_AUTO_TEST_CASE(what_is_no_host_is_not_repeated)
{
    for (auto const* host : {"", "a b", "user@pc7", "pc7/x", "pc7\r\nX: y", ":80"})
        BOOST_TEST(machine("*/2000", host) == "wss://localhost/2000");
}

// What nginx, Apache and others are told to send, and what anybody may send.
BOOST_AUTO_TEST_CASE(path_and_scheme_are_believed_of_a_trusted_proxy_alone)
{
    using Fields = std::vector<std::pair<std::string_view, std::string_view>>;
    Fields const all{{"x-forwarded-prefix", "/webots"}, {"Host", "h:1"}, {"X-Forwarded-Proto", "https"}};
    BOOST_TEST((asked_address(all, true) == asked("h:1", "/webots", true)));
    BOOST_TEST((asked_address(all, false) == asked("h:1")));
    BOOST_TEST((asked_address(Fields(), true) == AskedAddress()));
    auto const path = [](std::string_view value) {
        return asked_address(Fields{{"X-Forwarded-Prefix", value}}, true).path;
    };
    BOOST_TEST(path("/sites/webots/") == "/sites/webots");
    for (auto const* bad : {"", "/", "webots", "//evil.example", "/a/../b", "/a, /b", "/a b", "/a?b", "/%2e"})
        BOOST_TEST(path(bad).empty(), bad);
    BOOST_TEST(path("/" + std::string(5'000, 'a')).empty());
    auto const tls = [](std::string_view value) {
        return asked_address(Fields{{"X-Forwarded-Proto", value}}, true).tls;
    };
    BOOST_TEST(tls("HTTPS"));
    BOOST_TEST(tls("wss")); // Traefik's, for a WebSocket
    for (auto const* other : {"http", "", "https, http", "ws", "httpss"})
        BOOST_TEST(!tls(other), other);
    auto const host = [](std::string_view name, std::string_view port, bool is_from_proxy = true) {
        return asked_address(Fields{{"X-Forwarded-Port", port}, {"Host", name}}, is_from_proxy).host;
    };
    BOOST_TEST(host("sim.org", "8443") == "sim.org:8443");
    BOOST_TEST(host("[2001:db8::1]", "8443") == "[2001:db8::1]:8443");
    BOOST_TEST(host("sim.org:9443", "8443") == "sim.org:9443", "what the browser has said");
    BOOST_TEST(host("sim.org", "8443", false) == "sim.org");
    for (auto const* usual : {"443", "80", "", "0", "70000", "8443, 443", "x"})
        BOOST_TEST(host("sim.org", usual) == "sim.org", usual);
    for (auto const* bad : {"", "a b", ":80"})
        BOOST_TEST(host(bad, "8443") == bad);
    // A proxy that adds its field to the client's has the last word, be it a bad one.
    BOOST_TEST((asked_address(Fields{{"X-Forwarded-Prefix", "/forged"}, {"X-Forwarded-Prefix", "/webots"}},
                              true) == asked("", "/webots")));
    BOOST_TEST((asked_address(Fields{{"X-Forwarded-Prefix", "/forged"}, {"X-Forwarded-Prefix", ""}}, true) ==
                asked("")));
}

BOOST_AUTO_TEST_CASE(a_port_that_a_proxy_has_left_out_is_seen_by_the_page)
{
    BOOST_TEST(port_left_out("https://sim.org:8443", "sim.org") == "8443");
    BOOST_TEST(port_left_out("https://Sim.org:8443", "sim.ORG") == "8443");
    BOOST_TEST(port_left_out("http://[::1]:8080", "[::1]") == "8080");
    for (auto const* other : {"https://sim.org", "https://sim.org:", "https://sim.org.evil:8443",
                              "https://evil:8443", "null", "", "sim.org:8443"})
        BOOST_TEST(port_left_out(other, "sim.org").empty(), other);
    BOOST_TEST(port_left_out("https://sim.org:8443", "sim.org:8443").empty());
    BOOST_TEST(port_left_out("https://:8443", "").empty());
}

BOOST_AUTO_TEST_CASE(a_server_below_a_path_is_told_with_it)
{
    struct Row
    {
        char const* server;
        char const* path; ///< Of the configuration.
        bool ssl;
        AskedAddress asked;
        char const* expected;
    };
    for (auto const& row : std::vector<Row>{
             {"sim.org", "", false, asked("sim.org:8080"), "ws://sim.org:8080"},
             {"sim.org", "", false, asked("SIM.org", "/webots"), "ws://SIM.org/webots"},
             {"sim.org", "", false, asked("sim.org", "/webots", true), "wss://sim.org/webots"},
             {"sim.org", "", true, asked("sim.org", "/webots"), "wss://sim.org/webots"},
             {"sim.org", "", true, asked("127.0.0.1:1999", "/webots"), "wss://sim.org/webots"},
             {"sim.org", "", true, asked("127.0.0.1:1999"), "wss://sim.org/2000"},
             {"sim.org", "/webots", true, asked("127.0.0.1:1999"), "wss://sim.org/webots"},
             {"sim.org", "/webots", true, asked("sim.org:8443"), "wss://sim.org:8443/webots"},
             {"sim.org", "/webots", true, asked("sim.org", "/other"), "wss://sim.org/other"},
             {"sim.org", "/webots", false, asked("lab.org", "", true), "wss://lab.org/webots"},
             {"sim.org:8443", "", false, asked("sim.org", "/webots"), "ws://sim.org:8443/webots"},
             {"*", "", false, asked("pc7:8080", "/webots"), "ws://pc7:8080/webots"},
             {"localhost", "", false, asked("pc7", "/webots", true), "wss://pc7/webots"}}) {
        auto own = address(row.server, true);
        own.path = row.path;
        own.ssl = row.ssl;
        BOOST_TEST(own_base(own, {"lab.org"}, row.asked) == row.expected);
    }
}

BOOST_AUTO_TEST_CASE(what_we_pass_on_is_below_our_path_where_the_entry_does_not_say_otherwise)
{
    struct Row
    {
        char const* path; ///< Of the configuration.
        AskedAddress asked;
        char const* entry;
        char const* expected;
    };
    for (auto const& row : std::vector<Row>{
             {"", asked("sim.org"), "sim.org/2000", ""}, // as it stands
             {"", asked("sim.org", "/webots"), "sim.org/2000", "/2000"},
             {"", asked("sim.org", "/webots"), "sim.org/webots/2000", "/2000"},
             {"", asked("sim.org", "/webots"), "sim.org/other/2000", ""},
             {"", asked("sim.org", "/webots"), "lab.org/2000", "/2000"}, // another of our names
             {"", asked("pc7:80", "/webots"), "pc7/2000", "/2000"},
             {"", asked("sim.org", "/webots"), "elsewhere.org/2000", ""},
             {"", asked("sim.org", "/webots"), "sim.org.evil/2000", ""},
             {"", asked("sim.org", "/webots"), "sim.org:2000", ""},
             {"", asked("sim.org", "/webots"), "sim.org/webots", ""}, // no port, so we don't pass it on
             {"", asked("sim.org", "/webots"), "*/2000", "/2000"},
             {"", asked("sim.org", "", true), "sim.org/2000", "/2000"},
             {"/webots", asked("x"), "sim.org/webots/2000", "/2000"},
             {"/webots", asked("x"), "sim.org/2000", ""}, // beside us
             {"/webots", asked("x"), "*/2000", "/2000"},
             {"", asked("x"), "*/2000", ""}}) {
        auto own = address("sim.org", true);
        own.ssl = false;
        own.path = row.path;
        BOOST_TEST(path_behind_proxy(own, {"lab.org"}, row.asked, row.entry) == row.expected, row.entry);
    }
}

BOOST_AUTO_TEST_CASE(a_machine_below_a_path_is_told_with_it_and_without_its_port)
{
    auto own = address("*", false);
    own.ssl = false;
    auto const reached = reached_at(own, asked("pc7:8080", "/webots", true));
    BOOST_TEST(reached.host == "pc7:8080");
    BOOST_TEST(reached.path == "/webots");
    BOOST_TEST(reached.ssl);
    BOOST_TEST(reached_at(own, asked("pc7:8080")).host == "pc7");
}

BOOST_AUTO_TEST_SUITE_END()

} // namespace
