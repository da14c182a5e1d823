#include "unit_test.hpp"

#include "core/access/interface_addresses.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(interface_addresses)

BOOST_AUTO_TEST_CASE(only_addresses_that_others_reach_are_told)
{
    std::vector<InterfaceAddress> const all{{"lo", "127.0.0.1"},        {"eth0", "192.168.7.5"},
                                            {"docker0", "172.17.0.1"},  {"br-12ab", "172.18.0.1"},
                                            {"wlan0", "169.254.17.3"},  {"wlan0", "10.1.2.3"},
                                            {"virbr0", "192.168.122.1"}};
    BOOST_TEST((shared_addresses(all) == std::vector<std::string>{"192.168.7.5", "10.1.2.3"}));
}

BOOST_AUTO_TEST_SUITE_END()
