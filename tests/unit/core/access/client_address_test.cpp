#include "unit_test.hpp"

#include "core/access/client_address.hpp"

using namespace webots_cloud;
using core::IpNetworks;

BOOST_AUTO_TEST_SUITE(client_address)

namespace {

using Fields = std::vector<std::pair<std::string_view, std::string_view>>;

/// The client of a request that came from a trusted proxy; "-" when the headers tell none.
std::string client(Fields const& fields)
{
    IpNetworks const proxies({"127.0.0.0/8", "::1", "10.0.0.0/8", "2001:db8:ff::/48"});
    auto const found = core::forwarded_client(fields, proxies);
    return found ? found->text() : "-";
}

/// The same of one X-Forwarded-For.
std::string client_of(std::string_view value)
{
    return client({{"Host", "h"}, {"X-Forwarded-For", value}, {"Accept", "*/*"}});
}

std::string client_of_forwarded(std::string_view value)
{
    return client({{"Forwarded", value}});
}

} // namespace

BOOST_AUTO_TEST_CASE(the_rightmost_entry_is_the_client)
{
    BOOST_TEST(client_of("203.0.113.7") == "203.0.113.7");
    BOOST_TEST(client_of("203.0.113.7, 198.51.100.9") == "198.51.100.9");
    BOOST_TEST(client_of("203.0.113.7,198.51.100.9") == "198.51.100.9");
    BOOST_TEST(client_of("2001:db8::7") == "2001:db8::7");
}

BOOST_AUTO_TEST_CASE(entries_that_clients_claim_are_not_read)
{
    BOOST_TEST(client_of("127.0.0.1, 203.0.113.7") == "203.0.113.7");
    BOOST_TEST(client_of("10.0.0.1, 10.0.0.2, 203.0.113.7") == "203.0.113.7");
    BOOST_TEST(client_of("unknown, \x01, 999.1.1.1, 203.0.113.7") == "203.0.113.7");
    BOOST_TEST(client_of("192.0.2.1, 203.0.113.7, 10.1.1.1, 127.0.0.1") == "203.0.113.7");
}

BOOST_AUTO_TEST_CASE(several_fields_are_one_list_in_their_order)
{
    BOOST_TEST(client({{"X-Forwarded-For", "192.0.2.1"}, {"X-Forwarded-For", "203.0.113.7"}}) ==
               "203.0.113.7");
    BOOST_TEST(client({{"x-forwarded-for", "203.0.113.7"}, {"X-FORWARDED-FOR", "10.0.0.1"}}) ==
               "203.0.113.7");
    // An empty header of the client, and the one that HAProxy's `option forwardfor` adds.
    BOOST_TEST(client({{"X-Forwarded-For", ""}, {"Host", "h"}, {"X-Forwarded-For", "203.0.113.7"}}) ==
               "203.0.113.7");
    BOOST_TEST(client({{"X-Forwarded-For", "203.0.113.7"}, {"X-Forwarded-For", ""}}) == "203.0.113.7");
}

BOOST_AUTO_TEST_CASE(ports_brackets_and_quotes_belong_to_no_address)
{
    BOOST_TEST(client_of("203.0.113.7:4711") == "203.0.113.7");
    BOOST_TEST(client_of("[2001:db8::7]:4711") == "2001:db8::7");
    BOOST_TEST(client_of("[2001:db8::7]") == "2001:db8::7");
    BOOST_TEST(client_of("\"[2001:db8::7]:4711\"") == "2001:db8::7");
    BOOST_TEST(client_of(" 203.0.113.7\t") == "203.0.113.7");
    BOOST_TEST(client_of("fe80::7%eth0") == "fe80::7");
}

BOOST_AUTO_TEST_CASE(ipv4_within_ipv6_is_the_same_client_and_the_same_proxy)
{
    BOOST_TEST(client_of("::ffff:203.0.113.7") == "203.0.113.7");
    BOOST_TEST(client_of("203.0.113.7, ::ffff:10.0.0.1") == "203.0.113.7");
    BOOST_TEST(client_of("203.0.113.7, [::ffff:127.0.0.1]:80, 2001:db8:ff:1::1") == "203.0.113.7");
}

BOOST_AUTO_TEST_CASE(headers_that_tell_nothing_leave_the_peer)
{
    BOOST_TEST(client({}) == "-");
    BOOST_TEST(client_of("") == "-");
    BOOST_TEST(client_of(" , ,, ") == "-");
    for (auto const* garbage : {"unknown", "_hidden", "localhost", "203.0.113", "203.0.113.7.8",
                                "1.2.3.4:5:6", "[2001:db8::7", "[2001:db8::7]x", "[]", "[", "]", ":", "\"",
                                "\"\"", "203.0.113.7 198.51.100.9", "203.0.113.7;", "\xff"})
        BOOST_TEST(client_of(garbage) == "-", garbage);
    BOOST_TEST(client_of("203.0.113.7, garbage") == "-");
}

BOOST_AUTO_TEST_CASE(when_all_are_proxies_it_is_the_first_and_garbage_ends_the_walk)
{
    BOOST_TEST(client_of("10.0.0.1") == "10.0.0.1");
    BOOST_TEST(client_of("10.0.0.1, 127.0.0.1") == "10.0.0.1");
    BOOST_TEST(client_of("203.0.113.7, garbage, 10.0.0.1") == "10.0.0.1");
}

BOOST_AUTO_TEST_CASE(long_lists_are_read_from_the_right_and_not_to_their_end)
{
    std::string claims;
    std::string proxies;
    for (int i = 0; i < 10'000; ++i) {
        claims += "192.0.2.1, ";
        proxies += ", 10.0.0.1";
    }
    BOOST_TEST(client_of(claims + "203.0.113.7") == "203.0.113.7");
    BOOST_TEST(client_of("203.0.113.7" + proxies) == "10.0.0.1");
    Fields many(10'000, {"X-Forwarded-For", "10.0.0.1"});
    many.front().second = "203.0.113.7";
    BOOST_TEST(client(many) == "10.0.0.1");
    BOOST_TEST(client_of(std::string(100'000, ',') + "203.0.113.7" + std::string(100'000, ',')) ==
               "203.0.113.7");
}

BOOST_AUTO_TEST_CASE(forwarded_is_read_as_rfc_7239_writes_it)
{
    BOOST_TEST(client_of_forwarded("for=203.0.113.7") == "203.0.113.7");
    BOOST_TEST(client_of_forwarded("for=192.0.2.1, for=203.0.113.7;proto=https;by=10.0.0.1") ==
               "203.0.113.7");
    BOOST_TEST(client_of_forwarded("proto=http; For=\"[2001:db8:cafe::17]:4711\"") == "2001:db8:cafe::17");
    BOOST_TEST(client_of_forwarded("for=203.0.113.7, for=10.0.0.1, FOR=\"127.0.0.1:80\"") == "203.0.113.7");
    for (auto const* garbage : {"", "for", "for=", "=", ";", "by=203.0.113.7", "for=unknown", "for=_x",
                                "203.0.113.7", "for=\"\"", "xfor=203.0.113.7", "for==203.0.113.7"})
        BOOST_TEST(client_of_forwarded(garbage) == "-", garbage);
}

// A proxy that sets X-Forwarded-For passes on whatever Forwarded its client sent.
BOOST_AUTO_TEST_CASE(x_forwarded_for_decides_where_there_are_both)
{
    BOOST_TEST(client({{"X-Forwarded-For", "203.0.113.7"}, {"Forwarded", "for=192.0.2.1"}}) == "203.0.113.7");
    BOOST_TEST(client({{"Forwarded", "for=192.0.2.1"}, {"X-Forwarded-For", "garbage"}}) == "-");
    BOOST_TEST(client({{"X-Forwarded-For", ""}, {"Forwarded", "for=203.0.113.7"}}) == "203.0.113.7");
}

BOOST_AUTO_TEST_CASE(entries_that_are_no_networks_are_told)
{
    BOOST_TEST(IpNetworks({"10.0.0.0/8"}).malformed() == "");
    BOOST_TEST(IpNetworks({"10.0.0.0/8", "proxy.example.org", "x"}).malformed() == "proxy.example.org");
    BOOST_TEST(IpNetworks({""}).malformed() == "an empty text");
}

BOOST_AUTO_TEST_SUITE_END()
