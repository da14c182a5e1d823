#include "core/text.hpp"
#include "unit_test.hpp"

#include <webots_cloud/config.hpp>

#include <algorithm>
#include <cstdlib>
#include <regex>

using namespace webots_cloud;

// Protocol sections 8.1 and 8.2.
BOOST_AUTO_TEST_SUITE(config)

namespace {

/// Without lines and columns, which positioned_json_test and config_faults_test are about.
std::string without_places(std::string const& text)
{
    static std::regex const place("(^|\n)(c\\.json):[0-9]+:[0-9]+: ");
    return std::regex_replace(text, place, "$1$2: ");
}

template<class Parsed>
std::string sentence_of(Parsed const& parsed)
{
    return parsed ? std::string() : without_places(parsed.error().message());
}

template<class Parsed>
std::vector<std::string> warnings_of(Parsed const& parsed)
{
    auto warnings = parsed.value().warnings;
    for (auto& warning : warnings)
        warning = without_places(warning);
    return warnings;
}

std::string session_error(std::string_view text)
{
    auto const parsed = parse_session_config(text, "c.json");
    BOOST_TEST_REQUIRE(!parsed, text);
    BOOST_TEST((parsed.error() == errc::invalid_config));
    return sentence_of(parsed);
}

constexpr std::string_view seed = R"({ "port": 1999, "portRewrite": true, "server": "cyberbotics1.epfl.ch",
    "administrator": "admin@cyberbotics.com", "mailServer": "mail.infomaniak.com", "mailServerPort": 587,
    "mailSender": "support@cyberbotics.com", "mailSenderPassword": "********",
    "simulationServers": [ "cyberbotics1.epfl.ch/2000" ] })";

} // namespace

BOOST_AUTO_TEST_CASE(the_guides_own_session_configuration_is_read_without_a_warning)
{
    auto const configured = parse_session_config(seed, "session.json").value();
    BOOST_TEST(configured.warnings.empty());
    BOOST_TEST(configured.config.address.port == 1999);
    BOOST_TEST(configured.config.address.port_rewrite);
    BOOST_TEST(configured.config.address.ssl);
    BOOST_TEST(configured.config.simulation_servers.front().address == "cyberbotics1.epfl.ch/2000");
}

BOOST_AUTO_TEST_CASE(simulation_servers_may_have_a_weight_and_be_drained)
{
    auto const parsed = parse_session_config(
        R"({"port":1,"simulationServers":["a:1",{"address":"b:2","weight":2.5,"labels":["gpu","R2025a"]},{"address":"c/3","drain":true,"trusted":true}]})",
        "c.json");
    auto const& servers = parsed->config.simulation_servers;
    BOOST_TEST_REQUIRE(servers.size() == 3u);
    BOOST_TEST(servers[1].weight == 2.5);
    BOOST_TEST(servers[2].address == "c/3");
    BOOST_TEST(servers[2].drain);
    BOOST_TEST(servers[2].trusted);
    BOOST_TEST(!servers[1].trusted);
    BOOST_TEST((servers[1].labels == std::vector<std::string>{"gpu", "R2025a"}));
    for (auto const* entry : {R"({"address":"b:2","weight":0})", R"({"address":"b:2","drain":1})",
                              R"({"address":"b:2","trusted":1})",
                              R"({"address":"b:2","labels":["two words"]})", "{}", "5", R"({"address":"b"})"})
        BOOST_TEST(
            !parse_session_config(R"({"port":1,"simulationServers":[)" + std::string(entry) + "]}", "c.json"),
            entry);
}

BOOST_AUTO_TEST_CASE(a_wrong_simulation_server_is_named_with_its_wrong_key)
{
    auto const error = [](std::string_view entry) {
        return session_error(R"({"port":1,"simulationServers":["a:1",)" + std::string(entry) + "]}");
    };
    std::string const where = "c.json: key \"simulationServers\", entry 2: ";
    std::string const address = "\"host:port\", \"host/port\" or \"host/path\", with a port from 1 to 65535, "
                                "\"dns:name:port\", \"srv:service name\" or \"announced\"";
    BOOST_TEST(error(R"({"address":"a:2","weight":0})") ==
               where + "key \"weight\": expected a number from 0.001 to 1000000, found the number 0");
    BOOST_TEST(
        error(R"({"address":"a:2","weight":"2"})") ==
        where + "key \"weight\": expected a number from 0.001 to 1000000, found the string \"2\": write 2, "
                "without quotes");
    BOOST_TEST(error(R"({"address":"a:2","drain":"yes"})") ==
               where + "key \"drain\": expected true or false, found the string \"yes\": write true, without "
                       "quotes");
    BOOST_TEST(error(R"({"address":"a"})") ==
               where + "key \"address\": expected " + address +
                   ", found the string \"a\": write \"a:2000\", if that is its port");
    BOOST_TEST(error(R"({"adress":"a:2"})") ==
               where + "key \"address\" is missing: expected " + address +
                   "\nc.json: key \"simulationServers\", entry 2: "
                   "unknown key \"adress\" is ignored; did you mean \"address\"?");
    BOOST_TEST(error("5") ==
               where + "expected " + address +
                   ", or {\"address\": ..., \"weight\": 2, \"drain\": true}, found the number 5");
    BOOST_TEST(error("\"host\"") ==
               where + "expected " + address +
                   ", found the string \"host\": write \"host:2000\", if that is its port");
}

// Issue 20, item 2.
BOOST_AUTO_TEST_CASE(machines_may_be_found_by_name_or_announce_themselves)
{
    auto const parsed = parse_session_config(
        R"({"port":1,"ssl":false,"simulationServers":["dns:sim.test:2000",{"address":"srv:_w._tcp.test","weight":2}],
            "nameServers":["10.0.0.53","127.0.0.1:8600","::1","[::1]:53"],"discoverLoopback":true})",
        "c.json");
    BOOST_TEST_REQUIRE(parsed.has_value());
    BOOST_TEST(parsed->warnings.empty());
    BOOST_TEST(parsed->config.simulation_servers[0].address == "dns:sim.test:2000");
    BOOST_TEST(parsed->config.simulation_servers[1].weight == 2);
    BOOST_TEST(parsed->config.name_servers.size() == 4);
    BOOST_TEST(parsed->config.discover_loopback);
    BOOST_TEST(!parsed->config.announcements);
    BOOST_TEST(!parsed->config.service.gateway);
    for (auto const* const wrong :
         {R"("simulationServers":["dns:sim.test"])", R"("simulationServers":["srv:a b"])",
          R"("simulationServers":[{"address":"dns:a:1","internal":"10.0.0.2:1"}])",
          R"("simulationServers":[{"address":"srv:a","ports":"1-2"}])",
          R"("simulationServers":["a/1"],"nameServers":["ns.test"])",
          R"("simulationServers":["a/1"],"nameServers":["https://10.0.0.1:1"])"})
        session_error(R"({"port":1,)" + std::string(wrong) + "}");
    BOOST_TEST(session_error(R"({"port":1,"simulationServers":["a/1"],"announcements":true})") ==
               "c.json: key \"sessionSecret\" is missing: expected the file of a word that machines know, "
               "since they may announce themselves (\"announcements\")");
    auto const announced =
        parse_session_config(R"({"port":1,"announcements":true,"sessionSecret":"s"})", "c.json");
    BOOST_TEST_REQUIRE(announced.has_value());
    BOOST_TEST(announced->config.announcements);
}

// Issue 24, line 1.
BOOST_AUTO_TEST_CASE(machines_that_are_found_may_be_reached_through_the_gateway_alone)
{
    auto const parse = [](std::string_view entries, std::string_view more) {
        return parse_session_config(
            core::concat(R"({"port":443,"ssl":true,"simulationServers":[)", entries, "]", more, "}"),
            "c.json");
    };
    std::string_view const listening = R"(,"announcements":true,"sessionSecret":"s")";
    for (auto const* const entry :
         {R"({"address":"dns:sim:2000","internal":"http"})",
          R"({"address":"dns:sim:2000","internal":"https"})",
          R"({"address":"dns:sim:2000","internal":"https://machines.test"})",
          R"({"address":"srv:_w._tcp.test","internal":"https"})",
          R"({"address":"announced","internal":"http"})",
          R"({"address":"announced","internal":"https","weight":2,"labels":["gpu"]})"}) {
        auto const parsed = parse(entry, listening);
        BOOST_TEST_REQUIRE(parsed.has_value(), entry);
        BOOST_TEST(parsed->config.service.gateway);
    }
    BOOST_TEST(!parse(R"({"address":"announced","labels":["gpu"]})", listening)->config.service.gateway);
    for (auto const* const entry : {R"({"address":"dns:sim:2000","internal":"ftp"})",
                                    R"({"address":"dns:sim:2000","internal":"https://"})",
                                    R"({"address":"dns:sim:2000","internal":"https://a:1"})",
                                    R"({"address":"srv:_w._tcp.test","internal":"http"})",
                                    R"({"address":"srv:_w._tcp.test","internal":"https://a.test"})",
                                    R"({"address":"announced","internal":"https://a.test"})",
                                    R"({"address":"announced","ports":"1-2"})"})
        BOOST_TEST(!parse(entry, listening), entry);
    BOOST_TEST(
        parse(R"("announced")", "").error().message().find("no such entry without \"announcements\"") !=
        std::string::npos);
    BOOST_TEST(parse(R"({"address":"dns:sim:2000","internal":"http"})", R"(,"gateway":false)")
                   .error()
                   .message()
                   .find("browsers would not reach these machines") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_simulation_server_announces_itself_with_a_secret_alone)
{
    auto const parsed = parse_simulation_config(
        R"({"server":"h","sessionServers":["https://s.test/1999/"],"sessionSecret":"s"})", "c.json");
    BOOST_TEST_REQUIRE(parsed.has_value());
    BOOST_TEST(parsed->config.session_servers.front() == "https://s.test/1999");
    BOOST_TEST(!parse_simulation_config(R"({"server":"h","sessionServers":["https://s.test"]})", "c.json"));
    BOOST_TEST(!parse_simulation_config(R"({"server":"h","sessionServers":["s.test"],"sessionSecret":"s"})",
                                        "c.json"));
}

BOOST_AUTO_TEST_CASE(machines_behind_the_gateway_have_an_internal_address)
{
    auto const parse = [](std::string_view entries, std::string_view more = "") {
        return parse_session_config(R"({"port":443,"simulationServers":[)" + std::string(entries) + "]" +
                                        std::string(more) + "}",
                                    "c.json");
    };
    auto const mapped =
        parse(R"({"address":"s.org/2000","internal":"10.0.0.2:2000","ports":"2001-2100"})").value();
    BOOST_TEST(mapped.warnings.empty());
    BOOST_TEST(mapped.config.service.gateway);
    auto const& server = mapped.config.simulation_servers[0];
    BOOST_TEST(server.internal_address == "10.0.0.2:2000");
    BOOST_TEST(server.first_port == 2001);
    BOOST_TEST(server.last_port == 2100);

    BOOST_TEST(!parse(R"("s.org/2000")")->config.service.gateway, "as ever");
    BOOST_TEST(parse(R"("s.org/2000")")->config.simulation_servers[0].internal_address == "");
    auto const local = parse(R"("s.org/2000","s.org:3000")", R"(,"gateway":true,"ssl":true)").value().config;
    BOOST_TEST(local.simulation_servers[0].internal_address == "127.0.0.1:2000");
    BOOST_TEST(local.simulation_servers[1].internal_address == "", "its port is open to the world");
    auto const off =
        parse(R"({"address":"s.org/2000","internal":"10.0.0.2:2000"})", R"(,"gateway":false)")->config;
    BOOST_TEST(!off.service.gateway);
    BOOST_TEST(off.simulation_servers[0].internal_address == "10.0.0.2:2000", "it is polled there");

    BOOST_TEST(parse(R"({"address":"s.org/3000","internal":"10.0.0.2:2000"})")->warnings ==
               std::vector<std::string>{
                   "c.json: key \"simulationServers\": s.org/3000 is at 10.0.0.2:2000, but a simulation "
                   "server sends "
                   "browsers to its own \"port\": set that to 3000 there, in \"internal\" too"});
}

// Issue 20: between the machines of a site, TLS.
BOOST_AUTO_TEST_CASE(machines_behind_the_gateway_may_speak_tls)
{
    auto const parsed = parse_session_config(
        R"({"port":443,"simulationServers":[{"address":"s.org/2000","internal":"https://sim2.s.org:2000"}],
            "caFile":"tls/campus.pem"})",
        "c.json");
    BOOST_TEST(parsed->warnings.empty());
    BOOST_TEST(parsed->config.service.gateway);
    BOOST_TEST(parsed->config.simulation_servers[0].internal_address == "https://sim2.s.org:2000");
    BOOST_TEST(parsed->config.ca_file == "tls/campus.pem");
    BOOST_TEST(parse_session_config(R"({"port":443,"simulationServers":["a/1"]})", "c.json")
                   ->config.ca_file.empty());
    auto const other = parse_session_config(
        R"({"port":443,"simulationServers":[{"address":"s.org/3000","internal":"wss://sim2:2000"}]})",
        "c.json");
    BOOST_TEST_REQUIRE(other->warnings.size() == 1u);
    BOOST_TEST(other->warnings[0].find("set that to 3000 there") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(what_the_gateway_could_not_tell_apart_is_refused)
{
    auto const error = [](std::string_view entries, std::string_view more = "") {
        return session_error(R"({"port":443,"simulationServers":[)" + std::string(entries) + "]" +
                             std::string(more) + "}");
    };
    std::string const where = "c.json: key \"simulationServers\", entry ";
    BOOST_TEST(error(R"({"address":"a/2000","internal":"sim2:2000"})") ==
               where + "1: key \"internal\": expected a numeric address and a port, as in \"10.0.0.2:2000\", "
                       "or for TLS \"https://sim2.example.org:2000\", found the string \"sim2:2000\"");
    BOOST_TEST(
        error(R"({"address":"a/2000","internal":"https://sim2:2000","ports":"2001-2100"})") ==
        where + "1: key \"ports\": expected none with https, which simulators do not speak: the simulation "
                "server's own \"gateway\" passes on to them, found the string \"2001-2100\"");
    BOOST_TEST(error(R"({"address":"a/2000","internal":"10.0.0.2:2000","ports":"9-1"})") ==
               where + "1: key \"ports\": expected a port or a range of ports, as in \"2001-2100\", "
                       "found the string \"9-1\"");
    BOOST_TEST(
        error(R"("a/2000","b/2000")", R"(,"gateway":true)") ==
        where +
            "2: expected another port than 2000, which entry 1 has as well: the gateway knows machines by "
            "their ports, found the string \"b/2000\"");
    BOOST_TEST(parse_session_config(R"({"port":443,"simulationServers":["a/2000","b/2000"]})", "c.json")
                   .has_value());
    BOOST_TEST(error(R"({"address":"a/2000","internal":"10.0.0.2:2000","ports":"2001-3100"},"a/3000")",
                     R"(,"gateway":true)")
                   .starts_with(where + "2: expected another port than 3000"));
}

BOOST_AUTO_TEST_CASE(an_address_of_a_simulation_server_is_a_host_and_a_port)
{
    auto const is_good = [](std::string const& address) {
        return parse_session_config(R"({"port":1,"simulationServers":[")" + address + "\"]}", "c.json")
            .has_value();
    };
    for (auto const* good :
         {"a:1", "a.example.org/65535", "127.0.0.1:24000", "[::1]:24000", "proxy:8443/2000",
          "sub.example/webots_simulation_server", "sub.example:8443/webots", "a/b/2000"})
        BOOST_TEST(is_good(good), good);
    for (auto const* bad : {"http://localhost:24000",
                            "https://localhost/2000",
                            "localhost:99999",
                            "localhost:65536",
                            "localhost:0",
                            "localhost/0",
                            "a/b/0",
                            "a//2000",
                            "a/b/",
                            "a/../b",
                            "a/b c",
                            "/2000",
                            ":2000",
                            "a:",
                            "a:2x",
                            "a:-1",
                            "::1:2000",
                            "[]:1",
                            "[::1:2]:x",
                            "[1.2]:1",
                            "me@a:1",
                            "a b:1"})
        BOOST_TEST(!is_good(bad), bad);
    for (auto const* other_spelling : {"localhost:02000", "localhost/02000"})
        BOOST_TEST(!is_good(other_spelling), other_spelling);
}

BOOST_AUTO_TEST_CASE(a_missing_key_is_told_with_the_unknown_ones)
{
    BOOST_TEST(session_error(R"({"prot":1999,"simulationServers":["a/1"]})") ==
               "c.json: key \"port\" is missing: expected an integer from 1 to 65535\n"
               "c.json: unknown key \"prot\" is ignored; did you mean \"port\"?");
}

BOOST_AUTO_TEST_CASE(what_is_no_json_is_placed_by_line_and_column)
{
    BOOST_TEST(session_error("{\n  \"port\": 1999,\n  oops\n}").find("not JSON") != std::string::npos);
    BOOST_TEST(parse_session_config("{\n  \"port\": 1999,\n  oops\n}", "c.json")
                   .error()
                   .message()
                   .starts_with("c.json:3:3: not JSON: a key is in double quotes"));
    BOOST_TEST(session_error("").find("not JSON") != std::string::npos);
    BOOST_TEST(session_error("{} {}").find("not JSON") != std::string::npos);
    BOOST_TEST(session_error("[1]") == "c.json: expected a JSON object { ... }, found the list [1]");
}

BOOST_AUTO_TEST_CASE(wrong_values_are_named_with_key_found_and_wanted)
{
    BOOST_TEST(session_error(R"({"port":"abc","simulationServers":["a/1"]})") ==
               "c.json: key \"port\": expected an integer from 1 to 65535, found the string \"abc\"");
    BOOST_TEST(session_error(R"({"port":70000,"simulationServers":["a/1"]})") ==
               "c.json: key \"port\": expected an integer from 1 to 65535, found the number 70000");
    BOOST_TEST(session_error(R"({"port":1.5,"simulationServers":["a/1"]})").find("found the number 1.5") !=
               std::string::npos);
    BOOST_TEST(session_error(R"({"simulationServers":["a/1"]})") ==
               "c.json: key \"port\" is missing: expected an integer from 1 to 65535");
    BOOST_TEST(session_error(R"({"port":1})") == "c.json: key \"simulationServers\" is missing: expected a "
                                                 "list of \"host:port\" or \"host/port\", or of objects "
                                                 "{\"address\": ..., \"weight\": 2, \"drain\": true}");
    BOOST_TEST(session_error(R"({"port":1,"simulationServers":["a:1"],"ssl":"yes"})") ==
               "c.json: key \"ssl\": expected true or false, found the string \"yes\": write true, without "
               "quotes");
    BOOST_TEST(session_error(R"({"port":1,"simulationServers":["a:1"],"scheduling":"best"})")
                   .find("\"power_of_two\"") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(unknown_keys_are_warned_about_with_the_nearest_known_one)
{
    auto const configured =
        parse_session_config(R"({"port":1,"simulationServers":["a/1"],"portRewrit":true})", "c.json").value();
    BOOST_TEST_REQUIRE(configured.warnings.size() == 1u);
    BOOST_TEST(configured.warnings[0] ==
               "c.json:1:39: unknown key \"portRewrit\" is ignored; did you mean \"portRewrite\"?");
}

BOOST_AUTO_TEST_CASE(so_are_those_of_servers_and_forges)
{
    auto const session = parse_session_config(
        R"({"port":1,"simulationServers":["a/1",{"address":"b/1","wieght":2}]})", "c.json");
    BOOST_TEST(warnings_of(session) ==
               std::vector<std::string>{"c.json: key \"simulationServers\", entry 2: unknown key \"wieght\" "
                                        "is ignored; did you mean \"weight\"?"});
    auto const simulation = parse_simulation_config(
        R"({"server":"h","forges":[{"url":"local:","directory":"x","owner":"me"}]})", "c.json");
    BOOST_TEST(warnings_of(simulation) ==
               std::vector<std::string>{"c.json: key \"forges\", entry 1: unknown key \"owner\" is ignored"});
}

BOOST_AUTO_TEST_CASE(session_defaults_are_those_of_the_reference)
{
    auto const configured =
        parse_session_config(R"({"port":1999,"simulationServers":["a/2000"]})", "c.json").value();
    auto const& config = configured.config;
    BOOST_TEST(configured.warnings.empty());
    BOOST_TEST(config.address.host == "localhost");
    BOOST_TEST(config.address.ssl);
    BOOST_TEST(config.address.port_rewrite);
    BOOST_TEST(config.mail.administrator.empty());
    BOOST_TEST(config.log_dir == "log");
    BOOST_TEST(!config.debug);
    BOOST_TEST(!config.json_log);
    BOOST_TEST((config.polls.interval == std::chrono::seconds(5)));
    BOOST_TEST((config.polls.timeout == std::chrono::seconds(5)));
    BOOST_TEST(config.polls.threshold == 95);
}

BOOST_AUTO_TEST_CASE(every_session_key_of_the_reference_is_obeyed)
{
    auto const configured =
        parse_session_config(R"({"server":"h.org","ssl":false,"sslKey":"k","sslCertificate":"c","port":7,
        "portRewrite":false,"simulationServers":["a:2000","b/2000"],"administrator":"a@b","mailServer":"m","mailServerPort":587,
        "mailSender":"s@b","mailSenderUser":"u","mailSenderPassword":"p","logDir":"logs","debug":true})",
                             "c.json")
            .value();
    auto const& config = configured.config;
    BOOST_TEST(
        configured.warnings ==
            (std::vector<std::string>{
                "c.json: pages of every site may use this server. For those of its own site and of "
                "webots.cloud "
                "alone add this line: \"allowedOrigins\": [\"https://h.org\", \"https://webots.cloud\"],"}),
        boost::test_tools::per_element());
    BOOST_TEST(config.address.host == "h.org");
    BOOST_TEST(!config.address.ssl);
    BOOST_TEST(config.network.ssl_key == "k");
    BOOST_TEST(config.network.ssl_certificate == "c");
    BOOST_TEST(config.address.port == 7);
    BOOST_TEST(!config.address.port_rewrite);
    BOOST_TEST(config.simulation_servers.size() == 2u);
    BOOST_TEST(config.mail.administrator == "a@b");
    BOOST_TEST(config.mail.server == "m");
    BOOST_TEST(config.mail.server_port == 587);
    BOOST_TEST(config.mail.sender == "s@b");
    BOOST_TEST(config.mail.user == "u");
    BOOST_TEST(config.mail.password == "p");
    BOOST_TEST(config.log_dir == "logs");
    BOOST_TEST(config.debug);
}

BOOST_AUTO_TEST_CASE(every_session_key_of_our_own_about_polls_placement_and_pages_is_obeyed)
{
    auto const defaults = parse_session_config(R"({"port":7,"simulationServers":["a/1"]})", "c.json").value();
    BOOST_TEST(defaults.config.placement.policy == "least_committed");
    BOOST_TEST((defaults.config.placement.placement_timeout == std::chrono::seconds(60)));
    BOOST_TEST(!defaults.config.service.decisions_for_all);
    BOOST_TEST(defaults.config.service.teacher_password.empty());
    BOOST_TEST(defaults.config.service.teacher_password_file.empty());
    BOOST_TEST(defaults.config.service.viewer_url.empty());
    BOOST_TEST((defaults.config.service.pause_hidden == Duration::zero()));

    auto const configured = parse_session_config(
        R"({"port":7,"simulationServers":["a/1"],"loadRefresh":0.5,"loadTimeout":2,"loadThreshold":80,
        "memoryThreshold":70,"scheduling":"random","placementTimeout":0,"decisionsForAll":true,"viewerUrl":"https://a/b.wbt",
        "pauseHidden":60})",
        "c.json");
    BOOST_TEST(configured->warnings.empty());
    auto const& config = configured->config;
    BOOST_TEST((config.polls.interval == std::chrono::milliseconds(500)));
    BOOST_TEST((config.polls.timeout == std::chrono::seconds(2)));
    BOOST_TEST(config.polls.threshold == 80);
    BOOST_TEST(config.placement.memory_threshold == 70);
    BOOST_TEST(config.placement.policy == "random");
    BOOST_TEST((config.placement.placement_timeout == Duration::zero()));
    BOOST_TEST(config.service.decisions_for_all);
    BOOST_TEST(config.service.viewer_url == "https://a/b.wbt");
    BOOST_TEST((config.service.pause_hidden == std::chrono::seconds(60)));

    for (auto const* const wrong :
         {R"("loadRefresh":0.01)", R"("loadTimeout":0)", R"("loadThreshold":0)", R"("scheduling":"best")",
          R"("placementTimeout":-1)", R"("decisionsForAll":1)", R"("viewerUrl":1)", R"("pauseHidden":-1)"})
        BOOST_TEST(!parse_session_config(
                       R"({"port":7,"simulationServers":["a/1"],)" + std::string(wrong) + "}", "c.json"),
                   wrong << " should be refused");
}

BOOST_AUTO_TEST_CASE(the_log_is_text_or_json)
{
    BOOST_TEST(parse_simulation_config(R"({"logFormat":"json"})", "c.json")->config.json_log);
    BOOST_TEST(!parse_simulation_config(R"({"logFormat":"text"})", "c.json")->config.json_log);
    BOOST_TEST(!parse_simulation_config(R"({"logFormat":"xml"})", "c.json"));
}

BOOST_AUTO_TEST_CASE(simulation_defaults_are_those_of_the_reference)
{
    auto const configured = parse_simulation_config("{}", "c.json").value();
    auto const& config = configured.config;
    BOOST_TEST(config.address.host == "localhost");
    BOOST_TEST(configured.warnings ==
                   (std::vector<std::string>{"c.json: key \"server\" is missing: browsers are sent to "
                                             "\"localhost\", which is right only on this machine"}),
               boost::test_tools::per_element());
    BOOST_TEST(config.address.port == 2000);
    BOOST_TEST(config.address.ssl);
    BOOST_TEST(config.address.port_rewrite);
    BOOST_TEST(config.launching.max_simulations == 100);
    BOOST_TEST(config.service.repositories.share_idle_time == 50);
    BOOST_TEST((config.launching.timeout == std::chrono::seconds(7200)));
    BOOST_TEST_REQUIRE(config.forges.size() == 1u);
    BOOST_TEST(config.forges[0].url == "https://github.com");
    BOOST_TEST(config.projects_dir.empty());
    BOOST_TEST(config.key_dir == "key");
    BOOST_TEST(config.ca_file.empty());
    BOOST_TEST(config.address.host == "localhost");
    BOOST_TEST(!config.docker);
    BOOST_TEST(config.service.repositories.allowed.empty());
    BOOST_TEST(config.service.repositories.blocked.empty());
    BOOST_TEST(config.log_dir == "log");
    BOOST_TEST(!config.debug);
    BOOST_TEST(config.monitor_log);
    BOOST_TEST(config.confine_server);
    BOOST_TEST(config.service.title.empty());
    BOOST_TEST(config.service.description.empty());
    BOOST_TEST(config.webots_home.empty());
    BOOST_TEST(!config.containers.persistent_images);
    BOOST_TEST((config.network.ssl_certificate.empty() && config.network.ssl_key.empty()));
}

BOOST_AUTO_TEST_CASE(simulation_defaults_of_our_own_are_those_of_the_readme)
{
    auto const config = parse_simulation_config("{}", "/etc/c.json").value().config;
    BOOST_TEST((config.launching.start_timeout == std::chrono::seconds(300)));
    BOOST_TEST(config.containers.build_cache == std::uint64_t{20} << 30);
    BOOST_TEST(!config.service.reconnect_grace);
    BOOST_TEST(!config.service.reference_load);
    BOOST_TEST((config.simulation_log_keep == std::chrono::hours(24 * 7)));
    BOOST_TEST(config.cache_bytes == std::uint64_t{10} << 30);
    BOOST_TEST(config.containers.directory == "/etc/docker");
    BOOST_TEST(config.containers.images == "cyberbotics/webots.cloud");
    BOOST_TEST(!config.containers.project_dockerfiles);
    BOOST_TEST(!config.json_log);
    BOOST_TEST(config.launching.gateway);
    BOOST_TEST(config.service.traffic_limit == 0u);
}

BOOST_AUTO_TEST_CASE(folders_of_templates_and_keys_are_those_of_the_first_generations)
{
    auto const configured =
        parse_simulation_config(R"({"projectsDir":"/p","keyDir":"/k"})", "c.json").value();
    BOOST_TEST(configured.config.projects_dir == "/p");
    BOOST_TEST(configured.config.key_dir == "/k");
}

// Section 4.3: simulations have the ports after the server's, and the editor of one is 500 above it.
BOOST_AUTO_TEST_CASE(what_leaves_no_ports_for_simulations_or_editors_is_refused)
{
    auto const refusal = [](std::string_view text) {
        auto const configured = parse_simulation_config(text, "c.json");
        return sentence_of(configured);
    };
    BOOST_TEST(refusal(R"({"port":65535})") ==
               "c.json: key \"port\": expected an integer from 1 to 65534, found the number 65535");
    BOOST_TEST(refusal(R"({"port":65534})") == "");
    BOOST_TEST(refusal(R"({"docker":true,"maxConnections":500})") ==
               "c.json: key \"maxConnections\": expected at most 499 with \"docker\", since the port of an "
               "editor is 500 above "
               "that of its simulation, found the number 500");
    BOOST_TEST(refusal(R"({"docker":true,"maxConnections":499})") == "");
    BOOST_TEST(refusal(R"({"maxConnections":500})") == "");
    BOOST_TEST(refusal(R"({"docker":true,"port":65034})") == "");
    BOOST_TEST(refusal(R"({"docker":true,"port":65035})") ==
               "c.json: key \"port\": expected an integer from 1 to 65034, found the number 65035");
    BOOST_TEST(refusal(R"({"sandbox":"docker","port":65035})") ==
               "c.json: key \"port\": expected an integer from 1 to 65034, found the number 65035");
}

BOOST_AUTO_TEST_CASE(what_jobs_of_slurm_can_not_be_is_refused)
{
    auto const refusal = [](std::string_view text) {
        auto const parsed = parse_simulation_config(text, "c.json");
        auto const message = parsed ? std::string() : parsed.error().message();
        auto const key = message.find("key ");
        return key == std::string::npos ? message : message.substr(key);
    };
    BOOST_TEST(refusal(R"({"launcher":{"slurm":{}}})") == "");
    BOOST_TEST(refusal(R"({"launcher":{}})") == "");
    BOOST_TEST(refusal(R"({"launcher":"slurm"})") ==
               "key \"launcher\": expected an object, as in {\"slurm\": {}}, found the string \"slurm\"");
    BOOST_TEST(refusal(R"({"launcher":{"slurm":true}})") ==
               "key \"launcher\": key \"slurm\": expected an object, as in {\"partition\": "
               "\"simulations\"}, found true");
    BOOST_TEST(refusal(R"({"launcher":{"slurm":{"processors":0}}})") ==
               "key \"launcher\": key \"slurm\": key \"processors\": expected an integer from 1 to 10000, "
               "found the number 0");
    BOOST_TEST(refusal(R"({"launcher":{"slurm":{"partition":"a b"}}})") ==
               "key \"launcher\": key \"slurm\": key \"partition\": expected a name without spaces and |, "
               "found the string \"a b\"");
    BOOST_TEST(refusal(R"({"launcher":{"slurm":{"overrides":[{"mode":"4d"}]}}})") ==
               "key \"launcher\": key \"slurm\": key \"overrides\", entry 1: key \"mode\": expected "
               "\"x3d\", \"w3d\" or \"mjpeg\", found the string \"4d\"");
    BOOST_TEST(refusal(R"({"launcher":{"slurm":{"copyTo":"tmp"}}})") ==
               "key \"launcher\": key \"slurm\": key \"copyTo\": expected an absolute path, which is one of "
               "the nodes, found the string \"tmp\"");
    BOOST_TEST(refusal(R"({"launcher":{"slurm":{"overrides":["x"]}}})") ==
               "key \"launcher\": key \"slurm\": key \"overrides\", entry 1: expected an object, found the "
               "string \"x\"");
    BOOST_TEST(refusal(R"({"launcher":{"slurm":{}},"docker":true})") ==
               "key \"launcher\": expected no \"slurm\" together with \"docker\", found the object "
               "{\"slurm\":{}}");
    BOOST_TEST(refusal(R"({"launcher":{"slurm":{}},"gateway":false})") ==
               "key \"launcher\": expected no \"slurm\" where \"gateway\" is false: browsers don't reach "
               "nodes, found the object {\"slurm\":{}}");
    BOOST_TEST(refusal(R"({"launcher":{"slurm":{}},"simulationUser":"w"})") ==
               "key \"simulationUser\": expected \"auto\" or \"none\", since jobs of Slurm are this server's "
               "user's, found the string \"w\"");
}

BOOST_AUTO_TEST_CASE(the_two_keys_that_choose_docker_must_not_contradict_each_other)
{
    auto const refusal = [](std::string_view text) {
        auto const configured = parse_simulation_config(text, "c.json");
        return sentence_of(configured);
    };
    BOOST_TEST(refusal(R"({"docker":true,"sandbox":"auto"})") == "");
    BOOST_TEST(refusal(R"({"docker":true,"sandbox":"docker"})") == "");
    BOOST_TEST(
        refusal(R"({"docker":true,"sandbox":"bubblewrap"})") ==
        "c.json: key \"sandbox\": expected \"docker\" or \"auto\", since \"docker\" is true, found the "
        "string \"bubblewrap\"");
    BOOST_TEST(
        refusal(R"({"docker":false,"sandbox":"docker"})") ==
        "c.json: key \"sandbox\": expected another one than \"docker\", since \"docker\" is false, found "
        "the string \"docker\"");
    BOOST_TEST(refusal(R"({"docker":false,"sandbox":"firejail"})") == "");
}

BOOST_AUTO_TEST_CASE(no_more_simulations_are_taken_than_there_are_ports)
{
    auto const read = [](std::string_view keys) {
        return parse_simulation_config(R"({"server":"h",)" + std::string(keys) + "}", "c.json").value();
    };
    auto const five = read(R"("port":65530)");
    BOOST_TEST(five.config.launching.max_simulations == 5);
    BOOST_TEST(five.warnings ==
               std::vector<std::string>{
                   "c.json: key \"maxConnections\": only 5 simulations at once instead of 100, since there "
                   "are no more ports above \"port\" (65530)"});
    auto const editors = read(R"("port":65030,"docker":true)");
    BOOST_TEST(editors.config.launching.max_simulations == 5);
    auto const enough = read(R"("port":65530,"maxConnections":5)");
    BOOST_TEST(enough.config.launching.max_simulations == 5);
    BOOST_TEST(enough.warnings.empty());
}

BOOST_AUTO_TEST_CASE(a_limit_of_traffic_that_nothing_keeps_is_warned_of)
{
    auto const configured =
        parse_simulation_config(R"({"server":"h","gateway":false,"trafficLimit":1})", "c.json").value();
    BOOST_TEST(configured.warnings == std::vector<std::string>{"c.json: key \"trafficLimit\" has no effect, "
                                                               "since \"gateway\" is false"});
}

BOOST_AUTO_TEST_CASE(keys_for_controllers_that_open_nothing_are_warned_of)
{
    auto const warnings = [](std::string const& keys) {
        return parse_simulation_config(R"({"server":"h",)" + keys + "}", "c.json").value().warnings;
    };
    using Warnings = std::vector<std::string>;
    BOOST_TEST(warnings(R"("controllerPort":2900,"controllerRepositories":["https://github.com/o"])") ==
               Warnings());
    BOOST_TEST(
        warnings(R"("controllerPort":2900)") ==
        Warnings{"c.json: key \"controllerPort\" has no effect, since \"controllerRepositories\" names no "
                 "project whose robots may be controlled from other machines"});
    BOOST_TEST(
        warnings(R"("controllerRepositories":["https://github.com/o"])") ==
        Warnings{
            "c.json: key \"controllerRepositories\" has no effect, since there is no \"controllerPort\""});
    BOOST_TEST(
        warnings(R"("gateway":false,"controllerPort":2900)") ==
        Warnings{"c.json: key \"controllerPort\" has no effect, since \"gateway\" is false: controllers "
                 "reach simulators at their own ports"});
}

BOOST_AUTO_TEST_CASE(controllers_have_a_port_of_their_own_and_an_address_that_their_library_understands)
{
    auto const is_taken = [](std::string const& keys) {
        return parse_simulation_config(R"({"server":"h","maxConnections":100,)" + keys + "}", "c.json")
            .has_value();
    };
    for (auto const* port : {"2000", "2001", "2100"})
        BOOST_TEST(!is_taken(std::string(R"("controllerPort":)") + port), port);
    for (auto const* port : {"0", "1999", "2101"})
        BOOST_TEST(is_taken(std::string(R"("controllerPort":)") + port), port);
    for (auto const* address : {"h", "h:0", "h:65536", "[::1]:2900", "tcp://h:2900", "h:2900/x", "h h:2900",
                                ":2900", "h:2900/0", "h:2900/2000/x"})
        BOOST_TEST(!is_taken(std::string(R"("controllerAddress":")") + address + '"'), address);
    for (auto const* address : {"h:2900", "192.0.2.1:1", "h:2900/2000"})
        BOOST_TEST(is_taken(std::string(R"("controllerAddress":")") + address + '"'), address);
}

BOOST_AUTO_TEST_CASE(a_session_server_passes_controllers_on_to_machines_that_have_a_port_to_name)
{
    auto const parsed = [](std::string const& machine, std::string const& more) {
        return parse_session_config(R"({"port":1999,"server":"h","simulationServers":[{"address":)" +
                                        machine + "}]," + more + "}",
                                    "c.json");
    };
    std::string const port = R"("controllerPort":2899)";
    auto const good = parsed(R"("h:2000","controllers":"10.0.0.2:2900")", port);
    BOOST_TEST(good.value().config.simulation_servers.front().controllers == "10.0.0.2:2900");
    BOOST_TEST(good.value().warnings.empty());
    for (auto const* machine :
         {R"("h:2000","controllers":"sim:2900")", R"("h:2000","controllers":"https://10.0.0.2:2900")",
          R"("h/path","controllers":"10.0.0.2:2900")"})
        BOOST_TEST(!parsed(machine, port), machine);
    BOOST_TEST(!parsed(R"("h:2000","controllers":"10.0.0.2:2900")", R"("controllerPort":1999)"));
    BOOST_TEST(parsed(R"("h:2000")", port).value().warnings.size() == 1u);
    BOOST_TEST(
        parsed(R"("h:2000","controllers":"10.0.0.2:2900")", R"("logDir":"log")").value().warnings.size() ==
        1u);
}

BOOST_AUTO_TEST_CASE(a_certificate_without_a_proxy_is_warned_of_since_simulators_speak_no_tls)
{
    auto const warnings = [](std::string_view keys) {
        return parse_simulation_config(R"({"server":"h","sslCertificate":"/c","sslKey":"/k",)" +
                                           std::string(keys) + "}",
                                       "c.json")
            .value()
            .warnings;
    };
    BOOST_TEST(warnings(R"("portRewrite":false,"gateway":false)") ==
               std::vector<std::string>{"c.json: browsers are sent to wss://h:<port of the simulation>, but "
                                        "simulators speak no TLS, whatever "
                                        "\"sslCertificate\" says: no simulation can be shown. Set "
                                        "\"gateway\" to true, or let a proxy "
                                        "end TLS, as in config/nginx, and set "
                                        "\"portRewrite\" to true"});
    BOOST_TEST(warnings(R"("portRewrite":false)").empty());
    BOOST_TEST(warnings(R"("portRewrite":true,"gateway":false)").empty());
    BOOST_TEST(warnings(R"("portRewrite":false,"ssl":false,"gateway":false)").empty());
}

// Protocol section 8.1: until 2021 there was no `ssl`, and the Python servers of today ask such machines by
// https too.
BOOST_AUTO_TEST_CASE(who_has_no_ssl_key_is_told_that_machines_are_asked_by_https)
{
    auto const warnings = [](std::string_view servers, std::string_view keys = "") {
        return parse_session_config(R"({"port":1,"simulationServers":[)" + std::string(servers) + "]" +
                                        std::string(keys) + "}",
                                    "c.json")
            .value()
            .warnings;
    };
    BOOST_TEST(warnings(R"("a/1","b:2000")") ==
               std::vector<std::string>{
                   "c.json: key \"ssl\" is missing and counts as true: simulation servers are asked by https "
                   "(https://b:2000/load) and browsers sent to wss://. Configurations of 2018 to 2021 have "
                   "no such key, and "
                   "their machines speak plain http: then set it to false; else to true"});
    BOOST_TEST(warnings(R"("a/1","b/2")").empty()); // behind a proxy, as in configurations of all versions
    BOOST_TEST(warnings(R"("a:1")", R"(,"ssl":true)").empty());
    BOOST_TEST(warnings(R"("a:1")", R"(,"ssl":false)").empty());
}

BOOST_AUTO_TEST_CASE(who_has_no_ssl_key_and_no_proxy_is_told_where_browsers_are_sent)
{
    auto const warnings = [](std::string_view keys) {
        return parse_simulation_config(R"({"server":"h")" + std::string(keys) + "}", "c.json")
            .value()
            .warnings;
    };
    BOOST_TEST(warnings(R"(,"portRewrite":false)") ==
               std::vector<std::string>{"c.json: key \"ssl\" is missing and counts as true: browsers are "
                                        "sent to wss://h:2000, "
                                        "where this server speaks plain http. Configurations of 2018 to 2021 "
                                        "have no such key: set it to false, or to "
                                        "true if a proxy ends TLS on that port"});
    BOOST_TEST(warnings(R"(,"portRewrite":false,"gateway":false)") ==
               std::vector<std::string>{"c.json: key \"ssl\" is missing and counts as true: browsers are "
                                        "sent to wss://h:<port of the simulation>, "
                                        "where simulators speak plain http. Configurations of 2018 to 2021 "
                                        "have no such key: set it to false, or to "
                                        "true if a proxy ends TLS on those ports"});
    BOOST_TEST(warnings("").empty());
    BOOST_TEST(warnings(R"(,"portRewrite":false,"ssl":true)").empty());
    BOOST_TEST(warnings(R"(,"portRewrite":false,"ssl":false)").empty());
}

BOOST_AUTO_TEST_CASE(browsers_may_be_silent_for_a_minute_or_as_long_as_the_operator_says)
{
    auto const parse = [](std::string_view keys) {
        return parse_simulation_config("{" + std::string(keys) + "}", "c.json");
    };
    BOOST_TEST((parse("")->config.network.ping_timeout == std::chrono::seconds(60)));
    BOOST_TEST((parse(R"("pingTimeout":900)")->config.network.ping_timeout == std::chrono::seconds(900)));
    BOOST_TEST((parse(R"("pingTimeout":0)")->config.network.ping_timeout == Duration::zero()));
    BOOST_TEST((parse("")->config.network.ping_interval == std::chrono::seconds(20)));
    BOOST_TEST((parse(R"("pingInterval":8)")->config.network.ping_interval == std::chrono::seconds(8)));
    BOOST_TEST(!parse(R"("pingInterval":0)"));
    BOOST_TEST((parse_session_config(R"({"port":1,"simulationServers":["a/1"],"pingTimeout":2})", "c.json")
                    ->config.network.ping_timeout == std::chrono::seconds(2)));
    BOOST_TEST(
        sentence_of(parse(R"("pingTimeout":1.9)"))
            .starts_with(
                "c.json: key \"pingTimeout\": expected 0, or a number from 2 to 10000000 (seconds), found "));
    for (auto const* bad : {"-1", "\"60\"", "null", "10000001"})
        BOOST_TEST(!parse(R"("pingTimeout":)" + std::string(bad)), bad);
}

BOOST_AUTO_TEST_CASE(the_simulators_environment_is_a_list_of_names_patterns_and_values)
{
    auto const parse = [](std::string_view list, std::string_view more = "") {
        return parse_simulation_config(R"({"server":"h","simulatorEnvironment":)" + std::string(list) +
                                           std::string(more) + "}",
                                       "c.json");
    };
    BOOST_TEST(parse(R"(["LAB_HOST","VGL_*","MODE=a b"])")->config.launching.simulator_environment ==
                   (std::vector<std::string>{"LAB_HOST", "VGL_*", "MODE=a b"}),
               boost::test_tools::per_element());
    BOOST_TEST(parse("[]")->warnings.empty());
    auto const where = std::string("c.json: key \"simulatorEnvironment\", entry 2: expected ");
    BOOST_TEST(sentence_of(parse(R"(["A","API KEY=hunter2"])")) ==
               where + "the name of a variable, the beginning of one as in \"ROS_*\", or \"NAME=value\", "
                       "found the string "
                       "\"API KEY=...\"");
    BOOST_TEST(sentence_of(parse(R"(["A","NOTIFY_SOCKET"])")) ==
               where +
                   "no variable that systemd gives to this server alone, found the string \"NOTIFY_SOCKET\"");
    BOOST_TEST(sentence_of(parse(R"(["A","DISPLAY=:1"])")) ==
               where + "no value for DISPLAY: the key \"display\" sets it, found the string \"DISPLAY=...\"");
    BOOST_TEST(parse(R"(["A","WEBOTS=x"])").has_value());
    BOOST_TEST(
        sentence_of(parse(R"(["A","WEBOTS=x"])", R"(,"docker":true)")) ==
        where + "no variable that the server sets for compose itself (see docs/docker.md), found the string "
                "\"WEBOTS=...\"");
    std::string many = "[\"A=\"";
    for (int i = 0; i < 5; ++i)
        many += ",\"A=" + std::string(30'000, 'x') + "\"";
    BOOST_TEST(
        sentence_of(parse(many + "]"))
            .starts_with("c.json: key \"simulatorEnvironment\": expected at most 131072 characters in all"));
    for (auto const* bad : {"\"A\"", "{}", "5", "[5]", R"(["A\nB=1"])", R"(["A=\u0000"])", R"([""])"})
        BOOST_TEST(!parse(bad), bad);
}

BOOST_AUTO_TEST_CASE(repositories_that_are_on_no_forge_are_warned_of)
{
    auto const warnings = [](std::string_view keys) {
        return parse_simulation_config(R"({"server":"h",)" + std::string(keys) + "}", "c.json")
            .value()
            .warnings;
    };
    BOOST_TEST(warnings(R"("allowedRepositories":["cyberbotics"])") ==
               std::vector<std::string>{
                   "c.json: key \"allowedRepositories\": \"cyberbotics\" has no effect: it is on none of the "
                   "\"forges\", for instance https://github.com/<owner>"});
    BOOST_TEST(warnings(R"("blockedRepositories":["https://gitlab.com/a"])").size() == 1u);
    BOOST_TEST(
        warnings(R"("allowedRepositories":["https://github.com","https://GitHub.com/a/b/","https://"])")
            .empty());
    BOOST_TEST(warnings(R"("forges":[{"url":"local:","directory":"x"}],"allowedRepositories":["local:/a"])")
                   .empty());
}

BOOST_AUTO_TEST_CASE(the_name_of_a_server_is_a_host)
{
    auto const error = [](std::string const& server) {
        auto const configured = parse_simulation_config(R"({"server":")" + server + "\"}", "c.json");
        return sentence_of(configured);
    };
    BOOST_TEST(error("http://x.org") ==
               "c.json: key \"server\": expected the name of a host, as in "
               "\"sim.example.org\", found the string \"http://x.org\": write \"x.org\"");
    BOOST_TEST(
        error("x.org/webots/") ==
        "c.json: key \"server\": expected the name of a host, or one with a path of at most 100 letters, "
        "digits, \"-\", \"_\", \".\" and \"~\", as in \"sim.example.org/webots\", found the string "
        "\"x.org/webots/\": write \"x.org/webots\"");
    BOOST_TEST(error("https://x.org/webots").ends_with(": write \"x.org/webots\""));
    for (auto const* bad : {"x.org/", "x y", "x.org:port", "x.org/a b", "x.org/..", "x y/webots"})
        BOOST_TEST(!error(bad).empty(), bad);
    for (auto const* good : {"x.org", "x.org:8443", "127.0.0.1", "[::1]", "", "x.org/webots", "*/webots"})
        BOOST_TEST(error(good) == "", good);
    BOOST_TEST(session_error(R"({"port":1,"simulationServers":["a/1"],"server":"https://x.org"})")
                   .find("key \"server\"") != std::string::npos);
    BOOST_TEST(!parse_simulation_config(R"({"fullyQualifiedDomainName":"https://x.org"})", "c.json"));
}

// As the Python servers take it.
BOOST_AUTO_TEST_CASE(a_site_below_a_path_has_it_in_its_names_without_a_complaint)
{
    auto const simulation =
        parse_simulation_config(R"({"server":"sub.example/webots_simulation_server","ssl":true})", "c.json");
    BOOST_TEST(simulation->config.address.host == "sub.example");
    BOOST_TEST(simulation->config.address.path == "/webots_simulation_server");
    BOOST_TEST(simulation->warnings.empty());
    auto const session = parse_session_config(
        R"({"port":1999,"server":"sub.example/webots","ssl":true,
            "simulationServers":["sub.example/webots_simulation_server","localhost/webots",
            {"address":"sub.example/webots/2000","internal":"127.0.0.1:2000"}]})",
        "c.json");
    BOOST_TEST(session->config.address.host == "sub.example");
    BOOST_TEST(session->config.address.path == "/webots");
    BOOST_TEST(session->config.service.gateway);
    BOOST_TEST(session->warnings.empty());
    BOOST_TEST(
        parse_simulation_config(R"({"server":"x:8443/webots","ssl":false,"portRewrite":false})", "c.json")
            ->warnings.empty(),
        "no port follows a path");
}

// What the rows of the table of keys alone don't say, a row each; `config_reload_test` tries every key.
BOOST_AUTO_TEST_CASE(shapes_units_and_other_names_of_keys_of_the_simulation_server_are_understood)
{
    using Texts = std::vector<std::string>;
    struct Row
    {
        char const* text;
        bool (*arrived)(SimulationConfig const& config);
    };
    Row const rows[] = {
        {R"("server":"h")", [](auto const& c) { return c.address.host == "h"; }},
        {R"("fullyQualifiedDomainName":"h")", [](auto const& c) { return c.address.host == "h"; }},
        {R"("docker":true)", [](auto const& c) { return c.docker; }},
        {R"("launcher":{"slurm":{"partition":"p","account":"a","qos":"q","memory":512,"processors":4,)"
         R"("gres":"gpu:1","timeLimit":3600}})",
         [](auto const& c) {
             auto const& job = c.slurm->job;
             return job.partition == "p" && job.account == "a" && job.qos == "q" &&
                    job.memory == std::uint64_t{512} << 20 && job.processors == 4 && job.gres == "gpu:1" &&
                    job.time_limit == std::chrono::hours(1);
         }},
        {R"("launcher":{"slurm":{"partition":"p","overrides":[{"mode":"x3d","label":"l","processors":2}]}})",
         [](auto const& c) {
             auto const& other = c.slurm->overrides.at(0);
             return other.mode == "x3d" && other.label == "l" && other.job.processors == 2 &&
                    other.job.partition == "p";
         }},
        {R"("launcher":{"slurm":{"copyTo":"/tmp"}})",
         [](auto const& c) { return c.slurm->copy_to == "/tmp"; }},
        {R"("allowedRepositories":["https://github.com/a","https://"])",
         [](auto const& c) {
             return c.service.repositories.allowed == Texts{"https://github.com/a", "https://"};
         }},
        {R"("notify":["http://a"])", [](auto const& c) { return c.service.notify == Texts{"http://a"}; }},
        {R"("sandbox":"firejail")", [](auto const& c) { return c.sandbox == "firejail" && !c.docker; }},
        {R"("sandbox":"docker")", [](auto const& c) { return c.docker; }},
        {R"("timeout":400)", [](auto const& c) { return c.launching.timeout == std::chrono::seconds(400); }},
        {R"("persistantDockerImages":["r:t"])",
         [](auto const& c) { return c.containers.persistent_images == std::vector<std::string>{"r:t"}; }},
        {R"("docker":false)", [](auto const& c) { return !c.containers.persistent_images; }},
        {R"("dockerDir":"/d")", [](auto const& c) { return c.containers.directory == "/d"; }},
        {R"("dockerDir":"d")", [](auto const& c) { return c.containers.directory.filename() == "d"; }},
        {R"("buildCache":0.5)",
         [](auto const& c) { return c.containers.build_cache == std::uint64_t{1} << 29; }},
        {R"("reconnectGrace":1.5)",
         [](auto const& c) { return c.service.reconnect_grace == std::chrono::milliseconds(1500); }},
        {R"("reconnectGrace":0)",
         [](auto const& c) { return c.service.reconnect_grace == Duration::zero(); }},
        {R"("simulationLogDays":0.5)",
         [](auto const& c) { return c.simulation_log_keep == std::chrono::hours(12); }},
        {R"("fetchMemory":256)", [](auto const& c) { return c.fetch_memory == std::uint64_t{256} << 20; }},
        {R"("fetchDisk":0.5)", [](auto const& c) { return c.fetch_disk == std::uint64_t{512} << 20; }},
        {R"("simulationMemory":512)",
         [](auto const& c) { return c.limits.memory == std::uint64_t{512} << 20; }},
        {R"("simulationMemory":0)", [](auto const& c) { return c.limits.memory == std::uint64_t{0}; }},
        {R"("simulationDisk":0.5)", [](auto const& c) { return c.limits.disk == std::uint64_t{1} << 19; }},
    };
    for (auto const& [text, arrived] : rows) {
        bool const names_server = std::string_view(text).starts_with(R"("server")");
        auto const configured = parse_simulation_config(
            (names_server ? "{" : R"({"server":"h",)") + std::string(text) + "}", "c.json");
        BOOST_TEST_REQUIRE(configured.has_value(), text);
        BOOST_TEST(configured->warnings.empty(), text);
        BOOST_TEST(arrived(configured->config), text);
    }
}

BOOST_AUTO_TEST_CASE(limits_that_no_simulation_could_start_with_are_refused)
{
    for (auto const* text : {R"("simulationMemory":1)", R"("simulationCpus":0.001)",
                             R"("simulationProcesses":3)", R"("simulationFiles":3)",
                             R"("simulationMemory":-1)", R"("simulationDisk":-1)", R"("trafficLimit":-1)"})
        BOOST_TEST(!parse_simulation_config(std::string("{") + text + "}", "c.json").has_value(), text);
    auto const refused = parse_simulation_config(R"({"simulationMemory":1})", "c.json");
    BOOST_TEST(sentence_of(refused) == "c.json: key \"simulationMemory\": expected 0, or a number from 64 to "
                                       "1000000000 (megabytes), found the number 1");
}

BOOST_AUTO_TEST_CASE(addresses_of_multimedia_hold_nothing_that_would_end_their_option)
{
    for (std::string const address : {"a b", "a;ssl", "a\\\"", "a\\t"})
        for (std::string const key : {"multimediaServer", "multimediaStream"})
            BOOST_TEST(parse_simulation_config("{\"" + key + "\":\"" + address + "\"}", "c.json").has_error(),
                       address);
}

BOOST_AUTO_TEST_CASE(trusted_proxies_are_addresses_and_networks)
{
    auto const parse = [](std::string_view list) {
        return parse_session_config(
            R"({"port":1,"simulationServers":["a/1"],"trustedProxies":)" + std::string(list) + "}", "c.json");
    };
    BOOST_TEST(parse(R"(["127.0.0.1","10.0.0.0/8","::1","2001:db8::/32"])")->warnings.empty());
    BOOST_TEST(parse("[]")->config.network.trusted_proxies.empty());
    BOOST_TEST(parse_simulation_config("{}", "c.json")->config.network.trusted_proxies ==
                   (std::vector<std::string>{"127.0.0.0/8", "::1"}),
               boost::test_tools::per_element());
    BOOST_TEST(sentence_of(parse(R"(["::1","10.0.0.1/8"])")) ==
               "c.json: key \"trustedProxies\", entry 2: expected an address or a network without bits set "
               "beyond it, as in "
               "\"127.0.0.1\", \"10.0.0.0/8\" or \"::1\", found the string \"10.0.0.1/8\"");
    for (auto const* bad : {R"("127.0.0.1")", "[5]", R"(["localhost"])", R"(["10.0.0.0/33"])", R"([""])",
                            R"(["127.0.0.1:80"])"})
        BOOST_TEST(!parse(bad), bad);
}

BOOST_AUTO_TEST_CASE(an_address_may_have_three_quarters_of_the_simulations_unless_the_operator_says_otherwise)
{
    auto const share = [](std::string_view text) {
        auto const config = parse_simulation_config(text, "c.json")->config;
        return config.service.limit_of_an_address(config.launching.max_simulations);
    };
    BOOST_TEST(share("{}") == 75);
    BOOST_TEST(share(R"({"maxConnections":20})") == 15);
    BOOST_TEST(share(R"({"maxConnections":3})") == 3);
    BOOST_TEST(share(R"({"maxConnections":1})") == 1);
    BOOST_TEST(share(R"({"maxConnections":100,"port":65515})") == 15, "of what there are ports for");
    BOOST_TEST(share(R"({"maxConnections":20,"simulationsPerAddress":20})") == 20);
    for (auto const* bad : {"-1", "10001", "1.5", "\"5\"", "null"})
        BOOST_TEST(
            !parse_simulation_config(R"({"simulationsPerAddress":)" + std::string(bad) + "}", "c.json"), bad);
}

BOOST_AUTO_TEST_CASE(a_client_may_ask_for_so_many_sessions_at_once_and_so_many_a_second)
{
    auto const parse = [](std::string_view keys) {
        return parse_session_config(R"({"port":1,"simulationServers":["a/1"])" + std::string(keys) + "}",
                                    "c.json");
    };
    BOOST_TEST(parse("")->config.service.session_burst == 200);
    BOOST_TEST(parse("")->config.service.session_rate == 10);
    auto const configured = parse(R"(,"sessionBurst":5,"sessionRate":0.5)").value();
    BOOST_TEST(configured.warnings.empty());
    BOOST_TEST(configured.config.service.session_burst == 5);
    BOOST_TEST(configured.config.service.session_rate == 0.5);
    BOOST_TEST(parse(R"(,"sessionBurst":0,"sessionRate":0)").has_value());
    BOOST_TEST(sentence_of(parse(R"(,"sessionRate":0.001)")) ==
               "c.json: key \"sessionRate\": expected 0, or a number from 0.01 to 100000 (requests per "
               "second), found the number 0.001");
    for (auto const* bad : {R"(,"sessionBurst":-1)", R"(,"sessionBurst":1.5)", R"(,"sessionBurst":100001)",
                            R"(,"sessionRate":-1)", R"(,"sessionRate":"10")", R"(,"sessionRate":null)"})
        BOOST_TEST(!parse(bad), bad);
}

BOOST_AUTO_TEST_CASE(a_session_server_relays_only_when_told_and_then_a_thousand_may_wait)
{
    auto const parse = [](std::string_view keys) {
        return parse_session_config(R"({"port":1,"simulationServers":["a/1"])" + std::string(keys) + "}",
                                    "c.json");
    };
    BOOST_TEST(!parse("")->config.service.relay);
    BOOST_TEST(parse("")->config.service.waiting_room == 1000);
    auto const configured = parse(R"(,"relay":true,"waitingRoom":0)").value();
    BOOST_TEST(configured.warnings.empty());
    BOOST_TEST(configured.config.service.relay);
    BOOST_TEST(configured.config.service.waiting_room == 0);
    for (auto const* bad : {R"(,"relay":1)", R"(,"waitingRoom":-1)", R"(,"waitingRoom":100001)",
                            R"(,"waitingRoom":1.5)", R"(,"waitingRoom":true)"})
        BOOST_TEST(!parse(bad), bad);
}

BOOST_AUTO_TEST_CASE(trust_in_everybody_is_warned_of)
{
    for (std::string const everybody : {"0.0.0.0/0", "::/0"}) {
        auto const configured =
            parse_simulation_config(R"({"server":"h","trustedProxies":[")" + everybody + "\"]}", "c.json")
                .value();
        BOOST_TEST(
            configured.warnings ==
            std::vector<std::string>{"c.json: key \"trustedProxies\": \"" + everybody +
                                     "\" is everybody: no client is limited, and each can pass for another"});
    }
}

// Quirk Q18.
BOOST_AUTO_TEST_CASE(a_short_timeout_counts_as_two_hours_as_it_always_did)
{
    auto const configured = parse_simulation_config(R"({"server":"h","timeout":359})", "c.json").value();
    BOOST_TEST((configured.config.launching.timeout == std::chrono::seconds(7200)));
    BOOST_TEST(configured.warnings.size() == 1u);
    BOOST_TEST((parse_simulation_config(R"({"timeout":360})", "c.json")->config.launching.timeout ==
                std::chrono::seconds(360)));
}

// Quirk Q31.
BOOST_AUTO_TEST_CASE(the_older_name_of_server_is_an_alias)
{
    BOOST_TEST(
        parse_simulation_config(R"({"fullyQualifiedDomainName":"h"})", "c.json")->config.address.host == "h");
    BOOST_TEST(parse_simulation_config(R"({"fullyQualifiedDomainName":"h","server":"s"})", "c.json")
                   ->config.address.host == "s");
}

BOOST_AUTO_TEST_CASE(a_site_without_a_name_says_where_its_machines_are)
{
    auto const parse = [](std::string_view entry, std::string_view more = "") {
        return parse_session_config(
            core::concat(R"({"server":"*","ssl":false,"port":1999,"simulationServers":[)", entry, "]", more,
                         "}"),
            "c.json");
    };
    auto const site = parse(R"({"address":"*/2000","internal":"127.0.0.1:2000"})").value();
    BOOST_TEST(site.warnings.empty());
    BOOST_TEST(site.config.service.gateway);
    BOOST_TEST(parse(R"("*/2000")", R"(,"gateway":true)").has_value(), "the gateway knows that it is here");
    for (auto const* entry : {R"("*/2000")", R"("*:2000")"}) {
        auto const refused = parse(entry);
        BOOST_TEST_REQUIRE(!refused, entry);
        BOOST_TEST(sentence_of(refused).find("has to say where the machine is") != std::string::npos,
                   sentence_of(refused));
    }
}

BOOST_AUTO_TEST_CASE(registries_are_a_string_or_a_list)
{
    auto const notify = [](std::string_view text) {
        return parse_simulation_config(text, "c.json")->config.service.notify;
    };
    BOOST_TEST(SimulationConfig().service.notify.empty(), "who embeds a server registers it, or does not");
    BOOST_TEST(notify("{}") == std::vector<std::string>{"https://webots.cloud/ajax/server/setup.php"},
               boost::test_tools::per_element());
    BOOST_TEST(notify(R"({"notify":"http://a"})") == std::vector<std::string>{"http://a"},
               boost::test_tools::per_element());
    BOOST_TEST(notify(R"({"notify":[]})").empty());
    BOOST_TEST(notify(R"({"server":"*"})").empty(), "it has no address that could be registered");
    BOOST_TEST(!parse_simulation_config(R"({"notify":5})", "c.json"));
    BOOST_TEST(
        sentence_of(parse_simulation_config(R"({"notify":["https://a","webots.cloud"]})", "c.json")) ==
        "c.json: key \"notify\": expected addresses that start with https:// or http://, or [] for none, "
        "found the list "
        "[\"https://a\",\"webots.cloud\"]");
    for (auto const* bad : {"webots.cloud", "", "https://", "ftp://a", "https:///a"})
        BOOST_TEST(!parse_simulation_config(R"({"notify":")" + std::string(bad) + "\"}", "c.json"), bad);
}

BOOST_AUTO_TEST_CASE(forges_are_urls_or_folders_beside_the_file)
{
    auto const configured =
        parse_simulation_config(
            R"({"forges":["https://git.example.org/",{"url":"local:","directory":"../x"}]})",
            "/etc/w/simulation/c.json")
            .value();
    BOOST_TEST(configured.config.forges[0].url == "https://git.example.org");
    BOOST_TEST(configured.config.forges[1].directory == "/etc/w/x");
    BOOST_TEST((configured.config.forges[0].kind == ForgeKind::unknown));
    BOOST_TEST(!parse_simulation_config(R"({"forges":["ftp://x"]})", "c.json"));
    BOOST_TEST(!parse_simulation_config(R"({"forges":"https://x"})", "c.json"));
}

BOOST_AUTO_TEST_CASE(a_forge_may_be_said_to_be_of_a_kind)
{
    auto const forges = [](std::string_view text) {
        return parse_simulation_config(core::concat(R"({"server":"h","forges":[)", text, "]}"),
                                       "/etc/c.json");
    };
    auto const server = forges(R"({"url":"https://git.lab.org/","kind":"forgejo"})").value().config.forges[0];
    BOOST_TEST(server.url == "https://git.lab.org");
    BOOST_TEST(server.directory.empty());
    BOOST_TEST((server.kind == ForgeKind::gitea));
    BOOST_TEST(
        (forges(R"({"url":"https://git.lab.org"})").value().config.forges[0].kind == ForgeKind::unknown));
    auto const mirror =
        forges(R"({"url":"https://git.lab.org","directory":"x","kind":"gitlab"})").value().config.forges[0];
    BOOST_TEST(mirror.directory == "/etc/x");
    BOOST_TEST((mirror.kind == ForgeKind::gitlab));
    BOOST_TEST(forges(R"({"url":"https://git.lab.org","kind":"git"})")
                   .error()
                   .message()
                   .ends_with("expected one of \"github\", \"gitlab\", \"gitea\", \"forgejo\", "
                              "\"bitbucket\", found the string \"git\""));
    BOOST_TEST(!forges(R"({"url":"local:","kind":"gitlab"})").has_value());
}

// Issue 20, items 4 and 5.
BOOST_AUTO_TEST_CASE(a_public_site_with_tls_is_told_how_to_choose_its_origins)
{
    auto const warnings = [](std::string_view keys) {
        auto const text =
            R"({"server":"sim.org","sslCertificate":"c","sslKey":"k")" + std::string(keys) + "}";
        auto const found = parse_simulation_config(text, "c.json").value().warnings;
        return std::count_if(found.begin(), found.end(), [](std::string const& each) {
            return each.find("allowedOrigins") != std::string::npos;
        });
    };
    BOOST_TEST(warnings("") == 1);
    BOOST_TEST(warnings(R"(,"allowedOrigins": ["https://sim.org", "https://webots.cloud"])") == 0,
               "the line itself");
    BOOST_TEST(warnings(R"(,"allowedOrigins":["*"])") == 0);
    for (auto const* quiet :
         {R"({"server":"sim.org"})", R"({"server":"pc7.local","sslCertificate":"c","sslKey":"k"})"})
        for (auto const& each : parse_simulation_config(quiet, "c.json").value().warnings)
            BOOST_TEST(each.find("allowedOrigins") == std::string::npos, each);
}

BOOST_AUTO_TEST_CASE(a_port_without_tls_leads_to_the_one_with_it)
{
    auto const parse = [](std::string_view keys) {
        return parse_session_config(R"({"port":443,"simulationServers":["a/1"])" + std::string(keys) + "}",
                                    "c.json");
    };
    std::string const tls = R"(,"sslCertificate":"c","sslKey":"k")";
    BOOST_TEST(parse(tls)->config.network.redirect_port == 0);
    BOOST_TEST(parse(tls + R"(,"redirectPort":80)")->config.network.redirect_port == 80);
    BOOST_TEST(parse(tls + R"(,"redirectPort":80,"challengeFolder":"/a")")->config.network.challenge_folder ==
               "/a");
    for (auto const& bad : {std::string(R"(,"redirectPort":80)"), tls + R"(,"redirectPort":443)",
                            tls + R"(,"redirectPort":65536)", tls + R"(,"challengeFolder":"/a")"})
        BOOST_TEST(!parse(bad), bad);
    BOOST_TEST(parse("")->config.network.listen_address == "::");
    BOOST_TEST(parse(R"(,"listenAddress":"127.0.0.1")")->config.network.listen_address == "127.0.0.1");
    BOOST_TEST(!parse(R"(,"listenAddress":"localhost")"));
}

BOOST_AUTO_TEST_CASE(both_servers_know_who_may_ask_them)
{
    auto const none =
        parse_session_config(R"({"port":1,"simulationServers":["a/1"]})", "c.json").value().config.access;
    BOOST_TEST((none == AccessConfig()));
    BOOST_TEST(!none.allowed_origins.has_value());
    std::string const keys =
        R"("hostNames":["lab7"],"allowedOrigins":["https://*.example.org","null"],"frameAncestors":[],)"
        R"("monitorPassword":"p","monitorAddresses":["10.0.0.0/8"],"operatorTokenFile":"/t","operatorSocket":"/s","sessionSecret":"/x")";
    auto const access = parse_simulation_config("{" + keys + "}", "c.json").value().config.access;
    BOOST_TEST(access.host_names == (std::vector<std::string>{"lab7"}));
    BOOST_TEST(*access.allowed_origins == (std::vector<std::string>{"https://*.example.org", "null"}));
    BOOST_TEST(access.frame_ancestors->empty());
    BOOST_TEST(access.monitor_password == "p");
    BOOST_TEST(access.monitor_addresses == (std::vector<std::string>{"10.0.0.0/8"}));
    BOOST_TEST(access.operator_token_file == "/t");
    BOOST_TEST(access.operator_socket == "/s");
    BOOST_TEST(access.session_secret == "/x");
    BOOST_TEST((parse_session_config(R"({"port":1,"simulationServers":["a/1"],)" + keys + "}", "c.json")
                    .value()
                    .config.access == access));
    BOOST_TEST(session_error(R"({"port":1,"simulationServers":["a/1"],"allowedOrigins":["example.org"]})") ==
               "c.json: key \"allowedOrigins\": expected a list of sites, as in \"https://example.org\", "
               "\"https://*.example.org\" or \"*\", found the list [\"example.org\"]");
}

BOOST_AUTO_TEST_CASE(a_name_of_the_machine_is_a_whole_one_as_browsers_say_it)
{
    auto const fault_of = [](std::string_view name) {
        return session_error(R"({"port":1,"simulationServers":["a/1"],"hostNames":["lab7",")" +
                             std::string(name) + R"("]})");
    };
    BOOST_TEST(fault_of("http://lab8/") ==
               "c.json: key \"hostNames\", entry 2: expected a name of this machine, as in "
               "\"lab7.example.org\", found the string \"http://lab8/\": write \"lab8\"");
    BOOST_TEST(fault_of("*.example.org") ==
               "c.json: key \"hostNames\", entry 2: expected a whole name of this machine: patterns are for "
               "\"allowedOrigins\", so write each name, found the string \"*.example.org\"");
    BOOST_TEST(
        fault_of("B\u00fccher.example").ends_with(": write \"xn--bcher-kva.example\", as browsers say it"));
    BOOST_TEST(parse_session_config(R"({"port":1,"simulationServers":["a/1"],"hostNames":["*"]})", "c.json")
                   .has_value());
    BOOST_TEST(
        session_error(R"({"port":1,"simulationServers":["a/1"],"server":"gr\u00fc\u00dfe.example:8443"})")
            .ends_with(": write \"xn--gre-6ka8l.example:8443\", as browsers say it"));
}

BOOST_AUTO_TEST_CASE(a_certificate_and_its_key_are_given_together)
{
    auto const both =
        parse_session_config(
            R"({"port":1,"simulationServers":["a/1"],"sslCertificate":"/c","sslKey":"/k","connectionsPerAddress":7})",
            "c.json")
            .value();
    BOOST_TEST(both.warnings.empty());
    BOOST_TEST(both.config.network.ssl_certificate == "/c");
    BOOST_TEST(both.config.network.ssl_key == "/k");
    BOOST_TEST(both.config.network.connections_per_address == 7);
    BOOST_TEST(parse_simulation_config("{}", "c.json")->config.network.connections_per_address == 1000);
    BOOST_TEST(session_error(R"({"port":1,"simulationServers":["a/1"],"sslKey":"/k"})") ==
               "c.json: key \"sslCertificate\" is missing: expected the file of the certificate that "
               "\"sslKey\" belongs to");
    BOOST_TEST(!parse_simulation_config(R"({"sslCertificate":"/c"})", "c.json"));
}

BOOST_AUTO_TEST_CASE(paths_are_expanded_as_python_does)
{
    ::setenv("WEBOTS_CLOUD_TEST_FOLDER", "/var/t", 1);
    ::setenv("HOME", "/home/me", 1);
    auto const log_dir = [](std::string_view value) {
        auto const text = "{\"logDir\":\"" + std::string(value) + "\"}";
        return parse_simulation_config(text, "c.json")->config.log_dir.string();
    };
    BOOST_TEST(log_dir("~/log") == "/home/me/log");
    BOOST_TEST(log_dir("$WEBOTS_CLOUD_TEST_FOLDER/log") == "/var/t/log");
    BOOST_TEST(log_dir("${WEBOTS_CLOUD_TEST_FOLDER}x") == "/var/tx");
    BOOST_TEST(log_dir("a$b~") == "a$b~");
}

BOOST_AUTO_TEST_CASE(the_guides_own_mail_keys_are_read)
{
    auto const config = parse_session_config(seed, "session.json")->config;
    BOOST_TEST(config.mail.administrator == "admin@cyberbotics.com");
    BOOST_TEST(config.mail.server == "mail.infomaniak.com");
    BOOST_TEST(config.mail.server_port == 587);
    BOOST_TEST(config.mail.sender == "support@cyberbotics.com");
    BOOST_TEST(config.mail.user == "support@cyberbotics.com");
    BOOST_TEST(config.mail.password == "********");
}

BOOST_AUTO_TEST_CASE(mail_keys_have_defaults_and_the_login_may_differ_from_the_sender)
{
    auto const none = parse_session_config(R"({"port":1,"simulationServers":["a/1"]})", "c.json").value();
    BOOST_TEST(none.config.mail.administrator.empty());
    BOOST_TEST(none.config.mail.server_port == 0);
    BOOST_TEST(none.config.mail.password.empty());
    auto const other = parse_session_config(
        R"({"port":1,"simulationServers":["a/1"],"mailSender":"a@b.org","mailSenderUser":"robot"})",
        "c.json");
    BOOST_TEST(other->config.mail.user == "robot");
}

BOOST_AUTO_TEST_CASE(an_administrator_without_a_mail_server_or_a_sender_is_dropped_with_a_warning)
{
    auto const no_server = parse_session_config(
        R"({"port":1,"simulationServers":["a/1"],"administrator":"a@b.org","mailSender":"c@d.org","mailServer":""})",
        "c.json");
    BOOST_TEST(no_server->config.mail.administrator.empty());
    BOOST_TEST(no_server->warnings ==
                   (std::vector<std::string>{
                       "c.json: key \"administrator\" is ignored: no e-mails without \"mailServer\""}),
               boost::test_tools::per_element());
    auto const no_sender = parse_session_config(
        R"({"port":1,"simulationServers":["a/1"],"administrator":"a@b.org","mailServer":"m"})", "c.json");
    BOOST_TEST(no_sender->config.mail.administrator.empty());
    BOOST_TEST(no_sender->warnings.front().find("\"mailSender\"") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(mail_keys_that_could_forge_a_mail_are_refused)
{
    auto const with = [](std::string const& key) {
        return R"({"port":1,"simulationServers":["a/1"],)" + key + "}";
    };
    BOOST_TEST(session_error(with(R"("administrator":"a@b.org\r\nBcc: c@d.org")"))
                   .find("expected an e-mail address") != std::string::npos);
    BOOST_TEST(session_error(with(R"("mailSender":"<a@b.org>")")) ==
               "c.json: key \"mailSender\": expected an e-mail address, found the string \"<a@b.org>\"");
    BOOST_TEST(session_error(with(R"("mailServer":"smtp://m")")) ==
               "c.json: key \"mailServer\": expected the name of a host, found the string \"smtp://m\"");
    BOOST_TEST(session_error(with(R"("mailServerPort":65536)")) ==
               "c.json: key \"mailServerPort\": expected an integer from 0 to 65535, found the number 65536");
    BOOST_TEST(session_error(with(R"("mailSenderUser":"a\r\nRCPT TO:<c@d.org>")")) ==
               "c.json: key \"mailSenderUser\": expected a string without control characters, "
               "found the string \"a\\r\\nRCPT TO:<c@d.org>\"");
}

BOOST_AUTO_TEST_CASE(a_mail_password_is_any_text_without_control_characters_and_no_message_shows_it)
{
    auto const with = [](std::string const& password) {
        return R"({"port":1,"simulationServers":["a/1"],"mailSenderPassword":)" + password + "}";
    };
    BOOST_TEST(parse_session_config(with(R"("p\u00e4ss \"w;rd'\\ %00")"), "c.json")->config.mail.password ==
               "p\xc3\xa4ss \"w;rd'\\ %00");
    for (auto const* bad :
         {R"("secret\n")", R"("secret\r\nQUIT")", R"("secret\u0000")", R"("secret\u009b")", "12345"})
        BOOST_TEST(session_error(with(bad)) ==
                   "c.json: key \"mailSenderPassword\": expected a string without control "
                   "characters, found something else");
}

BOOST_AUTO_TEST_CASE(the_password_of_teachers_stands_in_the_configuration_or_in_a_file)
{
    auto const with = [](std::string const& keys) {
        return R"({"port":1,"simulationServers":["a/1"],)" + keys + "}";
    };
    auto const password = parse_session_config(with(R"("teacherPassword":"open sesame")"), "c.json");
    BOOST_TEST(password->config.service.teacher_password == "open sesame");
    auto const file =
        parse_session_config(with(R"("teacherPasswordFile":"log/.teacher-password")"), "c.json");
    BOOST_TEST(file->config.service.teacher_password_file == "log/.teacher-password");
    BOOST_TEST(file->warnings.empty());
    BOOST_TEST(session_error(with(R"("teacherPassword":"open sesame","teacherPasswordFile":"f")")) ==
               "c.json: key \"teacherPasswordFile\": expected no such key beside \"teacherPassword\": one of "
               "the two, found the string \"f\"");
    for (auto const* bad : {R"("secret\n")", "12345"})
        BOOST_TEST(session_error(with(R"("teacherPassword":)" + std::string(bad))) ==
                   "c.json: key \"teacherPassword\": expected a string without control characters, "
                   "found something else");
}

BOOST_AUTO_TEST_CASE(no_message_shows_the_password_of_the_monitor)
{
    for (auto const* bad : {R"("secret\n")", "12345"})
        BOOST_TEST(session_error(R"({"port":1,"simulationServers":["a/1"],"monitorPassword":)" +
                                 std::string(bad) + "}") ==
                   "c.json: key \"monitorPassword\": expected a string without control characters, "
                   "found something else");
}

BOOST_AUTO_TEST_CASE(values_that_reach_requests_commands_and_file_names_have_no_control_characters)
{
    auto const refused = [](std::string const& key, std::string const& value) {
        auto const other = key == "sslCertificate" ? R"(,"sslKey":"k")" : "";
        auto const text = "{\"" + key + "\":" + value + other + "}";
        auto const parsed = parse_simulation_config(text, "c.json");
        BOOST_TEST_REQUIRE(!parsed, text);
        auto const sentence = sentence_of(parsed);
        BOOST_TEST(sentence.starts_with("c.json: key \"" + key + "\""), sentence);
        BOOST_TEST(sentence.find('\n') == std::string::npos, sentence);
        BOOST_TEST(core::is_printable(sentence), sentence);
    };
    for (auto const* key : {"server", "fullyQualifiedDomainName", "display", "dockerImages",
                            "multimediaServer", "multimediaStream", "webotsHome", "logDir", "dockerDir",
                            "keyDir", "projectsDir", "sslCertificate", "notify", "caFile"})
        for (auto const* value : {R"("https://a\r\nX: b")", R"("https://a\u001b[2J")", R"("https://a\u0000")",
                                  R"("https://a\u0085b")"})
            refused(key, value);
    for (auto const* key : {"allowedRepositories", "blockedRepositories", "forges", "notify",
                            "persistantDockerImages", "simulatorEnvironment"})
        refused(key, R"(["https://a\nb"])");
    auto const shown = parse_simulation_config(R"({"title":"A\tB","description":"Two\nlines"})", "c.json");
    BOOST_TEST(shown->config.service.description == "Two\nlines");
}

BOOST_AUTO_TEST_CASE(messages_show_no_raw_control_characters_whatever_the_file_is_called_and_says)
{
    std::string const origin = "a\x1b[2Jb\n.json";
    std::vector<std::string> sentences;
    for (auto const* text :
         {"{", "[1]", R"({"port":"\u001b[2J"})", R"({"\u001b]0;x\u0007":1,"port":1})",
          R"({"server":"\u009b"})",
          R"({"timeout":1,"maxConnections":9999,"port":65000,"blockedRepositories":["x"],"\u007f":0})"}) {
        auto const simulation = parse_simulation_config(text, origin);
        auto const session = parse_session_config(text, origin);
        auto const add_lines = [&sentences](Failure const& failure) {
            auto const lines = failure.message();
            for (auto const each : core::split(lines, '\n'))
                sentences.emplace_back(each);
        };
        if (!session)
            add_lines(session.error());
        if (simulation)
            sentences.insert(sentences.end(), simulation->warnings.begin(), simulation->warnings.end());
        else
            add_lines(simulation.error());
    }
    BOOST_TEST(sentences.size() > 12u);
    for (auto const& sentence : sentences)
        BOOST_TEST(core::is_printable(sentence), sentence);
}

BOOST_AUTO_TEST_CASE(a_failure_has_fifty_lines_at_most)
{
    std::string text = "{\"simulationServers\":[]";
    for (int i = 0; i < 1000; ++i)
        text += ",\"" + std::string(10'000, 'k') + std::to_string(i) + "\":0";
    auto const sentence = session_error(text + "}");
    BOOST_TEST(sentence.size() < 6'000u);
    BOOST_TEST(core::split(sentence, '\n').size() == 51u);
    BOOST_TEST(sentence.ends_with("\nc.json: and 951 more"), sentence);
}

BOOST_AUTO_TEST_CASE(the_world_reaches_a_server_where_its_configuration_says)
{
    PublicAddress address;
    address.host = "host.org";
    address.port = 1234;
    address.ssl = false;
    address.port_rewrite = false;
    auto const* const keys = R"("server":"host.org","port":1234,"ssl":false,"portRewrite":false)";
    auto const session =
        parse_session_config(core::concat("{\"simulationServers\":[\"a:1\"],", keys, "}"), "c.json");
    BOOST_TEST((session->config.address == address));
    BOOST_TEST((parse_simulation_config(core::concat("{", keys, "}"), "c.json")->config.address == address));
    address = PublicAddress();
    BOOST_TEST((SessionConfig().address == address)); // its port is required
    address.port = 2000;
    BOOST_TEST((SimulationConfig().address == address));
}

BOOST_AUTO_TEST_SUITE_END()
