#include "site/settings.hpp"

#include "site/answers.hpp"
#include "site/credentials.hpp"
#include "site/log_folder.hpp"
#include "unit_test.hpp"

#include <string>

namespace webots_cloud::site {
BOOST_AUTO_TEST_SUITE(site_settings)

namespace {

Settings session_settings(std::string const& more, int moved = 0)
{
    auto const text = R"({"port": 1999, "simulationServers": ["localhost:2000"], )" + more + "}";
    return parse_settings(Kind::session, "config/session/x.json", text, moved).value();
}

} // namespace

BOOST_AUTO_TEST_CASE(the_address_is_the_one_that_browsers_use)
{
    BOOST_TEST(
        site_address(session_settings(R"("ssl": false, "portRewrite": false, "server": "localhost")")) ==
        "http://localhost:1999/");
    BOOST_TEST(
        site_address(session_settings(R"("ssl": true, "portRewrite": true, "server": "sim.example.org")")) ==
        "https://sim.example.org/1999/");
    auto settings = session_settings(R"("ssl": true, "portRewrite": false, "server": "sim.example.org")");
    settings.address.port = 443;
    BOOST_TEST(site_address(settings) == "https://sim.example.org/");
}

BOOST_AUTO_TEST_CASE(a_site_without_a_name_has_that_of_whoever_asks)
{
    auto const settings = session_settings(R"("ssl": false, "portRewrite": true, "server": "*")");
    BOOST_TEST(site_address(settings) == "http://localhost:1999/");
    BOOST_TEST(site_address(settings, "192.168.7.5") == "http://192.168.7.5:1999/");
}

BOOST_AUTO_TEST_CASE(a_machine_is_below_a_session_server_that_has_a_port_of_its_own)
{
    auto const machine =
        parse_settings(Kind::simulation, "s.json",
                       R"({"port": 2000, "ssl": true, "portRewrite": true, "server": "sim.example.org"})", 0)
            .value();
    auto session = session_settings(R"("ssl": true, "portRewrite": false, "server": "sim.example.org")");
    BOOST_TEST(machine_address(machine, &session) == "https://sim.example.org:1999/2000/");
    BOOST_TEST(machine_address(machine, nullptr) == "https://sim.example.org/2000/");
    session.address.port = 443;
    BOOST_TEST(machine_address(machine, &session) == "https://sim.example.org/2000/");
    session.address.port = 1999;
    session.address.host = "other.example.org";
    BOOST_TEST(machine_address(machine, &session) == "https://sim.example.org/2000/");
}

BOOST_AUTO_TEST_CASE(a_site_at_the_loopback_is_for_this_machine)
{
    for (auto const* address : {"127.0.0.1", "::1"})
        BOOST_TEST(is_for_this_machine(session_settings(
            R"("ssl": false, "server": "localhost", "listenAddress": ")" + std::string(address) + '"')));
    BOOST_TEST(!is_for_this_machine(session_settings(R"("ssl": false, "server": "localhost")")));
}

BOOST_AUTO_TEST_CASE(what_a_server_says_of_its_walls_is_shown)
{
    BOOST_TEST(parse_weakness(R"({"ready":true,"but":"No\u001b[2J sandbox."})").find('\x1b') ==
               std::string::npos);
    BOOST_TEST(parse_weakness(R"({"ready":true,"but":"No sandbox."})") == "No sandbox.");
    for (auto const* other : {R"({"ready":true,"but":""})", R"({"but":7})", "ready", "full", ""})
        BOOST_TEST(parse_weakness(other).empty());
}

BOOST_AUTO_TEST_CASE(the_last_starts_that_failed_are_those_of_this_server)
{
    std::string const log = "2026-11-28 18:00:00,001 [ERROR  ]  [9] Before.\n"
                            "2026-11-28 18:51:46,000 [INFO   ]  [1] Starting simulation from x\n"
                            "2026-11-28 18:51:47,000 [ERROR  ]  Projects can't be fetched: no cache\n"
                            "2026-11-28 18:51:49,747 [ERROR  ]  [1] No space left on device.\n";
    BOOST_TEST((failed_starts(log, "2026-11-28 18:30:00") ==
                std::vector<std::string>{"18:51:49 No space left on device."}));
    std::string many;
    for (int i = 1; i <= 5; ++i)
        many += "2026-11-28 18:51:4" + std::to_string(i) + ",000 [ERROR  ]  [1] Why.\n";
    BOOST_TEST((failed_starts(many, "2026") ==
                std::vector<std::string>{"18:51:43 Why.", "18:51:44 Why.", "18:51:45 Why."}));
    for (auto const* odd : {"", "\n", " [ERROR  ]  [", "x [ERROR  ]  [1] y"})
        BOOST_TEST(failed_starts(odd, "").empty());
}

BOOST_AUTO_TEST_CASE(why_a_server_ended_is_its_last_word_in_its_own_name)
{
    constexpr auto kind = Kind::simulation;
    BOOST_TEST(reason_of_end(kind, "").empty());
    BOOST_TEST(reason_of_end(kind, "a library: is missing\n").empty());
    BOOST_TEST(reason_of_end(kind, "webots-simulation-server: a: warning\n"
                                   "webots-simulation-server: There is no program: build it.\n"
                                   "something else\n") == "There is no program: build it");
    BOOST_TEST(reason_of_end(Kind::session, "webots-simulation-server: not this one").empty());
}

BOOST_AUTO_TEST_CASE(a_site_is_asked_where_it_listens)
{
    BOOST_TEST(own_address("::") == "127.0.0.1");
    BOOST_TEST(own_address("0.0.0.0") == "127.0.0.1");
    BOOST_TEST(own_address("192.168.7.5") == "192.168.7.5");
}

BOOST_AUTO_TEST_CASE(all_ports_move_together)
{
    auto const settings = session_settings(R"("ssl": false, "server": "localhost")", 1001);
    BOOST_TEST((ports_of(settings) == std::vector<std::uint16_t>{3000}));
    auto const website = parse_settings(Kind::website_host, "w.json", R"({"port": 1998})", 1001);
    BOOST_TEST(site_address(website.value()) == "http://localhost:2999/");
    auto const odd = parse_settings(Kind::website_host, "w.json", R"({"port": 20.5e2})", 0);
    BOOST_TEST(site_address(odd.value()) == "http://localhost:2050/",
               "a whole number, however it is written");
    BOOST_TEST(!parse_settings(Kind::website_host, "w.json", R"({"port": "1998"})", 0));
    BOOST_TEST(!parse_settings(Kind::website_host, "w.json", R"({"port": 1998})", 64'000));
    BOOST_TEST(!parse_settings(Kind::simulation, "s.json", R"({"port": 2000})", 64'000));
}

BOOST_AUTO_TEST_CASE(simulations_have_ports_of_this_machine_unless_they_run_elsewhere)
{
    auto const ports = [](std::string_view keys) {
        auto const text = R"({"port":2000,"server":"localhost")" + std::string(keys) + "}";
        return parse_settings(Kind::simulation, "s.json", text, 0)->simulation_ports;
    };
    BOOST_TEST(ports(R"(,"maxConnections":7)") == 7);
    BOOST_TEST(ports(R"(,"sandbox":"docker")") == 0);
}

BOOST_AUTO_TEST_CASE(only_names_get_a_certificate_and_only_files_of_this_folder_are_made)
{
    BOOST_TEST(certificate_name("localhost:8443").value() == "localhost");
    BOOST_TEST(!certificate_name("*"));
    BOOST_TEST(!certificate_name("a,DNS:b"));
    BOOST_TEST(!certificate_name("a:b"));
    BOOST_TEST(are_ours("tls/certificate.pem", "tls/key.pem"));
    BOOST_TEST(!are_ours("/etc/letsencrypt/a.pem", "tls/key.pem"));
    BOOST_TEST(!are_ours("tls/certificate.pem", "../key.pem"));
    BOOST_TEST(!are_ours("", ""));
}

BOOST_AUTO_TEST_CASE(a_password_has_letters_that_nobody_mistakes)
{
    BOOST_TEST(password_from(std::string("\0\1\2\3\4\5\6\7\x08\x09\x0a\x0b", 12)).value() ==
               "abcd-efgh-jkmn");
    BOOST_TEST(!password_from("too few"));
    BOOST_TEST(!password_from(std::string(100, '\xff'))); // would make some letters likelier than others
}

BOOST_AUTO_TEST_CASE(what_servers_answer_is_told_in_lines)
{
    BOOST_TEST(seats_line(R"({"load": 1.5, "sessions": 3, "capacity": 100})").value() ==
               "seats          3 of 100 taken");
    BOOST_TEST(!seats_line("42.75"));
    auto const lines = visitor_lines(
        R"({"stateText": "A machine is free.", "servers": [{"address": "a:1", "load": 1},
            {"address": "b:2", "refusal": "no \"display\""}]})");
    BOOST_TEST((lines == std::vector<std::string>{"visitors       A machine is free.",
                                                  "b:2 refused its last start: no \"display\""}));
    BOOST_TEST(visitor_lines("This monitor has a password.").empty());
}

BOOST_AUTO_TEST_SUITE_END()

} // namespace webots_cloud::site
