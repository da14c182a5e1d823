#include "unit_test.hpp"

#include "core/doctor/named_hosts.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(named_hosts_of_configurations)

BOOST_AUTO_TEST_CASE(the_host_of_an_address)
{
    BOOST_TEST(host_in("https://user@forge.example.org:8443/a/b") == "forge.example.org");
    BOOST_TEST(host_in("sim.example.org:2000") == "sim.example.org");
    BOOST_TEST(host_in("sim.example.org/2000") == "sim.example.org");
    BOOST_TEST(host_in("sim.example.org") == "sim.example.org");
    BOOST_TEST(host_in("[2001:db8::2]:2000") == "2001:db8::2");
    BOOST_TEST(host_in("2001:db8::2") == "2001:db8::2");
    BOOST_TEST(host_in("") == "");
}

BOOST_AUTO_TEST_CASE(of_a_session_server)
{
    SessionConfig config;
    config.address.host = "site.example.org";
    for (auto const* const address : {"sim1.example.org:2000", "sim1.example.org:3000", "10.0.0.1:2000",
                                      "inside.example.org:2000", "tls.example.org:2000"})
        config.simulation_servers.emplace_back().address = address;
    config.simulation_servers[3].internal_address = "10.0.0.2:2000";
    config.simulation_servers[4].internal_address = "https://sim2.example.org:2000";
    config.mail.server = "mail.example.org"; // nobody gets mails
    std::vector<NamedHost> expected{NamedHost("server", "site.example.org"),
                                    NamedHost("simulationServers", "sim1.example.org"),
                                    NamedHost("simulationServers", "sim2.example.org")};
    BOOST_TEST((named_hosts(config) == expected));
    config.mail.administrator = "admin@example.org";
    expected.emplace_back("mailServer", "mail.example.org");
    BOOST_TEST((named_hosts(config) == expected));
}

BOOST_AUTO_TEST_CASE(of_a_simulation_server)
{
    SimulationConfig config;
    config.address.host = "*";
    config.forges.emplace_back("local:").directory = "/srv/worlds";
    config.forges.emplace_back("http://10.0.0.9:3000");
    config.service.notify = {"https://registry.example.org/setup"};
    std::vector<NamedHost> const expected{NamedHost("forges", "github.com"),
                                          NamedHost("notify", "registry.example.org")};
    BOOST_TEST((named_hosts(config) == expected));
}

BOOST_AUTO_TEST_SUITE_END()
