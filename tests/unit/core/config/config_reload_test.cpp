#include "unit_test.hpp"

#include "core/config/config_keys.hpp"
#include "core/config/config_reload.hpp"

#include <algorithm>

using namespace webots_cloud;

// The keys of protocol sections 8.1 and 8.2 at SIGHUP, which is ours.
BOOST_AUTO_TEST_SUITE(config_reload)

namespace {

using Keys = std::vector<std::string_view>;

SessionConfig session(std::string_view text)
{
    return parse_session_config(text, "c.json").value().config;
}

SimulationConfig simulation(std::string_view text)
{
    return parse_simulation_config(text, "c.json").value().config;
}

/// Names of keys that have changed and need a restart.
template<class Config>
Keys keys_for_restart(Config running, Config const& next)
{
    return core::take_reloaded(running, next).waiting;
}

/// What the table says of SIGHUP, in the order of the alphabet.
Keys that_need_a_restart(std::span<core::ConfigTopic const> topics)
{
    Keys names;
    for (auto const& topic : topics)
        for (auto const& key : topic.keys)
            if (!key.reloaded)
                names.push_back(key.name);
    std::ranges::sort(names);
    return names;
}

Keys sorted(Keys keys)
{
    std::ranges::sort(keys);
    return keys;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_session_server_takes_over_servers_mail_polling_and_addresses)
{
    auto const running = session(R"({"port":1,"simulationServers":[]})");
    BOOST_TEST(keys_for_restart(running, running).empty());
    auto const next =
        session(R"({"port":1,"simulationServers":["a:1"],"server":"s","ssl":false,"portRewrite":false,
        "administrator":"a@b","mailServer":"m","mailServerPort":25,"mailSender":"s@b","mailSenderUser":"u","mailSenderPassword":"p",
        "loadRefresh":1,"loadTimeout":1,"loadThreshold":50,"scheduling":"random","decisionsForAll":true,"teacherPassword":"p","viewerUrl":"u","pauseHidden":9,"sessionBurst":1,"sessionRate":1,
        "hostNames":["h"],"allowedOrigins":["*"],"frameAncestors":[],"monitorAddresses":["10.0.0.1"],"monitorPassword":"p","operatorTokenFile":"t","gateway":true,"relay":true,"waitingRoom":5,"discoverLoopback":true})");
    BOOST_TEST(keys_for_restart(running, next).empty());
    auto const by_file = session(R"({"port":1,"simulationServers":[],"teacherPasswordFile":"f"})");
    BOOST_TEST(keys_for_restart(running, by_file).empty());
}

BOOST_AUTO_TEST_CASE(what_may_change_is_copied_and_named_and_the_rest_stays)
{
    auto in_force =
        simulation(R"({"title":"old","maxConnections":8,"simulationsPerAddress":6,"shareIdleTime":20})");
    auto const next = simulation(R"({"title":"new","maxConnections":9,"simulationsPerAddress":6})");
    auto const changes = core::take_reloaded(in_force, next);
    BOOST_TEST(sorted(changes.applied) == (Keys{"shareIdleTime", "title"}), boost::test_tools::per_element());
    BOOST_TEST(changes.waiting == Keys{"maxConnections"}, boost::test_tools::per_element());
    BOOST_TEST(in_force.service.title == "new");
    BOOST_TEST(in_force.service.repositories.share_idle_time == 50);
    BOOST_TEST(in_force.launching.max_simulations == 8);
    BOOST_TEST(core::take_reloaded(in_force, next).applied.empty());
}

BOOST_AUTO_TEST_CASE(what_a_session_server_does_not_take_over_is_named)
{
    auto const running = session(R"({"port":1,"simulationServers":[]})");
    auto const next = session(
        R"({"port":2,"simulationServers":[],"sslCertificate":"c","sslKey":"k","connectionsPerAddress":5,"pingTimeout":9,
        "trustedProxies":[],"operatorSocket":"/s","sessionSecret":"/x","redirectPort":3,"challengeFolder":"/c","listenAddress":"::1",
        "logDir":"l","debug":true,"logFormat":"json","caFile":"a","placementTimeout":1,"announcements":true,"nameServers":["10.0.0.53"]})");
    BOOST_TEST(sorted(keys_for_restart(running, next)) == that_need_a_restart(core::session_topics()),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_simulation_server_takes_over_its_policy_and_texts)
{
    auto const next = simulation(
        R"({"allowedRepositories":["https://a"],"blockedRepositories":["https://b"],"shareIdleTime":1,
        "simulationsPerAddress":3,"maxSimulationsPerWorld":2,"trafficLimit":5,"title":"t","description":"d","reconnectGrace":5,"loadFormula":"reference","monitorAddresses":["10.0.0.1"]})");
    BOOST_TEST(keys_for_restart(simulation("{}"), next).empty());
}

BOOST_AUTO_TEST_CASE(what_a_simulation_server_does_not_take_over_is_named)
{
    auto const next = simulation(
        R"({"port":2,"server":"s","ssl":false,"portRewrite":false,"docker":true,"dockerDir":"/d",
        "dockerImages":"i","projectDockerfiles":true,"buildNetwork":true,"persistantDockerImages":[],"forges":[],"caFile":"a","notify":"https://a",
        "cacheSize":1,"stateDir":"s","fetchMemory":256,"fetchDisk":1,"webotsHome":"w","labels":["gpu"],"display":":1","sandbox":"docker","simulationUser":"u","confineServer":false,"network":"host","simulationMemory":512,"simulationCpus":2,
        "simulationProcesses":50,"simulationFiles":100,"simulationDisk":10,"gateway":false,"simulatorEnvironment":["A"],"maxConnections":1,"timeout":400,
        "extendable":60,"startTimeout":1,
        "projectsDir":"p","keyDir":"k","multimediaServer":"m","multimediaStream":"s","simulationLogDays":1,"monitorLogEnabled":false})");
    auto keys = keys_for_restart(simulation("{}"), next);
    auto const more = keys_for_restart(simulation("{}"), simulation(R"({"sslCertificate":"c","sslKey":"k",
        "connectionsPerAddress":5,"pingTimeout":9,"trustedProxies":[],"operatorSocket":"/s","sessionSecret":"/x",
        "redirectPort":3,"challengeFolder":"/c","listenAddress":"::1","logDir":"l","debug":true,"logFormat":"json",
        "sessionServers":["https://s.org"],"launcher":{"slurm":{}}})"));
    keys.insert(keys.end(), more.begin(), more.end());
    BOOST_TEST(sorted(keys) == that_need_a_restart(core::simulation_topics()),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_SUITE_END()
