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
               "the string \"http://x\"\n"
               "c.json:5:36: key \"forges\", entry 2: expected a base URL, or {\"url\": ..., \"directory\": "
               "...}, found the number 5\n"
               "c.json:6:10: key \"ssl\": expected true or false, found the string \"no\"\n"
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
               "c.json:1:15: not JSON: a number has no unit: write 5, in the unit of the key");
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
    BOOST_TEST(parse_session_config(R"({"port":1,"simulationServers":[],"forges":[]})", "c.json")->warnings ==
               std::vector<std::string>{"c.json:1:34: unknown key \"forges\" is ignored: it belongs into the "
                                        "configuration of webots-simulation-server"});
}

BOOST_AUTO_TEST_CASE(editors_find_the_schema_by_a_key)
{
    BOOST_TEST(parse_simulation_config(R"({"$schema":"../simulation.schema.json","server":"h"})", "c.json")
                   ->warnings.empty());
}

BOOST_AUTO_TEST_SUITE_END()
