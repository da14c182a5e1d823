#include "unit_test.hpp"

#include "core/discovery/machine_name.hpp"

using namespace webots_cloud;
using core::IpAddress;

BOOST_AUTO_TEST_SUITE(machine_name)

BOOST_AUTO_TEST_CASE(entries_name_the_addresses_of_a_name_or_the_machines_of_a_service)
{
    auto const addresses = core::parse_machine_name("dns:sim.example.org:2000");
    BOOST_TEST_REQUIRE(addresses.has_value());
    BOOST_TEST(!addresses->is_service);
    BOOST_TEST(addresses->name == "sim.example.org");
    BOOST_TEST(addresses->port == 2000);
    auto const service = core::parse_machine_name("srv:_webots._tcp.example.org");
    BOOST_TEST_REQUIRE(service.has_value());
    BOOST_TEST(service->is_service);
    BOOST_TEST(service->name == "_webots._tcp.example.org");
    BOOST_TEST(core::parse_machine_name("dns:sim.default.svc.cluster.local.:2000")->name ==
               "sim.default.svc.cluster.local.");
}

BOOST_AUTO_TEST_CASE(what_is_no_name_is_refused)
{
    for (auto const* const entry :
         {"dns:", "srv:", "dns:sim", "dns:sim:", "dns:sim:0", "dns:sim:65536", "dns::2000", "dns:a..b:2000",
          "dns:a b:2000", "dns:[::1]:2000", "srv:a/b", "srv:sim:2000", "srv:a.b..", "sim:2000"})
        BOOST_TEST(!core::parse_machine_name(entry).has_value(), entry);
    BOOST_TEST(!core::parse_machine_name("srv:" + std::string(64, 'a')).has_value());
    BOOST_TEST(core::is_machine_name("dns:"));
    BOOST_TEST(!core::is_machine_name("dns.example.org:2000"));
}

BOOST_AUTO_TEST_CASE(machines_are_called_by_their_addresses)
{
    BOOST_TEST(core::machine_at(*IpAddress::parse("10.0.0.2"), 2000) == "10.0.0.2:2000");
    BOOST_TEST(core::machine_at(*IpAddress::parse("2001:db8::2"), 2000) == "[2001:db8::2]:2000");
}

BOOST_AUTO_TEST_CASE(a_found_machine_is_reached_inside_as_its_entry_says)
{
    auto const inside = [](std::string address, std::string way, std::string_view entry = {}) {
        ServerSpec machine(std::move(address));
        machine.internal_address = std::move(way);
        if (!core::reach_inside(machine, core::parse_machine_name(entry)))
            return std::string("out of reach");
        BOOST_TEST(machine.has_own_path == !machine.internal_address.empty());
        return machine.internal_address +
               (machine.internal_name.empty() ? "" : " as " + machine.internal_name);
    };
    BOOST_TEST(inside("10.0.0.2:2000", "http", "dns:Sim.test.:2000") == "10.0.0.2:2000");
    BOOST_TEST(inside("10.0.0.2:2000", "https", "dns:Sim.test.:2000") == "https://10.0.0.2:2000 as sim.test");
    BOOST_TEST(inside("[2001:db8::2]:1", "https://all.test", "dns:sim:1") ==
               "https://[2001:db8::2]:1 as all.test");
    BOOST_TEST(inside("sim7.test:2000", "https", "srv:_w._tcp.test") == "https://sim7.test:2000");
    BOOST_TEST(inside("10.0.0.7/2000", "http") == "10.0.0.7:2000"); // announced with "portRewrite"
    BOOST_TEST(inside("sim7.test/2000", "https") == "https://sim7.test:2000");
    BOOST_TEST(inside("sim7.test:2000", "http") == "out of reach");
    BOOST_TEST(inside("sim7.test:2000", "") == ""); // browsers reach it themselves
    BOOST_TEST(core::stands_for_found("announced"));
    BOOST_TEST(core::stands_for_found("dns:sim:1"));
    BOOST_TEST(!core::stands_for_found("announced:2000"));
}

BOOST_AUTO_TEST_CASE(no_machine_is_where_no_browser_could_be_sent)
{
    for (auto const* const address :
         {"0.0.0.0", "169.254.169.254", "224.0.0.1", "255.255.255.255", "::", "fe80::1", "ff02::1",
          "::ffff:169.254.1.1", "::127.0.0.1", "::10.0.0.2", "64:ff9b::169.254.169.254", "2002:a9fe:a9fe::1",
          "64:ff9b:1::7f00:1", "64:ff9b:1:7f00:0:100::"})
        BOOST_TEST(!core::is_machine_address(*IpAddress::parse(address), true), address);
    for (auto const* const address : {"127.0.0.1", "127.9.9.9", "::1", "::ffff:127.0.0.1",
                                      "64:ff9b::127.0.0.1", "2002:7f00:1::", "2002:7f01:203::5"}) {
        BOOST_TEST(!core::is_machine_address(*IpAddress::parse(address), false), address);
        BOOST_TEST(core::is_machine_address(*IpAddress::parse(address), true), address);
    }
    for (auto const* const address :
         {"10.0.0.2", "192.0.2.1", "2001:db8::2", "fd00::1", "64:ff9b::10.0.0.2", "2002:c000:201::1"})
        BOOST_TEST(core::is_machine_address(*IpAddress::parse(address), false), address);
    for (auto const* const host : {"localhost", "LOCALHOST.", "a.localhost", "127.0.0.1", "[::1]"})
        BOOST_TEST(!core::is_machine_host(host, false), host);
    BOOST_TEST(core::is_machine_host("localhost", true));
    BOOST_TEST(core::is_machine_host("sim1.example.org", false));
    BOOST_TEST(!core::is_machine_host("[fe80::1]", true));
}

BOOST_AUTO_TEST_SUITE_END()
