#include "unit_test.hpp"

#include "core/access/controller_address.hpp"
#include "core/access/controller_greeting.hpp"
#include "core/simulation/client_protocol.hpp"

using namespace webots_cloud::core;

// Protocol section 13.18.
BOOST_AUTO_TEST_SUITE(controller_address)

namespace {

std::string const key = "abcdefghijklmnopqrst";

ExternRobots robots_of(std::vector<std::string> const& names)
{
    ExternRobots robots;
    for (auto const& name : names)
        BOOST_TEST(robots.add(name), name);
    return robots;
}

} // namespace

BOOST_AUTO_TEST_CASE(webots_says_which_robots_wait)
{
    BOOST_TEST(extern_robot_in("tcp://<ip_address>:2001/e-puck").value() == "e-puck");
    BOOST_TEST(extern_robot_in("ipc://2001/my%20robot").value() == "my%20robot");
    for (std::string const& line :
         {std::string("tcp://<ip_address>:2001/"), std::string("tcp://<ip_address>:2001"),
          std::string("tcp://"), std::string("ws://a:1/e-puck"), std::string("x tcp://a:1/e-puck"),
          std::string("tcp://a:1/a b"), std::string("tcp://a:1/a/b"), std::string("tcp://a:1/\xff"),
          std::string(), "tcp://a:1/" + std::string(513, 'a')})
        BOOST_TEST(!extern_robot_in(line), line);
}

BOOST_AUTO_TEST_CASE(each_robot_is_named_once_and_not_without_end)
{
    ExternRobots robots;
    BOOST_TEST(robots.add("a"));
    BOOST_TEST(!robots.add("a"));
    for (std::size_t i = 1; i < ExternRobots::max_robots; ++i)
        BOOST_TEST(robots.add("a" + std::to_string(i)));
    BOOST_TEST(!robots.add("b"));
    BOOST_TEST(robots.names().size() == ExternRobots::max_robots);
}

BOOST_AUTO_TEST_CASE(the_place_is_the_servers_own_name_or_what_the_operator_says)
{
    BOOST_TEST(controller_place("", "ws://sim.example.org:2000", 2900) == "sim.example.org:2900");
    BOOST_TEST(controller_place("", "wss://sim.example.org/2000", 2900) == "sim.example.org:2900");
    BOOST_TEST(controller_place("", "wss://sim.example.org", 2900) == "sim.example.org:2900");
    BOOST_TEST(controller_place("", "ws://[::1]:2000", 2900) == "[::1]:2900");
    BOOST_TEST(controller_place("door.example.org:9", "ws://sim.example.org:2000", 2900) ==
               "door.example.org:9");
}

BOOST_AUTO_TEST_CASE(a_url_has_key_and_robot)
{
    auto const robots = robots_of({"e-puck", "my%20robot"});
    BOOST_TEST(controller_url("h:2900", key, robots, 0) == "tcp://h:2900/" + key + "/e-puck");
    BOOST_TEST(controller_url("h:2900", key, robots, 1) == "tcp://h:2900/" + key + "/my%20robot");
}

// R2023b and later send a digest of what is longer, when they have encoded it.
BOOST_AUTO_TEST_CASE(a_url_is_no_longer_than_the_library_sends)
{
    auto const room = max_encoded_name - key.size() - 3; // of the slash
    auto const robots = robots_of(
        {std::string(room, 'x'), std::string(room + 1, 'x'), "%E6%9C%BA%E5%99%A8%E4%BA%BA%E4%B8%80"});
    BOOST_TEST(controller_url("h:1", key, robots, 0) == "tcp://h:1/" + key + "/" + std::string(room, 'x'));
    BOOST_TEST(controller_url("h:1", key, robots, 1) == "tcp://h:1/" + key + "/~2");
    BOOST_TEST(controller_url("h:1", key, robots, 2) == "tcp://h:1/" + key + "/~3");
    BOOST_TEST(robots.resolve("~2") == std::string(room + 1, 'x'));
    BOOST_TEST(controller_url("h:1/2000", key, robots, 0) == "tcp://h:1/2000/" + key + "/~1");
}

BOOST_AUTO_TEST_CASE(short_names_stand_for_robots_unless_a_robot_has_such_a_name)
{
    auto const robots = robots_of({"a", "~1"});
    BOOST_TEST(robots.resolve("~2") == "~1");
    BOOST_TEST(robots.resolve("~1") == "~1");
    for (auto const* other : {"a", "", "~", "~0", "~3", "~2x", "~-1", "~99999999999999999999999", "b"})
        BOOST_TEST(robots.resolve(other) == other, other);
}

BOOST_AUTO_TEST_CASE(the_author_is_told_in_the_console)
{
    BOOST_TEST(controller_message("my%20robot", "tcp://h:1/k/my%20robot") ==
               "stdout:Robot \"my robot\" waits for its controller, which may run on any machine with "
               "WEBOTS_CONTROLLER_URL=tcp://h:1/k/my%20robot");
    BOOST_TEST(
        no_controller_message("a%0Ab") ==
        "stdout:Robot \"a\\x0ab\" waits for its controller, but this site takes none of other machines for "
        "this project. Its operator can add the project to \"controllerRepositories\".");
    BOOST_TEST(no_controller_message("a%zz").find("stdout:Robot \"a%zz\" waits") == 0u);
}

BOOST_AUTO_TEST_SUITE_END()
