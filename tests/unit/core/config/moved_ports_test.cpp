#include "core/config/moved_ports.hpp"

#include "unit_test.hpp"

#include <string>

namespace webots_cloud::core {

BOOST_AUTO_TEST_SUITE(moved_ports)

BOOST_AUTO_TEST_CASE(the_ports_of_a_server_move_and_one_that_is_not_there_stays_away)
{
    SimulationConfig config;
    config.address.port = 2000;
    BOOST_REQUIRE(move_ports(config, 1001));
    BOOST_TEST(config.address.port == 3001);
    BOOST_TEST(config.network.redirect_port == 0);
    config.network.redirect_port = 80;
    BOOST_REQUIRE(move_ports(config, 8000));
    BOOST_TEST(config.network.redirect_port == 8080);
    BOOST_TEST(config.service.controller_port == 0);
    config.service.controller_port = 2900;
    BOOST_REQUIRE(move_ports(config, 1000));
    BOOST_TEST(config.service.controller_port == 3900);
}

BOOST_AUTO_TEST_CASE(a_port_that_does_not_exist_is_refused)
{
    SimulationConfig config;
    config.address.port = 2000;
    for (int const distance : {64'000, -2000, 2'147'483'647, -2'147'483'647})
        BOOST_TEST((move_ports(config, distance).error() == errc::invalid_argument), distance);
}

BOOST_AUTO_TEST_CASE(machines_of_this_site_move_and_others_stay)
{
    SessionConfig config;
    config.address.port = 1999;
    for (auto const* const entry :
         {"localhost:2000", "*/2000", "127.0.0.2/2000", "sim.example.org/2000", "10.0.0.2:2000", "announced"})
        config.simulation_servers.emplace_back(entry);
    config.simulation_servers[1].internal_address = "127.0.0.1:2000";
    config.simulation_servers[1].first_port = 2001;
    config.simulation_servers[1].last_port = 2010;
    config.simulation_servers[1].controllers = "127.0.0.1:2900";
    config.service.controller_port = 2899;
    ServerSpec proxied("localhost/2000");
    proxied.internal_address = "10.0.0.2:2000";
    config.simulation_servers.push_back(proxied);
    BOOST_REQUIRE(move_ports(config, 1000));
    std::vector<std::string> addresses;
    for (auto const& each : config.simulation_servers)
        addresses.push_back(each.address);
    BOOST_TEST((addresses == std::vector<std::string>{"localhost:3000", "*/3000", "127.0.0.2/3000",
                                                      "sim.example.org/2000", "10.0.0.2:2000", "announced",
                                                      "localhost/2000"}));
    BOOST_TEST(config.simulation_servers[1].internal_address == "127.0.0.1:3000");
    BOOST_TEST(config.simulation_servers[1].first_port == 3001);
    BOOST_TEST(config.simulation_servers[1].last_port == 3010);
    BOOST_TEST(config.simulation_servers[1].controllers == "127.0.0.1:3900");
    BOOST_TEST(config.service.controller_port == 3899);
    BOOST_TEST(config.address.port == 2999);
}

BOOST_AUTO_TEST_CASE(an_internal_address_by_tls_moves_as_well)
{
    std::string address = "https://localhost:2000";
    BOOST_REQUIRE(move_port(address, 5));
    BOOST_TEST(address == "https://localhost:2005");
    address = "https://localhost";
    BOOST_REQUIRE(move_port(address, 5));
    BOOST_TEST(address == "https://localhost");
    address = "[::1]:2000";
    BOOST_REQUIRE(move_port(address, 5));
    BOOST_TEST(address == "[::1]:2005");
}

BOOST_AUTO_TEST_SUITE_END()

} // namespace webots_cloud::core
