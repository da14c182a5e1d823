#include "core/access/asked_name.hpp"
#include "unit_test.hpp"

BOOST_AUTO_TEST_SUITE(asked_name_)

namespace {

using namespace webots_cloud;
using namespace webots_cloud::core;

PublicAddress address(std::string host, bool port_rewrite)
{
    PublicAddress address;
    address.host = std::move(host);
    address.port = 2000;
    address.port_rewrite = port_rewrite;
    return address;
}

BOOST_AUTO_TEST_CASE(a_server_with_a_name_is_reached_there)
{
    BOOST_TEST(reached_at(address("sim.example.org", true), "192.168.1.5:1999").host == "sim.example.org");
    BOOST_TEST(machine_reached_at("sim.example.org/2000", "192.168.1.5:1999") == "sim.example.org/2000");
}

BOOST_AUTO_TEST_CASE(one_without_is_reached_where_it_was_asked)
{
    BOOST_TEST(reached_at(address("*", true), "192.168.1.5:1999").host == "192.168.1.5:1999");
    BOOST_TEST(reached_at(address("*", false), "192.168.1.5:2000").host == "192.168.1.5");
    BOOST_TEST(reached_at(address("*", false), "[fe80::1]:2000").host == "[fe80::1]");
    BOOST_TEST(machine_reached_at("*/2000", "teacher.local:1999") == "teacher.local:1999/2000");
    BOOST_TEST(machine_reached_at("*:2000", "teacher.local:1999") == "teacher.local:2000");
}

BOOST_AUTO_TEST_CASE(a_machine_with_our_name_is_found_at_our_port)
{
    PublicAddress own = address("sim.example.org", false);
    own.port = 8443;
    own.ssl = true;
    BOOST_TEST(path_at_own_port(own, "sim.example.org/2000") == "/2000");
    BOOST_TEST(path_at_own_port(own, "other.example.org/2000").empty());
    BOOST_TEST(path_at_own_port(own, "sim.example.org.evil/2000").empty());
    BOOST_TEST(path_at_own_port(own, "sim.example.org:2000").empty(), "at a port of its own");
    own.port = 443;
    BOOST_TEST(path_at_own_port(own, "sim.example.org/2000").empty(), "the entry says it");
    own.ssl = false;
    BOOST_TEST(path_at_own_port(own, "sim.example.org/2000") == "/2000", "of http it is another");
    own.port_rewrite = true;
    BOOST_TEST(path_at_own_port(own, "sim.example.org/2000").empty(), "the port is the proxy's");
}

BOOST_AUTO_TEST_CASE(what_is_no_host_is_not_repeated)
{
    for (auto const* host : {"", "a b", "user@pc7", "pc7/x", "pc7\r\nX: y", ":80"})
        BOOST_TEST(machine_reached_at("*/2000", host) == "localhost/2000");
}

BOOST_AUTO_TEST_SUITE_END()

} // namespace
