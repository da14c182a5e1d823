#include "unit_test.hpp"

#include "core/simulation/gateway_address.hpp"
#include "core/simulation/public_base.hpp"

#include <initializer_list>
#include <string>
#include <string_view>

using namespace webots_cloud;
using namespace webots_cloud::core;

// Protocol section 13.12.
BOOST_AUTO_TEST_SUITE(gateway_address)

BOOST_AUTO_TEST_CASE(a_path_names_a_token_a_port_and_what_the_simulator_is_asked_for)
{
    auto const picture = parse_gateway_path("/simulation/qwertz/2001/mjpeg");
    BOOST_TEST_REQUIRE(picture.has_value());
    BOOST_TEST(picture->token == "qwertz");
    BOOST_TEST(picture->port == 2001);
    BOOST_TEST(picture->rest == "/mjpeg");
    BOOST_TEST(parse_gateway_path("/simulation/q/2001/")->rest == "/"); // as clients open the WebSocket
    BOOST_TEST(parse_gateway_path("/simulation/q/2001")->rest == "/");
    BOOST_TEST(parse_gateway_path("/simulation/q/65535//a/../%2e/b")->rest == "//a/../%2e/b");
}

BOOST_AUTO_TEST_CASE(other_paths_lead_to_no_simulation)
{
    for (auto const* path : {"",
                             "/",
                             "/simulation",
                             "/simulation/",
                             "/simulation/q",
                             "/simulation/q/",
                             "/simulation/q//x",
                             "/simulation//2001/x",
                             "/simulation/q/0/x",
                             "/simulation/q/02001/x",
                             "/simulation/q/65536/x",
                             "/simulation/q/+2001/x",
                             "/simulation/q/-1/x",
                             "/simulation/q/2001x/",
                             "/simulation/q/20 01/",
                             "/simulation/q1/2001/x",
                             "/simulation/q%71/2001/x",
                             "/simulation/q/x/2001/",
                             "//simulation/q/2001/",
                             "/Simulation/q/2001/",
                             "/x/simulation/q/2001/",
                             "/simulation/q/99999999999999999999/x"})
        BOOST_TEST(!parse_gateway_path(path).has_value(), path);
}

BOOST_AUTO_TEST_CASE(the_announced_address_has_the_form_that_clients_know)
{
    PublicAddress address;
    address.host = "sim.example.org";
    address.port = 2000;
    address.ssl = false;
    address.port_rewrite = false;
    BOOST_TEST(webots_gateway_message(public_base(address), "abc", 2001) ==
               "webots:ws://sim.example.org:2000/simulation/abc/2001");
    address.ssl = true;
    address.port_rewrite = true;
    BOOST_TEST(webots_gateway_message(public_base(address), "abc", 2001) ==
               "webots:wss://sim.example.org/2000/simulation/abc/2001");
    BOOST_TEST(gateway_authority(public_base(address), "abc", 2501) ==
               "sim.example.org/2000/simulation/abc/2501");
}

/// As the scripts of Webots do it.
std::string editor_of(std::string url)
{
    auto const number = url.substr(url.find_last_of("/:") + 1);
    return url.replace(url.find(number), number.size(), std::to_string(std::stoi(number) + editor_distance));
}

BOOST_AUTO_TEST_CASE(clients_that_add_500_to_the_last_number_find_the_editor)
{
    PublicAddress address;
    address.host = "sim.example.org";
    for (std::uint16_t const server : {2000, 1000, 10, 20010}) {
        address.port = server;
        auto const port = static_cast<std::uint16_t>(server + 1);
        auto const editor = static_cast<std::uint16_t>(port + editor_distance);
        BOOST_TEST(editor_of(webots_gateway_message(public_base(address), "abc", port)) ==
                   webots_gateway_message(public_base(address), "abc", editor));
    }
}

BOOST_AUTO_TEST_CASE(paths_with_a_token_are_known_with_the_port_of_their_server_too)
{
    for (auto const* path :
         {"/simulation/", "/simulation/x", "/2000/simulation/x/2001/", "/machine/abc/simulation/x/2001/"})
        BOOST_TEST(is_gateway_path(path), path);
    for (auto const* path :
         {"", "/", "/simulation", "/client", "/2000/client", "//simulation/", "2000/simulation/",
          "/2000/x/simulation/", "/x/simulation/", "/2000", "/2000simulation/", "/machine/abc",
          "/machine/abc/client", "/machine//simulation/", "/machine/a/b/simulation/"})
        BOOST_TEST(!is_gateway_path(path), path);
}

BOOST_AUTO_TEST_CASE(a_path_with_a_key_is_known_wherever_a_proxy_puts_it)
{
    for (auto const* path : {"/simulation/x", "/2000/simulation/x", "/machine/abc/simulation/x", "/monitor/x",
                             "/monitor/", "/2000/monitor/x", "/machine/abc/monitor/x"})
        BOOST_TEST(is_path_of_key(path), path);
    for (auto const* path :
         {"", "/", "/monitor", "/2000/monitor", "/machine/abc/monitor", "/client", "/2000/client", "/class",
          "/x/monitor/x", "//monitor/x", "/2000/client/monitor/x", "/machine//monitor/x"})
        BOOST_TEST(!is_path_of_key(path), path);
}

// What a session server says to a machine that was found.
BOOST_AUTO_TEST_CASE(an_address_that_a_gateway_says_is_taken_as_it_is_or_not_at_all)
{
    for (auto const* good : {"wss://sim.example.org/machine/abc", "ws://[fd00::1]:1999/machine/abc",
                             "wss://sim.example.org:8443/1999/machine/abc",
                             "wss://sim.example.org/web.ots/2000", "ws://localhost"}) {
        BOOST_TEST(parse_public_base(good).value() == good);
        auto const announced = webots_gateway_message(good, "abc", 2001);
        BOOST_TEST(editor_of(announced) == webots_gateway_message(good, "abc", 2501));
    }
    for (auto const* bad :
         {"", "sim.example.org", "https://sim.example.org", "wss://", "wss:///machine", "wss://a@b/machine",
          "wss://a/machine/", "wss://a/", "wss://a//b", "wss://a/b?c", "wss://a/b#c", "wss://a/%2e",
          "wss://a/../b", "wss://a b/c", "wss://a/b\r\nc", "javascript:alert(1)"})
        BOOST_TEST(!parse_public_base(bad), bad);
    BOOST_TEST(!parse_public_base("wss://" + std::string(400, 'a')));
}

BOOST_AUTO_TEST_CASE(logs_show_no_token)
{
    BOOST_TEST(without_keys("/simulation/secret/2001/x") == "/simulation/");
    BOOST_TEST(without_keys("/2000/simulation/secret/2001/x") == "/2000/simulation/");
    BOOST_TEST(without_keys("/simulation") == "/simulation");
    BOOST_TEST(without_keys("/client") == "/client");
    std::string const ticket(22, 'k');
    for (auto const* const before :
         {"/ticket/", "/ticket//", "/Ticket/", "/2000/ticket/", "/%74icket/", "/x?", "/"})
        BOOST_TEST(without_keys(before + ticket + "/clien") == before);
    BOOST_TEST(without_keys("/twenty-one-characters/not_found.html") ==
               "/twenty-one-characters/not_found.html");
}

BOOST_AUTO_TEST_SUITE_END()
