#include "unit_test.hpp"

#include <webots_cloud/config.hpp>

using namespace webots_cloud;

// All faults of a configuration at once, each with its line and column.
BOOST_AUTO_TEST_SUITE(config_faults)

namespace {

std::string simulation_faults(std::string_view text)
{
    auto const parsed = parse_simulation_config(text, "c.json");
    return parsed ? std::string() : parsed.error().message();
}

} // namespace

BOOST_AUTO_TEST_CASE(all_faults_are_told_in_the_order_of_the_file_and_unknown_keys_after_them)
{
    BOOST_TEST(simulation_faults("{\n"
                                 "  \"prot\": 2000,\n"
                                 "  \"cacheSize\": 0,\n"
                                 "  \"server\": \"http://x\",\n"
                                 "  \"forges\": [\"https://github.com\", 5, {\"url\": \"local:\"}],\n"
                                 "  \"ssl\": \"no\",\n"
                                 "}\n") ==
               "c.json:6:14: not JSON: there is a comma after the last entry of the object\n"
               "c.json:3:16: key \"cacheSize\": expected a number from 0.1 to 100000 (gigabytes), found the "
               "number 0\n"
               "c.json:4:13: key \"server\": expected the name of a host, as in \"sim.example.org\", found "
               "the string \"http://x\": write \"x\"\n"
               "c.json:5:36: key \"forges\", entry 2: expected a base URL, or {\"url\": ..., \"directory\": "
               "...}, found the number 5\n"
               "c.json:6:10: key \"ssl\": expected true or false, found the string \"no\": write false, "
               "without quotes\n"
               "c.json:5:39: key \"forges\", entry 3: key \"directory\" is missing: expected a folder\n"
               "c.json:2:3: unknown key \"prot\" is ignored; did you mean \"port\"?");
}

BOOST_AUTO_TEST_CASE(what_follows_from_a_fault_is_not_told)
{
    BOOST_TEST(
        simulation_faults(R"({"sslCertificate":5,"sslKey":"k","redirectPort":80,"challengeFolder":"/a"})") ==
        "c.json:1:19: key \"sslCertificate\": expected a path, found the number 5");
    BOOST_TEST(
        simulation_faults(
            R"({"sslCertificate":"c","sslKey":"k","redirectPort":"x","challengeFolder":"/a"})") ==
        "c.json:1:51: key \"redirectPort\": expected an integer from 0 to 65535, found the string \"x\"");
    BOOST_TEST(simulation_faults(R"({"cacheSize": 5 GB})") ==
               "c.json:1:15: not JSON: a number has no unit: write 5");
    auto const cut = parse_session_config(R"({"server":"h", "port": 70000)", "c.json");
    BOOST_TEST(cut.error().message() ==
                   "c.json:1:29: not JSON: the file ends within the object that begins at 1:1\n"
                   "c.json:1:24: key \"port\": expected an integer from 1 to 65535, found the number 70000",
               "simulationServers may have been in the rest");
}

BOOST_AUTO_TEST_CASE(numbers_in_quotes_are_told_how_to_be_written)
{
    BOOST_TEST(
        simulation_faults(R"({"port":"2000"})") ==
        "c.json:1:9: key \"port\": expected an integer from 1 to 65534, found the string \"2000\": write "
        "2000, without quotes");
    BOOST_TEST(
        simulation_faults(R"({"startTimeout":"5 s"})") ==
        "c.json:1:17: key \"startTimeout\": expected a number from 1 to 10000000 (seconds), found the string "
        "\"5 s\": write 5, without quotes and unit");
}

BOOST_AUTO_TEST_CASE(numbers_with_units_are_converted_into_that_of_the_key)
{
    auto const advice = [](std::string const& member) {
        auto const fault = simulation_faults("{" + member + "}");
        auto const found = fault.rfind(": write ");
        return found == std::string::npos ? fault : fault.substr(found + 2);
    };
    BOOST_TEST(advice(R"("timeout":"2h")") == "write 7200, without quotes and unit (2h in seconds)");
    BOOST_TEST(advice(R"("timeout":"30 min")") == "write 1800, without quotes and unit (30 min in seconds)");
    BOOST_TEST(advice(R"("simulationMemory":"4 GB")") ==
               "write 4096, without quotes and unit (4 GB in megabytes)");
    BOOST_TEST(advice(R"("shareIdleTime":"50%")") == "write 50, without quotes and unit");
    BOOST_TEST(advice(R"("timeout": 2h)") == "write 7200 (2h in seconds)");
    BOOST_TEST(advice(R"("timeout": 1h 30min)") == "write 5400 (1h 30min in seconds)");
    BOOST_TEST(advice(R"("simulationMemory": 4 GB)") == "write 4096 (4 GB in megabytes)");
    BOOST_TEST(advice(R"("launcher":{"slurm":{"timeLimit": 2h}})") == "write 7200 (2h in seconds)");
    BOOST_TEST(simulation_faults(R"({"port": 5 MB})") ==
               "c.json:1:10: not JSON: a number has no unit, and \"port\" is an integer from 1 to 65534");
    BOOST_TEST(simulation_faults(R"({"simulationMemory":"4 h"})") ==
                   "c.json:1:21: key \"simulationMemory\": expected 0, or a number from 64 to 1000000000 "
                   "(megabytes), found the string \"4 h\"",
               "no number is better than a wrong one");
}

BOOST_AUTO_TEST_CASE(truth_values_and_lists_are_told_how_to_be_written)
{
    auto const fault = [](std::string_view value) {
        return simulation_faults(R"({"ssl":)" + std::string(value) + "}");
    };
    for (auto const* no : {R"("false")", R"("off")", R"("No")", R"("0")"})
        BOOST_TEST(fault(no).ends_with(": write false, without quotes"), fault(no));
    BOOST_TEST(fault("1") ==
               "c.json:1:8: key \"ssl\": expected true or false, found the number 1: write true");
    BOOST_TEST(fault("off") == "c.json:1:8: not JSON: JSON has false in place of off");
    BOOST_TEST(fault(R"("perhaps")") ==
               "c.json:1:8: key \"ssl\": expected true or false, found the string \"perhaps\"");
    BOOST_TEST(simulation_faults(R"({"allowedRepositories":"https://github.com/a"})")
                   .ends_with(R"(: write ["https://github.com/a"])"));
    BOOST_TEST(parse_session_config(R"({"port":1,"simulationServers":"localhost:2000"})", "c.json")
                   .error()
                   .message()
                   .ends_with(R"(: write ["localhost:2000"])"));
}

BOOST_AUTO_TEST_CASE(an_address_that_is_nearly_one_of_a_machine_is_corrected)
{
    auto const fault = [](std::string const& entry) {
        return parse_session_config(R"({"port":1,"simulationServers":[")" + entry + R"("]})", "c.json")
            .error()
            .message();
    };
    BOOST_TEST(fault("http://localhost:2000/").ends_with(R"(: write "localhost:2000")"));
    BOOST_TEST(fault("sim2").ends_with(R"(: write "sim2:2000", if that is its port)"));
    BOOST_TEST(fault("a b").ends_with(R"(found the string "a b")"));
}

namespace {

std::vector<std::string> session_warnings(std::string_view servers, std::string_view more = {})
{
    auto const text =
        R"({"port":1999,"ssl":false,"simulationServers":)" + std::string(servers) + std::string(more) + "}";
    return parse_session_config(text, "c.json").value().warnings;
}

using Sentences = std::vector<std::string>;

} // namespace

BOOST_AUTO_TEST_CASE(machines_that_can_not_be_meant_are_warned_of)
{
    BOOST_TEST(
        session_warnings("[]") ==
        Sentences{"c.json:1:46: key \"simulationServers\": no machine is listed, and nobody can start a "
                  "simulation: name one, as in [\"localhost:2000\"]"});
    BOOST_TEST(session_warnings("[]", R"(,"announcements":true,"sessionSecret":"s")").empty());
    for (auto const* again : {"a:2000", "A:2000", "a/2000"})
        BOOST_TEST(session_warnings(R"(["a:2000",")" + std::string(again) + "\"]") ==
                   Sentences{"c.json:1:56: key \"simulationServers\", entry 2: \"" + std::string(again) +
                             "\" is the machine of entry 1 again: remove one of the two"});
    BOOST_TEST(session_warnings(R"(["localhost:2000","127.0.0.1:2000"])").size() == 1u);
    BOOST_TEST(session_warnings(R"(["localhost:2000","localhost:3000","b:2000","announced"])",
                                R"(,"announcements":true,"sessionSecret":"s")")
                   .empty());
}

BOOST_AUTO_TEST_CASE(a_machine_behind_a_proxy_of_this_machine_says_which_port_is_asked)
{
    BOOST_TEST(
        session_warnings(R"(["localhost/2000"])") ==
        Sentences{"c.json:1:47: key \"simulationServers\", entry 1: \"localhost/2000\" is asked at "
                  "http://localhost/2000/load, so at port 80, where a proxy has to be. Without a proxy "
                  "write \"localhost:2000\""});
    BOOST_TEST(session_warnings(R"(["sim.example.org/2000"])").empty(), "as behind any proxy");
    BOOST_TEST(session_warnings(R"([{"address":"localhost/2000","internal":"127.0.0.1:2000"}])").empty());
}

BOOST_AUTO_TEST_CASE(a_name_with_a_port_before_another_port_is_warned_of)
{
    BOOST_TEST(
        parse_simulation_config(
            R"({"server":"localhost:31999","ssl":false,"port":31600,"portRewrite":false})", "c.json")
            ->warnings ==
        Sentences{"c.json:1:11: key \"server\": \"localhost:31999\" has a port, and as \"portRewrite\" is "
                  "false another one follows it: browsers are sent to ws://localhost:31999:31600, which is "
                  "no address. Write \"localhost\""});
    BOOST_TEST(parse_simulation_config(R"({"server":"x:8443","ssl":false,"portRewrite":true})", "c.json")
                   ->warnings.empty(),
               "the port of the proxy");
}

BOOST_AUTO_TEST_CASE(what_the_viewer_suggests_is_a_world_and_a_password_is_long)
{
    auto const warnings = session_warnings(R"(["a:1"])", R"(,"viewerUrl":"hello")");
    BOOST_TEST_REQUIRE(warnings.size() == 1u);
    BOOST_TEST(warnings[0].starts_with("c.json:1:66: key \"viewerUrl\": \"hello\" is no address of a world"),
               warnings[0]);
    BOOST_TEST(session_warnings(R"(["a:1"])", R"(,"viewerUrl":"local:/a/b/blob/main/worlds/w.wbt")").empty());
    BOOST_TEST(
        parse_session_config(R"({"port":1,"simulationServers":["a:1"],"teacherPassword":"x"})", "c.json")
            .error()
            .message() == "c.json:1:57: key \"teacherPassword\": expected a string of at least 8 characters, "
                          "since anybody may guess, found something else");
}

BOOST_AUTO_TEST_CASE(of_a_key_that_is_there_twice_both_places_are_told)
{
    auto const parsed = parse_simulation_config("{\"server\":\"a\",\n\"server\":\"b\"}", "c.json").value();
    BOOST_TEST(parsed.config.address.host == "b", "as with the Python servers");
    BOOST_TEST(
        parsed.warnings ==
        std::vector<std::string>{
            "c.json:2:1: key \"server\" is here for the second time, and counts; that at 1:2 does not"});
}

BOOST_AUTO_TEST_CASE(the_configuration_of_the_other_server_is_told_by_its_keys)
{
    BOOST_TEST(parse_simulation_config(R"({"server":"h","simulationServers":["a:1"]})", "c.json")->warnings ==
               std::vector<std::string>{
                   "c.json:1:15: unknown key \"simulationServers\" is ignored: it belongs into the "
                   "configuration of webots-session-server"});
    BOOST_TEST(
        parse_session_config(R"({"port":1,"simulationServers":["a/1"],"forges":[]})", "c.json")->warnings ==
        std::vector<std::string>{"c.json:1:39: unknown key \"forges\" is ignored: it belongs into the "
                                 "configuration of webots-simulation-server"});
}

BOOST_AUTO_TEST_CASE(editors_find_the_schema_by_a_key)
{
    BOOST_TEST(parse_simulation_config(R"({"$schema":"../simulation.schema.json","server":"h"})", "c.json")
                   ->warnings.empty());
}

BOOST_AUTO_TEST_SUITE_END()
