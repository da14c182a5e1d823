#include "unit_test.hpp"

#include "core/sandbox/network_rules.hpp"

using webots_cloud::core::internet_only_rules;

BOOST_AUTO_TEST_SUITE(network_rules)

namespace {

bool has_line(std::string const& rules, std::string const& line)
{
    return ("\n" + rules).find("\n" + line + "\n") != std::string::npos;
}

} // namespace

BOOST_AUTO_TEST_CASE(private_networks_and_this_machine_are_unreachable)
{
    auto const rules = internet_only_rules({"127.0.0.1", "203.0.113.9"});
    for (auto const* network : {"10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "169.254.0.0/16",
                                "100.64.0.0/10", "203.0.113.9/32"})
        BOOST_TEST(has_line(rules, std::string("route replace unreachable ") + network), network);
}

BOOST_AUTO_TEST_CASE(of_the_resolver_its_port_alone_is_reached)
{
    auto const rules = internet_only_rules({});
    auto const udp = rules.find("to 10.0.2.3 ipproto 17 dport 53 lookup main");
    auto const tcp = rules.find("to 10.0.2.3 ipproto 6 dport 53 lookup main");
    auto const others = rules.find("to 10.0.2.3 unreachable");
    BOOST_TEST(udp < others);
    BOOST_TEST(tcp < others);
    BOOST_TEST(others != std::string::npos);
}

BOOST_AUTO_TEST_SUITE_END()
