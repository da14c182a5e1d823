// Servers below a path of a host.
#include "unit_test.hpp"

#include "core/public_place.hpp"

#include <string>

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(public_place_of_servers)

BOOST_AUTO_TEST_CASE(a_path_is_short_and_plain)
{
    for (auto const* good : {"/webots", "/webots_simulation_server", "/a/b-c/D.e~1", "/2000", "/..."})
        BOOST_TEST(is_site_path(good), good);
    for (auto const* bad : {"", "/", "webots", "/webots/", "//webots", "/a//b", "/.", "/..", "/a/../b",
                            "/a b", "/a%2e", "/a?b", "/a#b", "/a\\b", "/a:1", "/a\r\nb", "/\"<a>", "/\u00e4"})
        BOOST_TEST(!is_site_path(bad), bad);
    BOOST_TEST(is_site_path("/" + std::string(99, 'a')));
    BOOST_TEST(!is_site_path("/" + std::string(100, 'a')));
}

BOOST_AUTO_TEST_CASE(a_number_at_the_end_of_a_machines_path_is_a_port)
{
    for (auto const* good : {"/2000", "/webots", "/webots/2000", "/2000/webots", "/2000x"})
        BOOST_TEST(is_machine_path(good), good);
    for (auto const* bad : {"", "/", "/0", "/02000", "/65536", "/webots/0", "/webots/", "//2000"})
        BOOST_TEST(!is_machine_path(bad), bad);
}

BOOST_AUTO_TEST_CASE(a_server_is_at_its_port_or_at_its_path_and_other_ports_are_beside_or_below_it)
{
    webots_cloud::PublicAddress address;
    address.host = "sim.example.org";
    address.port = 2000;
    BOOST_TEST(public_place(address) == "sim.example.org/2000");
    BOOST_TEST(public_place(address, 2001) == "sim.example.org/2001");
    address.port_rewrite = false;
    BOOST_TEST(public_place(address) == "sim.example.org:2000");
    BOOST_TEST(public_place(address, 2001) == "sim.example.org:2001");
    for (bool const rewrites : {false, true}) {
        address.port_rewrite = rewrites;
        address.path = "/webots";
        BOOST_TEST(public_place(address) == "sim.example.org/webots");
        BOOST_TEST(public_place(address, 2001) == "sim.example.org/webots/2001");
    }
    BOOST_TEST(path_in("sim.example.org:8443/a/b") == "/a/b");
    BOOST_TEST(path_in("sim.example.org:8443").empty());
}

BOOST_AUTO_TEST_SUITE_END()
