#include "core/config/config_rules.hpp"
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

/// With these keys besides the ones that it can't do without.
result<Configured<SessionConfig>> session(std::string_view keys)
{
    return parse_session_config(
        core::concat(R"({"port":443,"simulationServers":["a/1"])", keys.empty() ? "" : ",", keys, "}"),
        "c.json");
}

/// With these entries of `simulationServers`.
result<Configured<SessionConfig>> machines(std::string_view entries, std::string_view keys = "")
{
    return parse_session_config(core::concat(R"({"port":443,"simulationServers":[)", entries, "]",
                                             keys.empty() ? "" : ",", keys, "}"),
                                "c.json");
}

/// With these keys besides the one without which it warns.
result<Configured<SimulationConfig>> simulation(std::string_view keys)
{
    return parse_simulation_config(core::concat(R"({"server":"h")", keys.empty() ? "" : ",", keys, "}"),
                                   "c.json");
}

/// What is written, and the fault that is told, without the words before the name of the key; empty: none.
struct Fault
{
    std::string_view text;
    std::string_view sentence;
};

template<class Parse>
void check_faults(Parse parse, std::vector<Fault> const& faults)
{
    for (auto const& [text, sentence] : faults) {
        auto const expected = sentence.empty() ? std::string() : core::concat("c.json: key ", sentence);
        BOOST_TEST(sentence_of(parse(text)) == expected, text);
    }
}

template<class Parse>
void check_refused(Parse parse, std::vector<std::string_view> const& texts)
{
    for (auto const text : texts) {
        auto const parsed = parse(text);
        BOOST_TEST_REQUIRE(!parsed, text << " should be refused");
        BOOST_TEST((parsed.error() == errc::invalid_config), text);
    }
}

std::string session_error(std::string_view text)
{
    auto const parsed = parse_session_config(text, "c.json");
    BOOST_TEST_REQUIRE(!parsed, text);
    BOOST_TEST((parsed.error() == errc::invalid_config));
    return sentence_of(parsed);
}

using Sentences = std::vector<std::string>;

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
    auto const parsed = machines(
        R"("a:1",{"address":"b:2","weight":2.5,"labels":["gpu","R2025a"]},{"address":"c/3","drain":true,"trusted":true})");
    auto const& servers = parsed->config.simulation_servers;
    BOOST_TEST_REQUIRE(servers.size() == 3u);
    BOOST_TEST(servers[1].weight == 2.5);
    BOOST_TEST(servers[2].address == "c/3");
    BOOST_TEST(servers[2].drain);
    BOOST_TEST(servers[2].trusted);
    BOOST_TEST(!servers[1].trusted);
    BOOST_TEST((servers[1].labels == Sentences{"gpu", "R2025a"}));
    auto const parse = [](std::string_view entry) { return machines(entry); };
    check_refused(parse,
                  {R"({"address":"b:2","trusted":1})", R"({"address":"b:2","labels":["two words"]})", "{}"});
}

BOOST_AUTO_TEST_CASE(a_wrong_simulation_server_is_named_with_its_wrong_key)
{
    auto const parse = [](std::string_view entry) { return machines(core::concat("\"a:1\",", entry)); };
    std::string const where = "\"simulationServers\", entry 2: ";
    std::string const address = "\"host:port\", \"host/port\" or \"host/path\", with a port from 1 to 65535, "
                                "\"dns:name:port\", \"srv:service name\" or \"announced\"";
    std::string const weight = where + "key \"weight\": expected a number from 0.001 to 1000000, found ";
    check_faults(
        parse,
        {{R"({"address":"a:2","weight":0})", weight + "the number 0"},
         {R"({"address":"a:2","weight":"2"})", weight + "the string \"2\": write 2, without quotes"},
         {R"({"address":"a:2","drain":"yes"})",
          where +
              "key \"drain\": expected true or false, found the string \"yes\": write true, without quotes"},
         {R"({"address":"a"})", where + "key \"address\": expected " + address +
                                    ", found the string \"a\": write \"a:2000\", if that is its port"},
         {R"({"adress":"a:2"})", where + "key \"address\" is missing: expected " + address +
                                     "\nc.json: key \"simulationServers\", entry 2: "
                                     "unknown key \"adress\" is ignored; did you mean \"address\"?"},
         {"5", where + "expected " + address +
                   ", or {\"address\": ..., \"weight\": 2, \"drain\": true}, found the number 5"},
         {"\"host\"", where + "expected " + address +
                          ", found the string \"host\": write \"host:2000\", if that is its port"}});
}

BOOST_AUTO_TEST_CASE(worlds_of_the_gallery_are_addresses_or_objects)
{
    auto const config = parse_session_config(
        R"({"port":1,"simulationServers":["a/1"],"worlds":["local:/school/week_1",
            {"url":"https://github.com/o/r/blob/main/worlds/a.wbt","title":"A","text":"About it.","group":"G"}]})",
        "c.json");
    BOOST_TEST_REQUIRE(config.has_value());
    BOOST_TEST(config->warnings.empty());
    auto const& worlds = config->config.service.worlds.value();
    BOOST_TEST_REQUIRE(worlds.size() == 2u);
    BOOST_TEST((worlds[0] == ListedWorld("local:/school/week_1")));
    BOOST_TEST(worlds[1].url == "https://github.com/o/r/blob/main/worlds/a.wbt");
    BOOST_TEST(worlds[1].title == "A");
    BOOST_TEST(worlds[1].text == "About it.");
    BOOST_TEST(worlds[1].group == "G");
    auto const others = [](std::string_view list) {
        return parse_session_config(R"({"port":1,"simulationServers":["a/1"])" + std::string(list) + "}",
                                    "c.json")
            ->config.service.worlds;
    };
    BOOST_TEST(!others("").has_value());
    BOOST_TEST(others(R"(,"worlds":[])").value().empty());
}

BOOST_AUTO_TEST_CASE(a_wrong_world_of_the_gallery_is_named_with_its_wrong_key)
{
    auto const error = [](std::string_view list) {
        return session_error(R"({"port":1,"simulationServers":["a:1"],"worlds":)" + std::string(list) + "}");
    };
    std::string const address =
        "the address of a world or of a folder of worlds, as in \"local:/school/week_1\"";
    std::string const where = "c.json: key \"worlds\", entry 1: ";
    BOOST_TEST(error(R"(["worlds/a.wbt"])") ==
               where + "expected " + address + ", found the string \"worlds/a.wbt\"");
    BOOST_TEST(error(R"([{"title":"A"}])") == where + "key \"url\" is missing: expected " + address);
    BOOST_TEST(error(R"([{"url":"local:/school","title":"A"}])") ==
               where +
                   "key \"title\": expected no such key beside a folder, whose worlds say that themselves; "
                   "\"group\" is its heading, found the string \"A\"");
    BOOST_TEST(error("[1]") ==
               where + "expected " + address + ", or {\"url\": ..., \"title\": ...}, found the number 1");
    BOOST_TEST(
        error("\"local:/school\"").starts_with("c.json: key \"worlds\": expected a list of at most 200 "));
}

BOOST_AUTO_TEST_CASE(machines_may_be_found_by_name_or_announce_themselves)
{
    auto const parsed = machines(
        R"("dns:sim.test:2000",{"address":"srv:_w._tcp.test","weight":2})",
        R"("ssl":false,"nameServers":["10.0.0.53","127.0.0.1:8600","::1","[::1]:53"],"discoverLoopback":true)");
    BOOST_TEST_REQUIRE(parsed.has_value());
    BOOST_TEST(parsed->warnings.empty());
    BOOST_TEST(parsed->config.simulation_servers[0].address == "dns:sim.test:2000");
    BOOST_TEST(parsed->config.simulation_servers[1].weight == 2);
    BOOST_TEST(parsed->config.name_servers.size() == 4);
    BOOST_TEST(parsed->config.discover_loopback);
    BOOST_TEST(!parsed->config.announcements);
    BOOST_TEST(!parsed->config.service.gateway);
    auto const parse = [](std::string_view entry) { return machines(entry); };
    check_refused(parse,
                  {R"("dns:sim.test")", R"("srv:a b")", R"({"address":"dns:a:1","internal":"10.0.0.2:1"})",
                   R"({"address":"srv:a","ports":"1-2"})"});
    check_refused(session, {R"("nameServers":["ns.test"])", R"("nameServers":["https://10.0.0.1:1"])"});
    check_faults(session, {{R"("announcements":true)",
                            "\"sessionSecret\" is missing: expected the file of a word that machines know, "
                            "since they may announce themselves (\"announcements\")"}});
    auto const announced =
        parse_session_config(R"({"port":1,"announcements":true,"sessionSecret":"s"})", "c.json");
    BOOST_TEST_REQUIRE(announced.has_value());
    BOOST_TEST(announced->config.announcements);
}

BOOST_AUTO_TEST_CASE(machines_that_are_found_may_be_reached_through_the_gateway_alone)
{
    auto const listening = [](std::string_view entry) {
        return machines(entry, R"("ssl":true,"announcements":true,"sessionSecret":"s")");
    };
    for (auto const* const entry :
         {R"({"address":"dns:sim:2000","internal":"http"})",
          R"({"address":"dns:sim:2000","internal":"https"})",
          R"({"address":"dns:sim:2000","internal":"https://machines.test"})",
          R"({"address":"srv:_w._tcp.test","internal":"https"})",
          R"({"address":"announced","internal":"http"})",
          R"({"address":"announced","internal":"https","weight":2,"labels":["gpu"]})"}) {
        auto const parsed = listening(entry);
        BOOST_TEST_REQUIRE(parsed.has_value(), entry);
        BOOST_TEST(parsed->config.service.gateway);
    }
    BOOST_TEST(!listening(R"({"address":"announced","labels":["gpu"]})")->config.service.gateway);
    check_refused(listening, {R"({"address":"dns:sim:2000","internal":"ftp"})",
                              R"({"address":"dns:sim:2000","internal":"https://"})",
                              R"({"address":"dns:sim:2000","internal":"https://a:1"})",
                              R"({"address":"srv:_w._tcp.test","internal":"http"})",
                              R"({"address":"srv:_w._tcp.test","internal":"https://a.test"})",
                              R"({"address":"announced","internal":"https://a.test"})",
                              R"({"address":"announced","ports":"1-2"})"});
    BOOST_TEST(sentence_of(machines(R"("announced")")).find("no such entry without \"announcements\"") !=
               std::string::npos);
    BOOST_TEST(sentence_of(machines(R"({"address":"dns:sim:2000","internal":"http"})", R"("gateway":false)"))
                   .find("browsers would not reach these machines") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_simulation_server_announces_itself_with_a_secret_alone)
{
    auto const parsed = simulation(R"("sessionServers":["https://s.test/1999/"],"sessionSecret":"s")");
    BOOST_TEST_REQUIRE(parsed.has_value());
    BOOST_TEST(parsed->config.session_servers.front() == "https://s.test/1999");
    check_refused(simulation, {R"("sessionServers":["https://s.test"])",
                               R"("sessionServers":["s.test"],"sessionSecret":"s")"});
}

BOOST_AUTO_TEST_CASE(machines_behind_the_gateway_have_an_internal_address)
{
    auto const mapped =
        machines(R"({"address":"s.org/2000","internal":"10.0.0.2:2000","ports":"2001-2100"})").value();
    BOOST_TEST(mapped.warnings.empty());
    BOOST_TEST(mapped.config.service.gateway);
    auto const& server = mapped.config.simulation_servers[0];
    BOOST_TEST(server.internal_address == "10.0.0.2:2000");
    BOOST_TEST(server.first_port == 2001);
    BOOST_TEST(server.last_port == 2100);

    BOOST_TEST(!machines(R"("s.org/2000")")->config.service.gateway, "as ever");
    BOOST_TEST(machines(R"("s.org/2000")")->config.simulation_servers[0].internal_address == "");
    auto const local =
        machines(R"("s.org/2000","s.org:3000")", R"("gateway":true,"ssl":true)").value().config;
    BOOST_TEST(local.simulation_servers[0].internal_address == "127.0.0.1:2000");
    BOOST_TEST(local.simulation_servers[1].internal_address == "", "its port is open to the world");
    auto const off =
        machines(R"({"address":"s.org/2000","internal":"10.0.0.2:2000"})", R"("gateway":false)")->config;
    BOOST_TEST(!off.service.gateway);
    BOOST_TEST(off.simulation_servers[0].internal_address == "10.0.0.2:2000", "it is polled there");

    BOOST_TEST(
        machines(R"({"address":"s.org/3000","internal":"10.0.0.2:2000"})")->warnings ==
        Sentences{"c.json: key \"simulationServers\": s.org/3000 is at 10.0.0.2:2000, but a simulation "
                  "server sends browsers to its own \"port\": set that to 3000 there, in \"internal\" "
                  "too"});
}

// Between the machines of a site, TLS.
BOOST_AUTO_TEST_CASE(machines_behind_the_gateway_may_speak_tls)
{
    auto const parsed = machines(R"({"address":"s.org/2000","internal":"https://sim2.s.org:2000"})",
                                 R"("caFile":"tls/campus.pem")");
    BOOST_TEST(parsed->warnings.empty());
    BOOST_TEST(parsed->config.service.gateway);
    BOOST_TEST(parsed->config.simulation_servers[0].internal_address == "https://sim2.s.org:2000");
    BOOST_TEST(parsed->config.http_client.authorities == "tls/campus.pem");
    BOOST_TEST(session("")->config.http_client.authorities.empty());
    auto const other = machines(R"({"address":"s.org/3000","internal":"wss://sim2:2000"})");
    BOOST_TEST_REQUIRE(other->warnings.size() == 1u);
    BOOST_TEST(other->warnings[0].find("set that to 3000 there") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(what_the_gateway_could_not_tell_apart_is_refused)
{
    auto const internal = [](std::string_view rest) {
        return machines(core::concat(R"({"address":"a/2000","internal":)", rest, "}"));
    };
    std::string const where = "\"simulationServers\", entry ";
    check_faults(
        internal,
        {{R"("sim2:2000")",
          where + "1: key \"internal\": expected a numeric address and a port, as in \"10.0.0.2:2000\", "
                  "or for TLS \"https://sim2.example.org:2000\", found the string \"sim2:2000\""},
         {R"("https://sim2:2000","ports":"2001-2100")",
          where + "1: key \"ports\": expected none with https, which simulators do not speak: the simulation "
                  "server's own \"gateway\" passes on to them, found the string \"2001-2100\""},
         {R"("10.0.0.2:2000","ports":"9-1")",
          where + "1: key \"ports\": expected a port or a range of ports, as in \"2001-2100\", "
                  "found the string \"9-1\""}});
    auto const gateway = [](std::string_view entries) { return machines(entries, R"("gateway":true)"); };
    std::string const other = where + "2: expected another port than ";
    std::string const known =
        ", which entry 1 has as well: the gateway knows machines by their ports, found the "
        "string ";
    check_faults(gateway, {{R"("a/2000","b/2000")", other + "2000" + known + "\"b/2000\""},
                           {R"({"address":"a/2000","internal":"10.0.0.2:2000","ports":"2001-3100"},"a/3000")",
                            other + "3000" + known + "\"a/3000\""}});
    BOOST_TEST(machines(R"("a/2000","b/2000")").has_value());
}

BOOST_AUTO_TEST_CASE(an_address_of_a_simulation_server_is_a_host_and_a_port)
{
    auto const parse = [](std::string_view address) { return machines(core::concat("\"", address, "\"")); };
    for (auto const* good :
         {"a:1", "a.example.org/65535", "127.0.0.1:24000", "[::1]:24000", "proxy:8443/2000",
          "sub.example/webots_simulation_server", "sub.example:8443/webots", "a/b/2000"})
        BOOST_TEST(parse(good).has_value(), good);
    check_refused(parse, {"http://localhost:24000",
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
                          "a b:1",
                          "localhost:02000",
                          "localhost/02000"});
}

BOOST_AUTO_TEST_CASE(a_missing_key_is_told_with_the_unknown_ones)
{
    BOOST_TEST(session_error(R"({"prot":1999,"simulationServers":["a/1"]})") ==
               "c.json: key \"port\" is missing: expected an integer from 1 to 65535\n"
               "c.json: unknown key \"prot\" is ignored; did you mean \"port\"?");
    BOOST_TEST(session_error(R"({"port":1})") ==
               "c.json: key \"simulationServers\" is missing: expected a list of \"host:port\" or "
               "\"host/port\", or of objects {\"address\": ..., \"weight\": 2, \"drain\": true}");
    BOOST_TEST(session_error("[1]") == "c.json: expected a JSON object { ... }, found the list [1]");
}

BOOST_AUTO_TEST_CASE(unknown_keys_of_machines_and_forges_are_named)
{
    BOOST_TEST(
        warnings_of(machines(R"("a/1",{"address":"b/1","wieght":2})")) ==
        Sentences{"c.json: key \"simulationServers\", entry 2: unknown key \"wieght\" is ignored; did you "
                  "mean \"weight\"?"});
    BOOST_TEST(warnings_of(simulation(R"("forges":[{"url":"local:","directory":"x","owner":"me"}])")) ==
               Sentences{"c.json: key \"forges\", entry 1: unknown key \"owner\" is ignored"});
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

BOOST_AUTO_TEST_CASE(session_defaults_of_our_own)
{
    auto const config = session("")->config;
    BOOST_TEST(config.placement.policy == "least_committed");
    BOOST_TEST((config.placement.placement_timeout == std::chrono::seconds(60)));
    BOOST_TEST(!config.service.decisions_for_all);
    BOOST_TEST(config.service.teacher_password.empty());
    BOOST_TEST(config.service.teacher_password_file.empty());
    BOOST_TEST(config.service.viewer_url.empty());
    BOOST_TEST((config.service.pause_hidden == Duration::zero()));
    BOOST_TEST(config.service.session_burst == 200);
    BOOST_TEST(config.service.session_rate == 10);
    BOOST_TEST(!config.service.relay);
    BOOST_TEST(config.service.waiting_room == 1000);
    BOOST_TEST(config.mail.server_port == 0);
    BOOST_TEST(config.mail.password.empty());
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
    BOOST_TEST(config.websites.projects.empty());
    BOOST_TEST(config.websites.keys == "key");
    BOOST_TEST(config.http_client.authorities.empty());
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
    BOOST_TEST(config.git.cache_bytes == std::uint64_t{10} << 30);
    BOOST_TEST(config.containers.directory == "/etc/docker");
    BOOST_TEST(config.containers.images == "cyberbotics/webots.cloud");
    BOOST_TEST(!config.containers.project_dockerfiles);
    BOOST_TEST(!config.json_log);
    BOOST_TEST(config.launching.gateway);
    BOOST_TEST(config.service.traffic_limit == 0u);
}

// Section 4.3: simulations have the ports after the server's, and the editor of one is 500 above it.
BOOST_AUTO_TEST_CASE(what_leaves_no_ports_for_simulations_or_editors_is_refused)
{
    std::string_view const of_editors =
        "\"port\": expected an integer from 1 to 65034, found the number 65035";
    check_faults(
        simulation,
        {{R"("port":65535)", "\"port\": expected an integer from 1 to 65534, found the number 65535"},
         {R"("port":65534)", ""},
         {R"("docker":true,"maxConnections":500)",
          "\"maxConnections\": expected at most 499 with \"docker\", since the port of an editor is 500 "
          "above that of its simulation, found the number 500"},
         {R"("docker":true,"maxConnections":499)", ""},
         {R"("maxConnections":500)", ""},
         {R"("docker":true,"port":65034)", ""},
         {R"("docker":true,"port":65035)", of_editors},
         {R"("sandbox":"docker","port":65035)", of_editors}});
}

// A program that embeds a server fills in members, which no reader has seen.
BOOST_AUTO_TEST_CASE(choices_of_a_program_are_those_of_a_file)
{
    SimulationConfig config;
    BOOST_TEST(core::complete_choices(config).has_value());
    BOOST_TEST(!config.docker);
    config.sandbox = "docker";
    BOOST_TEST(core::complete_choices(config).has_value());
    BOOST_TEST(config.docker);
    config = SimulationConfig();
    config.network_reach = "nothing";
    auto const refused = core::complete_choices(config);
    BOOST_TEST((refused.error() == errc::invalid_config));
    BOOST_TEST(refused.error().message() ==
               "key \"network\": expected one of \"internet\", \"none\", \"host\", found \"nothing\"");
    config = SimulationConfig();
    config.sandbox.clear();
    BOOST_TEST(core::complete_choices(config).error().message().find("key \"sandbox\"") == 0u);
}

BOOST_AUTO_TEST_CASE(what_jobs_of_slurm_can_not_be_is_refused)
{
    auto const slurm = [](std::string_view job) {
        return simulation(core::concat(R"("launcher":{"slurm":)", job, "}"));
    };
    std::string const where = "\"launcher\": key \"slurm\": ";
    check_faults(
        slurm, {{"{}", ""},
                {"true", where + "expected an object, as in {\"partition\": \"simulations\"}, found true"},
                {R"({"processors":0})",
                 where + "key \"processors\": expected an integer from 1 to 10000, found the number 0"},
                {R"({"partition":"a b"})",
                 where + "key \"partition\": expected a name without spaces and |, found the string \"a b\""},
                {R"({"overrides":[{"mode":"4d"}]})",
                 where + "key \"overrides\", entry 1: key \"mode\": expected "
                         "\"x3d\", \"w3d\" or \"mjpeg\", found the string \"4d\""},
                {R"({"copyTo":"tmp"})",
                 where + "key \"copyTo\": expected an absolute path, which is one of the nodes, "
                         "found the string \"tmp\""},
                {R"({"overrides":["x"]})",
                 where + "key \"overrides\", entry 1: expected an object, found the string \"x\""}});
    check_faults(
        simulation,
        {{R"("launcher":{})", ""},
         {R"("launcher":"slurm")",
          "\"launcher\": expected an object, as in {\"slurm\": {}}, found the string \"slurm\""},
         {R"("launcher":{"slurm":{}},"docker":true)",
          "\"launcher\": expected no \"slurm\" together with \"docker\", found the object {\"slurm\":{}}"},
         {R"("launcher":{"slurm":{}},"gateway":false)",
          "\"launcher\": expected no \"slurm\" where \"gateway\" is false: browsers don't reach nodes, found "
          "the "
          "object {\"slurm\":{}}"},
         {R"("launcher":{"slurm":{}},"simulationUser":"w")",
          "\"simulationUser\": expected \"auto\" or \"none\", since jobs of Slurm are this server's user's, "
          "found "
          "the string \"w\""}});
}

BOOST_AUTO_TEST_CASE(the_two_keys_that_choose_docker_must_not_contradict_each_other)
{
    check_faults(
        simulation,
        {{R"("docker":true,"sandbox":"auto")", ""},
         {R"("docker":true,"sandbox":"docker")", ""},
         {R"("docker":true,"sandbox":"bubblewrap")",
          "\"sandbox\": expected \"docker\" or \"auto\", since \"docker\" is true, found the string "
          "\"bubblewrap\""},
         {R"("docker":false,"sandbox":"docker")",
          "\"sandbox\": expected another one than \"docker\", since \"docker\" is false, found the string "
          "\"docker\""},
         {R"("docker":false,"sandbox":"firejail")", ""}});
}

BOOST_AUTO_TEST_CASE(no_more_simulations_are_taken_than_there_are_ports)
{
    auto const five = simulation(R"("port":65530)");
    BOOST_TEST(five->config.launching.max_simulations == 5);
    BOOST_TEST(
        five->warnings ==
        Sentences{"c.json: key \"maxConnections\": only 5 simulations at once instead of 100, since there "
                  "are no more ports above \"port\" (65530)"});
    BOOST_TEST(simulation(R"("port":65030,"docker":true)")->config.launching.max_simulations == 5);
    auto const enough = simulation(R"("port":65530,"maxConnections":5)");
    BOOST_TEST(enough->config.launching.max_simulations == 5);
    BOOST_TEST(enough->warnings.empty());
}

BOOST_AUTO_TEST_CASE(a_limit_of_traffic_that_nothing_keeps_is_warned_of)
{
    BOOST_TEST(simulation(R"("gateway":false,"trafficLimit":1)")->warnings ==
               Sentences{"c.json: key \"trafficLimit\" has no effect, since \"gateway\" is false"});
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
        return parse_session_config(
            R"({"port":1999,"server":"h","ssl":false,"portRewrite":false,"simulationServers":[{"address":)" +
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
        return simulation(core::concat(R"("sslCertificate":"/c","sslKey":"/k",)", keys))->warnings;
    };
    BOOST_TEST(
        warnings(R"("portRewrite":false,"gateway":false)") ==
        Sentences{"c.json: browsers are sent to wss://h:<port of the simulation>, but simulators speak no "
                  "TLS, whatever \"sslCertificate\" says: no simulation can be shown. Set \"gateway\" to "
                  "true, or let a proxy end TLS, as in config/nginx, and set \"portRewrite\" to true"});
    for (auto const* quiet : {R"("portRewrite":false)", R"("portRewrite":true,"gateway":false)",
                              R"("portRewrite":false,"ssl":false,"gateway":false)"})
        BOOST_TEST(warnings(quiet).empty(), quiet);
}

// Protocol section 8.1: until 2021 there was no `ssl`, and the Python servers of today ask such machines by
// https too.
BOOST_AUTO_TEST_CASE(who_has_no_ssl_key_is_told_that_machines_are_asked_by_https)
{
    BOOST_TEST(
        machines(R"("a/1","b:2000")")->warnings ==
        Sentences{"c.json: key \"ssl\" is missing and counts as true: simulation servers are asked by https "
                  "(https://b:2000/load) and browsers sent to wss://. Configurations of 2018 to 2021 have no "
                  "such key, and their machines speak plain http: then set it to false; else to true"});
    BOOST_TEST(machines(R"("a/1","b/2")")->warnings.empty()); // behind a proxy, as in all versions
    BOOST_TEST(machines(R"("a:1")", R"("ssl":true)")->warnings.empty());
    BOOST_TEST(machines(R"("a:1")", R"("ssl":false)")->warnings.empty());
}

BOOST_AUTO_TEST_CASE(who_has_no_ssl_key_and_no_proxy_is_told_where_browsers_are_sent)
{
    std::string const missing =
        "c.json: key \"ssl\" is missing and counts as true: browsers are sent to wss://h:";
    std::string const since =
        "speak plain http. Configurations of 2018 to 2021 have no such key: set it to false, "
        "or to true if a proxy ends TLS on ";
    BOOST_TEST(simulation(R"("portRewrite":false)")->warnings ==
               Sentences{missing + "2000, where this server speaks" + since.substr(5) + "that port"});
    BOOST_TEST(simulation(R"("portRewrite":false,"gateway":false)")->warnings ==
               Sentences{missing + "<port of the simulation>, where simulators " + since + "those ports"});
    for (auto const* quiet : {"", R"("portRewrite":false,"ssl":true)", R"("portRewrite":false,"ssl":false)"})
        BOOST_TEST(simulation(quiet)->warnings.empty(), quiet);
}

BOOST_AUTO_TEST_CASE(browsers_may_be_silent_for_a_minute_or_as_long_as_the_operator_says)
{
    auto const network = [](std::string_view keys) { return simulation(keys)->config.network; };
    BOOST_TEST((network("").ping_timeout == std::chrono::seconds(60)));
    BOOST_TEST((network(R"("pingTimeout":900)").ping_timeout == std::chrono::seconds(900)));
    BOOST_TEST((network(R"("pingTimeout":0)").ping_timeout == Duration::zero()));
    BOOST_TEST((network("").ping_interval == std::chrono::seconds(20)));
    BOOST_TEST((network(R"("pingInterval":8)").ping_interval == std::chrono::seconds(8)));
    BOOST_TEST((session(R"("pingTimeout":2)")->config.network.ping_timeout == std::chrono::seconds(2)));
    BOOST_TEST(
        sentence_of(simulation(R"("pingTimeout":1.9)"))
            .starts_with(
                "c.json: key \"pingTimeout\": expected 0, or a number from 2 to 10000000 (seconds), found "));
}

BOOST_AUTO_TEST_CASE(the_simulators_environment_is_a_list_of_names_patterns_and_values)
{
    auto const parse = [](std::string_view list) {
        return simulation(core::concat(R"("simulatorEnvironment":)", list));
    };
    BOOST_TEST(parse(R"(["LAB_HOST","VGL_*","MODE=a b"])")->config.launching.simulator_environment ==
                   (Sentences{"LAB_HOST", "VGL_*", "MODE=a b"}),
               boost::test_tools::per_element());
    BOOST_TEST(parse("[]")->warnings.empty());
    std::string const where = "\"simulatorEnvironment\", entry 2: expected ";
    check_faults(
        parse,
        {{R"(["A","API KEY=hunter2"])",
          where + "the name of a variable, the beginning of one as in \"ROS_*\", or "
                  "\"NAME=value\", found the string \"API KEY=...\""},
         {R"(["A","NOTIFY_SOCKET"])",
          where + "no variable that systemd gives to this server alone, found the string \"NOTIFY_SOCKET\""},
         {R"(["A","DISPLAY=:1"])",
          where + "no value for DISPLAY: the key \"display\" sets it, found the string \"DISPLAY=...\""},
         {R"(["A","WEBOTS=x"])", ""},
         {R"(["A","WEBOTS=x"],"docker":true)", where +
                                                   "no variable that the server sets for compose itself (see "
                                                   "docs/docker.md), found the string \"WEBOTS=...\""}});
    std::string many = "[\"A=\"";
    for (int i = 0; i < 5; ++i)
        many += ",\"A=" + std::string(30'000, 'x') + "\"";
    BOOST_TEST(
        sentence_of(parse(many + "]"))
            .starts_with("c.json: key \"simulatorEnvironment\": expected at most 131072 characters in all"));
    check_refused(parse, {R"(["A\nB=1"])", R"(["A=\u0000"])", R"([""])"});
}

BOOST_AUTO_TEST_CASE(repositories_that_are_on_no_forge_are_warned_of)
{
    auto const warnings = [](std::string_view keys) { return simulation(keys)->warnings; };
    BOOST_TEST(
        warnings(R"("allowedRepositories":["cyberbotics"])") ==
        Sentences{"c.json: key \"allowedRepositories\": \"cyberbotics\" has no effect: it is on none of the "
                  "\"forges\", for instance https://github.com/<owner>"});
    BOOST_TEST(warnings(R"("blockedRepositories":["https://gitlab.com/a"])").size() == 1u);
    for (auto const* quiet :
         {R"("allowedRepositories":["https://github.com","https://GitHub.com/a/b/","https://"])",
          R"("forges":[{"url":"local:","directory":"x"}],"allowedRepositories":["local:/a"])"})
        BOOST_TEST(warnings(quiet).empty(), quiet);
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

namespace {

/// A key that is written and arrives, without a warning.
template<class Config>
struct Arrival
{
    char const* text;
    bool (*arrived)(Config const& config);
};

template<class Config, class Parse>
void check_arrivals(Parse parse, std::initializer_list<Arrival<Config>> rows)
{
    for (auto const& [text, arrived] : rows) {
        auto const configured = parse(text);
        BOOST_TEST_REQUIRE(configured.has_value(), text);
        BOOST_TEST(configured->warnings.empty(), text);
        BOOST_TEST(arrived(configured->config), text);
    }
}

} // namespace

// What the rows of the table of keys alone don't say, a row each; `config_reload_test` tries every key.
BOOST_AUTO_TEST_CASE(shapes_and_units_of_keys_of_the_session_server_are_understood)
{
    check_arrivals<SessionConfig>(
        session,
        {{R"("loadRefresh":0.5)",
          [](auto const& c) { return c.polls.interval == std::chrono::milliseconds(500); }},
         {R"("loadTimeout":2)", [](auto const& c) { return c.polls.timeout == std::chrono::seconds(2); }},
         {R"("scheduling":"random")", [](auto const& c) { return c.placement.policy == "random"; }},
         {R"("placementTimeout":0)",
          [](auto const& c) { return c.placement.placement_timeout == Duration::zero(); }},
         {R"("pauseHidden":60)",
          [](auto const& c) { return c.service.pause_hidden == std::chrono::seconds(60); }},
         {R"("sessionRate":0.5)", [](auto const& c) { return c.service.session_rate == 0.5; }},
         {R"("sessionBurst":0)", [](auto const& c) { return c.service.session_burst == 0; }},
         {R"("waitingRoom":0)", [](auto const& c) { return c.service.waiting_room == 0; }},
         {R"("logFormat":"json")", [](auto const& c) { return c.json_log; }},
         {R"("logFormat":"text")", [](auto const& c) { return !c.json_log; }},
         {R"("mailSender":"a@b.org","mailSenderUser":"robot")",
          [](auto const& c) { return c.mail.user == "robot"; }}});
    check_faults(session,
                 {{R"("sessionRate":0.001)", "\"sessionRate\": expected 0, or a number from 0.01 to "
                                             "100000 (requests per second), found the number 0.001"}});
}

BOOST_AUTO_TEST_CASE(shapes_units_and_other_names_of_keys_of_the_simulation_server_are_understood)
{
    using Texts = std::vector<std::string>;
    check_arrivals<SimulationConfig>(
        simulation,
        {
            {R"("fullyQualifiedDomainName":"x")",
             [](auto const& c) { return c.address.host == "h"; }}, // Q31: the older name
            {R"("docker":true)", [](auto const& c) { return c.docker; }},
            {R"("launcher":{"slurm":{"partition":"p","account":"a","qos":"q","memory":512,"processors":4,)"
             R"("gres":"gpu:1","timeLimit":3600}})",
             [](auto const& c) {
                 auto const& job = c.slurm->job;
                 return job.partition == "p" && job.account == "a" && job.qos == "q" &&
                        job.memory == std::uint64_t{512} << 20 && job.processors == 4 &&
                        job.gres == "gpu:1" && job.time_limit == std::chrono::hours(1);
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
            {R"("timeout":400)",
             [](auto const& c) { return c.launching.timeout == std::chrono::seconds(400); }},
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
            {R"("fetchMemory":256)",
             [](auto const& c) { return c.fetch_memory == std::uint64_t{256} << 20; }},
            {R"("fetchDisk":0.5)", [](auto const& c) { return c.fetch_disk == std::uint64_t{512} << 20; }},
            {R"("simulationMemory":512)",
             [](auto const& c) { return c.limits.memory == std::uint64_t{512} << 20; }},
            {R"("simulationMemory":0)", [](auto const& c) { return c.limits.memory == std::uint64_t{0}; }},
            {R"("simulationDisk":0.5)",
             [](auto const& c) { return c.limits.disk == std::uint64_t{1} << 19; }},
        });
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
        return session(core::concat(R"("trustedProxies":)", list));
    };
    BOOST_TEST(parse(R"(["127.0.0.1","10.0.0.0/8","::1","2001:db8::/32"])")->warnings.empty());
    BOOST_TEST(parse("[]")->config.network.trusted_proxies.empty());
    BOOST_TEST(simulation("")->config.network.trusted_proxies == (Sentences{"127.0.0.0/8", "::1"}),
               boost::test_tools::per_element());
    check_faults(parse,
                 {{R"(["::1","10.0.0.1/8"])",
                   "\"trustedProxies\", entry 2: expected an address or a network without bits set beyond "
                   "it, as in \"127.0.0.1\", \"10.0.0.0/8\" or \"::1\", found the string \"10.0.0.1/8\""}});
    check_refused(parse, {R"(["localhost"])", R"(["10.0.0.0/33"])", R"([""])", R"(["127.0.0.1:80"])"});
}

BOOST_AUTO_TEST_CASE(an_address_may_have_three_quarters_of_the_simulations_unless_the_operator_says_otherwise)
{
    auto const share = [](std::string_view keys) {
        auto const config = simulation(keys)->config;
        return config.service.limit_of_an_address(config.launching.max_simulations);
    };
    BOOST_TEST(share("") == 75);
    BOOST_TEST(share(R"("maxConnections":20)") == 15);
    BOOST_TEST(share(R"("maxConnections":3)") == 3);
    BOOST_TEST(share(R"("maxConnections":1)") == 1);
    BOOST_TEST(share(R"("maxConnections":100,"port":65515)") == 15, "of what there are ports for");
    BOOST_TEST(share(R"("maxConnections":20,"simulationsPerAddress":20)") == 20);
}

BOOST_AUTO_TEST_CASE(trust_in_everybody_is_warned_of)
{
    for (std::string const everybody : {"0.0.0.0/0", "::/0"})
        BOOST_TEST(simulation(R"("trustedProxies":[")" + everybody + "\"]")->warnings ==
                   Sentences{"c.json: key \"trustedProxies\": \"" + everybody +
                             "\" is everybody: no client is limited, and each can pass for another"});
}

// Quirk Q18.
BOOST_AUTO_TEST_CASE(a_short_timeout_counts_as_two_hours_as_it_always_did)
{
    auto const configured = simulation(R"("timeout":359)");
    BOOST_TEST((configured->config.launching.timeout == std::chrono::seconds(7200)));
    BOOST_TEST(configured->warnings.size() == 1u);
    BOOST_TEST((simulation(R"("timeout":360)")->config.launching.timeout == std::chrono::seconds(360)));
}

BOOST_AUTO_TEST_CASE(a_site_without_a_name_says_where_its_machines_are)
{
    std::string const nameless = R"("server":"*","ssl":false)";
    auto const site = machines(R"({"address":"*/2000","internal":"127.0.0.1:2000"})", nameless).value();
    BOOST_TEST(site.warnings.empty());
    BOOST_TEST(site.config.service.gateway);
    BOOST_TEST(machines(R"("*/2000")", nameless + R"(,"gateway":true)").has_value(),
               "the gateway knows that it is here");
    for (auto const* entry : {R"("*/2000")", R"("*:2000")"}) {
        auto const sentence = sentence_of(machines(entry, nameless));
        BOOST_TEST(sentence.find("has to say where the machine is") != std::string::npos, sentence);
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

BOOST_AUTO_TEST_CASE(worlds_are_staged_in_numbers_and_modes_and_only_as_programs_of_this_machine)
{
    constexpr std::string_view world = "https://github.com/o/r/blob/main/worlds/a.wbt";
    auto const with = [&](std::string_view members, std::string_view others = "") {
        return parse_simulation_config(
            core::concat(R"({"server":"h","staged":[{"url":")", world, "\"", members, "}]", others, "}"),
            "c.json");
    };
    auto const plain = with("").value().config.service;
    BOOST_TEST_REQUIRE(plain.staged.size() == 1u);
    BOOST_TEST(plain.staged[0].url == world);
    BOOST_TEST(plain.staged[0].mode == "mjpeg");
    BOOST_TEST(plain.staged[0].count == 1);
    BOOST_TEST((plain.staged_max_age == std::chrono::minutes(10)));
    auto const full = with(R"(,"mode":"x3d","count":30)", R"(,"stagedMaxAge":60)").value().config.service;
    BOOST_TEST(full.staged[0].mode == "x3d");
    BOOST_TEST(full.staged[0].count == 30);
    BOOST_TEST((full.staged_max_age == std::chrono::minutes(1)));

    auto const says = [](auto const& refused, std::string_view text) {
        return !refused && refused.error().message().find(text) != std::string::npos;
    };
    BOOST_TEST(says(with("", R"(,"docker":true)"), "expected [] together with \"docker\" or \"launcher\""));
    BOOST_TEST(says(with("", R"(,"launcher":{"slurm":{}})"), "expected [] together with"));
    BOOST_TEST(says(with(R"(,"mode":"4d")"), "key \"staged\", entry 1: key \"mode\""));
    BOOST_TEST(says(with(R"(,"count":0)"), "key \"count\""));
    BOOST_TEST(says(with("", R"(,"forges":["https://git.example.org"])"),
                    "expected the address of a world on one of the \"forges\""));
    for (auto const* staged : {R"({"staged":"a"})", R"({"staged":["a"]})", R"({"staged":[{"count":1}]})"})
        BOOST_TEST(says(parse_simulation_config(staged, "c.json"), "\"staged\""), staged);

    BOOST_TEST(plain.staged_for_classes == 30);
    auto const slurm =
        parse_simulation_config(R"({"server":"h","launcher":{"slurm":{}}})", "c.json").value().config;
    BOOST_TEST(slurm.service.staged_for_classes == 0);
    BOOST_TEST(says(parse_simulation_config(R"({"docker":true,"stagedForClasses":1})", "c.json"),
                    "expected 0 together with \"docker\" or \"launcher\""));
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
    BOOST_TEST(server.is_server());
    BOOST_TEST((server.kind == ForgeKind::gitea));
    BOOST_TEST(
        (forges(R"({"url":"https://git.lab.org"})").value().config.forges[0].kind == ForgeKind::unknown));
    auto const mirror =
        forges(R"({"url":"https://git.lab.org","directory":"x","kind":"gitlab"})").value().config.forges[0];
    BOOST_TEST(!mirror.is_server());
    BOOST_TEST(mirror.directory == "/etc/x");
    BOOST_TEST((mirror.kind == ForgeKind::gitlab));
    std::string kinds;
    for (auto const& row : forge_kinds)
        kinds += core::concat("\"", row.name, "\", ");
    BOOST_TEST(forges(R"({"url":"https://git.lab.org","kind":"git"})")
                   .error()
                   .message()
                   .ends_with(core::concat("expected one of ", kinds, "found the string \"git\"")));
    BOOST_TEST(!forges(R"({"url":"local:","kind":"gitlab"})").has_value());
}

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
    BOOST_TEST(session(R"("server":"h.org","sslCertificate":"c","sslKey":"k")")->warnings ==
               Sentences{"c.json: pages of every site may use this server. For those of its own site and of "
                         "webots.cloud alone add this line: \"allowedOrigins\": [\"https://h.org\", "
                         "\"https://webots.cloud\"],"});
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
    auto const with_tls = [](std::string_view keys) {
        return session(core::concat(R"("sslCertificate":"c","sslKey":"k")", keys));
    };
    BOOST_TEST(with_tls("")->config.network.redirect_port == 0);
    BOOST_TEST(with_tls(R"(,"redirectPort":80)")->config.network.redirect_port == 80);
    BOOST_TEST(with_tls(R"(,"redirectPort":80,"challengeFolder":"/a")")->config.network.challenge_folder ==
               "/a");
    check_refused(with_tls,
                  {R"(,"redirectPort":443)", R"(,"redirectPort":65536)", R"(,"challengeFolder":"/a")"});
    BOOST_TEST(session("")->config.network.listen_address == "::");
    BOOST_TEST(session(R"("listenAddress":"127.0.0.1")")->config.network.listen_address == "127.0.0.1");
    check_refused(session, {R"("redirectPort":80)"});
    auto const listen = [](std::string_view written, std::string_view advice) {
        BOOST_TEST(
            sentence_of(session(core::concat(R"("listenAddress":)", written))) ==
            core::concat("c.json: key \"listenAddress\": expected a numeric address of this machine, as "
                         "in \"127.0.0.1\", or \"::\" for all, found the string ",
                         written, advice));
    };
    listen("\"localhost\"", ": write \"127.0.0.1\"");
    listen("\"*\"", ": write \"::\"");
    listen("\"0.0.0.0:1999\"", ": write \"0.0.0.0\", and the port as \"port\"");
    listen("\"eth0\"", "");
}

BOOST_AUTO_TEST_CASE(both_servers_know_who_may_ask_them)
{
    auto const none = session("")->config.access;
    BOOST_TEST((none == AccessConfig()));
    BOOST_TEST(!none.allowed_origins.has_value());
    constexpr std::string_view keys =
        R"("hostNames":["lab7"],"allowedOrigins":["https://*.example.org","null"],"frameAncestors":[],)"
        R"("monitorPassword":"p","monitorAddresses":["10.0.0.0/8"],"operatorTokenFile":"/t","operatorSocket":"/s","sessionSecret":"/x")";
    auto const access = simulation(keys)->config.access;
    BOOST_TEST(access.host_names == (Sentences{"lab7"}));
    BOOST_TEST(*access.allowed_origins == (Sentences{"https://*.example.org", "null"}));
    BOOST_TEST(access.frame_ancestors->empty());
    BOOST_TEST(access.monitor_password == "p");
    BOOST_TEST(access.monitor_addresses == (Sentences{"10.0.0.0/8"}));
    BOOST_TEST(access.operator_token_file == "/t");
    BOOST_TEST(access.operator_socket == "/s");
    BOOST_TEST(access.session_secret == "/x");
    BOOST_TEST((session(keys)->config.access == access));
    check_faults(session, {{R"("allowedOrigins":["example.org"])",
                            "\"allowedOrigins\": expected a list of sites, as in \"https://example.org\", "
                            "\"https://*.example.org\" or \"*\", found the list [\"example.org\"]"}});
}

BOOST_AUTO_TEST_CASE(a_name_of_the_machine_is_a_whole_one_as_browsers_say_it)
{
    auto const parse = [](std::string_view name) {
        return session(core::concat(R"("hostNames":["lab7",")", name, R"("])"));
    };
    std::string const where = "\"hostNames\", entry 2: expected a ";
    check_faults(
        parse,
        {{"http://lab8/", where + "name of this machine, as in \"lab7.example.org\", found the string "
                                  "\"http://lab8/\": write \"lab8\""},
         {"*.example.org", where + "whole name of this machine: patterns are for \"allowedOrigins\", so "
                                   "write each name, found the string \"*.example.org\""}});
    BOOST_TEST(sentence_of(parse("B\u00fccher.example"))
                   .ends_with(": write \"xn--bcher-kva.example\", as browsers say it"));
    BOOST_TEST(session(R"("hostNames":["*"])").has_value());
    BOOST_TEST(sentence_of(session(R"("server":"gr\u00fc\u00dfe.example:8443")"))
                   .ends_with(": write \"xn--gre-6ka8l.example:8443\", as browsers say it"));
}

BOOST_AUTO_TEST_CASE(a_certificate_and_its_key_are_given_together)
{
    BOOST_TEST(session(R"("sslCertificate":"/c","sslKey":"/k","connectionsPerAddress":7)")->warnings.empty());
    BOOST_TEST(session("")->config.network.connections_per_address == 1000);
    check_faults(session, {{R"("sslKey":"/k")", "\"sslCertificate\" is missing: expected the file of the "
                                                "certificate that \"sslKey\" belongs to"}});
    check_refused(simulation, {R"("sslCertificate":"/c")"});
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

BOOST_AUTO_TEST_CASE(an_administrator_without_a_mail_server_or_a_sender_is_dropped_with_a_warning)
{
    auto const no_server = session(R"("administrator":"a@b.org","mailSender":"c@d.org","mailServer":"")");
    BOOST_TEST(no_server->config.mail.administrator.empty());
    BOOST_TEST(no_server->warnings ==
               Sentences{"c.json: key \"administrator\" is ignored: no e-mails without \"mailServer\""});
    auto const no_sender = session(R"("administrator":"a@b.org","mailServer":"m")");
    BOOST_TEST(no_sender->config.mail.administrator.empty());
    BOOST_TEST(no_sender->warnings.front().find("\"mailSender\"") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(mail_keys_that_could_forge_a_mail_are_refused)
{
    BOOST_TEST(sentence_of(session(R"("administrator":"a@b.org\r\nBcc: c@d.org")"))
                   .find("expected an e-mail address") != std::string::npos);
    check_faults(session,
                 {{R"("mailSender":"<a@b.org>")",
                   "\"mailSender\": expected an e-mail address, found the string \"<a@b.org>\""},
                  {R"("mailServer":"smtp://m")",
                   "\"mailServer\": expected the name of a host, found the string \"smtp://m\""},
                  {R"("mailServerPort":65536)",
                   "\"mailServerPort\": expected an integer from 0 to 65535, found the number 65536"},
                  {R"("mailSenderUser":"a\r\nRCPT TO:<c@d.org>")",
                   "\"mailSenderUser\": expected a string without control characters, found the string "
                   "\"a\\r\\nRCPT TO:<c@d.org>\""}});
}

BOOST_AUTO_TEST_CASE(a_password_is_any_text_without_control_characters_and_no_message_shows_it)
{
    BOOST_TEST(session(R"("mailSenderPassword":"p\u00e4ss \"w;rd'\\ %00")")->config.mail.password ==
               "p\xc3\xa4ss \"w;rd'\\ %00");
    for (std::string const key : {"mailSenderPassword", "teacherPassword", "monitorPassword"})
        for (auto const* bad :
             {R"("secret\n")", R"("secret\r\nQUIT")", R"("secret\u0000")", R"("secret\u009b")", "12345"})
            BOOST_TEST(sentence_of(session("\"" + key + "\":" + bad)) ==
                       "c.json: key \"" + key +
                           "\": expected a string without control characters, found something else");
}

BOOST_AUTO_TEST_CASE(the_password_of_teachers_stands_in_the_configuration_or_in_a_file)
{
    BOOST_TEST(session(R"("teacherPassword":"open sesame")")->config.service.teacher_password ==
               "open sesame");
    auto const file = session(R"("teacherPasswordFile":"log/.teacher-password")");
    BOOST_TEST(file->config.service.teacher_password_file == "log/.teacher-password");
    BOOST_TEST(file->warnings.empty());
    check_faults(session,
                 {{R"("teacherPassword":"open sesame","teacherPasswordFile":"f")",
                   "\"teacherPasswordFile\": expected no such key beside \"teacherPassword\": one of the "
                   "two, found the string \"f\""}});
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
    address.port = 1999; // of programs: in a file the port is required
    BOOST_TEST((SessionConfig().address == address));
    address.port = 2000;
    BOOST_TEST((SimulationConfig().address == address));
}

BOOST_AUTO_TEST_SUITE_END()
