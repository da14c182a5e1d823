#include "unit_test.hpp"

#include "core/access/ip_address.hpp"

using namespace webots_cloud;
using core::IpAddress;
using core::IpNetwork;

BOOST_AUTO_TEST_SUITE(ip_address)

namespace {

IpAddress address(std::string_view text)
{
    auto const parsed = IpAddress::parse(text);
    BOOST_TEST_REQUIRE(parsed.has_value(), text);
    return *parsed;
}

IpNetwork network(std::string_view text)
{
    auto const parsed = IpNetwork::parse(text);
    BOOST_TEST_REQUIRE(parsed.has_value(), text);
    return *parsed;
}

} // namespace

BOOST_AUTO_TEST_CASE(addresses_are_read_and_written_in_their_shortest_form)
{
    BOOST_TEST(address("203.0.113.7").text() == "203.0.113.7");
    BOOST_TEST(address("2001:0DB8:0:0:0:0:0:1").text() == "2001:db8::1");
    BOOST_TEST(address("::").text() == "::");
    BOOST_TEST(address("fe80::1%eth0").text() == "fe80::1");
    BOOST_TEST(IpAddress().text() == "::");
}

BOOST_AUTO_TEST_CASE(ipv4_within_ipv6_is_ipv4)
{
    BOOST_TEST(address("::ffff:203.0.113.7").text() == "203.0.113.7");
    BOOST_TEST(address("::ffff:cb00:7107").text() == "203.0.113.7");
    BOOST_TEST((address("::ffff:1.2.3.4") == address("1.2.3.4")));
    BOOST_TEST(!address("::1.2.3.4").is_v4());
}

BOOST_AUTO_TEST_CASE(what_is_no_numeric_address_is_refused)
{
    for (auto const* bad :
         {"",         "localhost",         "1.2.3",    "1.2.3.4.5", "1.2.3.256",  "1.2.3.4:80", "01.2.3.4",
          "1.2.3.-4", " 1.2.3.4",          "1.2.3.4 ", "0x7f.1",    "2130706433", "[::1]",      "::1::",
          ":::",      "1:2:3:4:5:6:7:8:9", "12345::",  "%eth0",     "::1/64",     "g::1"})
        BOOST_TEST(!IpAddress::parse(bad), bad);
    BOOST_TEST(!IpAddress::parse(std::string_view("1.2.3.4\0", 8)));
}

BOOST_AUTO_TEST_CASE(clients_of_ipv6_are_counted_by_their_64_network)
{
    BOOST_TEST(address("203.0.113.7").quota_key() == "203.0.113.7");
    BOOST_TEST(address("::ffff:203.0.113.7").quota_key() == "203.0.113.7");
    BOOST_TEST(address("2001:db8:1:2:3:4:5:6").quota_key() == "2001:db8:1:2::/64");
    BOOST_TEST(address("2001:db8:1:2:ffff::").quota_key() == "2001:db8:1:2::/64");
    BOOST_TEST(address("2001:db8:1:3::").quota_key() == "2001:db8:1:3::/64");
}

BOOST_AUTO_TEST_CASE(a_network_contains_what_begins_as_it_does)
{
    BOOST_TEST(network("10.0.0.0/8").contains(address("10.255.0.1")));
    BOOST_TEST(network("10.0.0.0/8").contains(address("::ffff:10.1.2.3")));
    BOOST_TEST(!network("10.0.0.0/8").contains(address("11.0.0.0")));
    BOOST_TEST(network("192.0.2.128/25").contains(address("192.0.2.200")));
    BOOST_TEST(!network("192.0.2.128/25").contains(address("192.0.2.127")));
    BOOST_TEST(network("2001:db8::/33").contains(address("2001:db8:7fff::1")));
    BOOST_TEST(!network("2001:db8::/33").contains(address("2001:db8:8000::1")));
    BOOST_TEST(network("::1").contains(address("::1")));
    BOOST_TEST(!network("::1").contains(address("::2")));
    BOOST_TEST(network("127.0.0.1").contains(address("127.0.0.1")));
    BOOST_TEST(!network("127.0.0.1").contains(address("127.0.0.2")));
    BOOST_TEST(network("::ffff:10.0.0.0/104").contains(address("10.9.9.9")));
}

BOOST_AUTO_TEST_CASE(networks_of_ipv6_contain_no_ipv4)
{
    BOOST_TEST(!network("::/0").contains(address("10.0.0.1")));
    BOOST_TEST(network("::/0").contains(address("2001:db8::1")));
    BOOST_TEST(!network("0.0.0.0/0").contains(address("2001:db8::1")));
    BOOST_TEST(network("0.0.0.0/0").contains(address("10.0.0.1")));
}

BOOST_AUTO_TEST_CASE(everybody_is_known_as_such)
{
    BOOST_TEST(network("::/0").is_everybody());
    BOOST_TEST(network("0.0.0.0/0").is_everybody());
    for (auto const* few : {"::1", "127.0.0.1", "0.0.0.0/1", "::/1", "::ffff:0.0.0.0/97"})
        BOOST_TEST(!network(few).is_everybody(), few);
}

BOOST_AUTO_TEST_CASE(what_is_no_network_is_refused)
{
    for (auto const* bad :
         {"", "/8", "10.0.0.0/", "10.0.0.0/33", "10.0.0.0/-1", "10.0.0.0/+8", "10.0.0.0/8x", "10.0.0.0/8/8",
          "10.0.0.1/8", "10/8", "10.0.0.0/255.0.0.0", "2001:db8::/129", "2001:db8::1/32", "fe80::%eth0/64",
          "::ffff:0.0.0.0/95", "localhost", "*", "10.0.0.0/99999999999999999999"})
        BOOST_TEST(!IpNetwork::parse(bad), bad);
}

BOOST_AUTO_TEST_SUITE_END()
