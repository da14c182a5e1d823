#include "unit_test.hpp"

#include "core/access/controller_greeting.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

// Protocol section 13.18. What libController sends is told by its public source (cyberbotics/webots,
// src/controller/c/scheduler.c and robot.c).
BOOST_AUTO_TEST_SUITE(controller_greeting)

namespace {

std::string const key = "abcdefghijklmnopqrst";

std::string greeting_of(std::string const& name)
{
    return "CTR\nRobot-Name: " + name;
}

/// The robot that a controller with our key asks for; other outcomes in brackets.
std::string robot_of(std::string const& name)
{
    auto const read = read_controller_greeting(greeting_of(name));
    if (!read)
        return "[wrong]";
    if (!*read)
        return "[incomplete]";
    BOOST_TEST((*read)->key == key);
    return (*read)->robot;
}

bool is_wrong(std::string_view bytes)
{
    return !read_controller_greeting(bytes);
}

bool is_incomplete(std::string_view bytes)
{
    auto const read = read_controller_greeting(bytes);
    return read && !*read;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_path_of_key_and_robot_is_understood_as_old_and_new_libraries_send_it)
{
    BOOST_TEST(robot_of(key + "/e-puck") == "e-puck");   // R2022b to R2023a: as it was written
    BOOST_TEST(robot_of(key + "%2Fe-puck") == "e-puck"); // R2023b and later: encoded
    BOOST_TEST(robot_of(key) == "");                     // the only robot that waits
    BOOST_TEST(robot_of(key + "/") == "");
    BOOST_TEST(robot_of(key + "%2F") == "");
    BOOST_TEST(robot_of(key + "%2F~2") == "~2");
    BOOST_TEST(robot_of(key + "%2Fe-puck\n\n") == "e-puck"); // of other programs
}

BOOST_AUTO_TEST_CASE(a_robot_is_found_whether_its_name_was_written_encoded_or_not)
{
    for (auto const* name : {"/my robot", "/my%20robot", "%2Fmy%20robot", "%2Fmy%2520robot"})
        BOOST_TEST(robot_of(key + name) == "my%20robot", name);
    BOOST_TEST(robot_of(key + "/B\xc3\xa4r") == "B%C3%A4r");
    BOOST_TEST(robot_of(key + "%2FB%C3%A4r") == "B%C3%A4r");
    BOOST_TEST(robot_of(key + "/b%c3%a4r") == "b%C3%A4r");
    BOOST_TEST(robot_of(key + "/a/b") == "a%2Fb");
    BOOST_TEST(robot_of(key + "/100%") == "100%25");
    BOOST_TEST(robot_of(key + "/..") == ".."); // a name like others
}

BOOST_AUTO_TEST_CASE(what_has_not_come_yet_is_waited_for)
{
    auto const whole = greeting_of(key + "%2Fx");
    for (std::size_t size = 0; size < greeting_of(key).size(); ++size)
        BOOST_TEST(is_incomplete(whole.substr(0, size)), size);
    for (auto const* part : {"%", "%2"})
        BOOST_TEST(robot_of(key + part) == "[incomplete]", part);
    BOOST_TEST(robot_of(key + "%2Fx%") == "x%25"); // nobody knows whether more comes
}

BOOST_AUTO_TEST_CASE(other_protocols_are_no_greetings)
{
    for (std::string_view const bytes :
         {"GET / HTTP/1.1\r\n\r\n", "\x16\x03\x01\x02", "CONNECT a:1 HTTP/1.1", "CTRL", "ctr",
          "CTR Robot-Name: x", "CTR\r\nRobot-Name: x", "CTR\nRobot: x", "\n", "CTR\n\nx"})
        BOOST_TEST(is_wrong(bytes), bytes);
    BOOST_TEST(is_wrong(std::string("C\0R", 3)));
}

BOOST_AUTO_TEST_CASE(names_that_no_simulation_has_shown_are_refused)
{
    for (std::string const& name : {std::string("e-puck"),
                                    std::string("../x"),
                                    std::string("..%2F") + key,
                                    "/" + key,
                                    "%2F" + key,
                                    "A" + key.substr(1),
                                    "%61" + key.substr(1),
                                    key + "u/x",
                                    key + "x",
                                    key + "?x",
                                    key + "..",
                                    key + "%2f",
                                    key + "%00",
                                    std::string(40, '0'),
                                    key + "/a\nb",
                                    key + "/a%0Ab",
                                    key + "/a%00",
                                    key + "%2Fa%00",
                                    key + "%2Fa%250A",
                                    key + "/a\x7f"})
        BOOST_TEST(robot_of(name) == "[wrong]", name);
    BOOST_TEST(robot_of(key + std::string("/a\0", 3)) == "[wrong]");
    BOOST_TEST(robot_of(std::string("abc\0", 4) + key) == "[wrong]");
}

BOOST_AUTO_TEST_CASE(a_greeting_has_a_limit)
{
    auto const longest = greeting_of(key + "/" + std::string(max_controller_greeting, 'x'));
    auto const within = read_controller_greeting(longest.substr(0, max_controller_greeting));
    BOOST_TEST((within && *within));
    BOOST_TEST((read_controller_greeting(longest.substr(0, max_controller_greeting + 1)).error() ==
                errc::too_large));
}

BOOST_AUTO_TEST_CASE(who_says_no_more_is_told_what_is_missing)
{
    BOOST_TEST(unfinished_greeting("CTR").message().find("WEBOTS_CONTROLLER_URL has no key") == 0u);
    BOOST_TEST(unfinished_greeting(greeting_of("abc")).message().find("WEBOTS_CONTROLLER_URL") == 0u);
    BOOST_TEST(unfinished_greeting("CT").message() == "Only controllers of Webots are served at this port.");
}

BOOST_AUTO_TEST_CASE(the_simulator_is_greeted_without_the_key)
{
    BOOST_TEST(greeting_for("my%20robot") == "CTR\nRobot-Name: my%20robot");
    BOOST_TEST(greeting_for("") == "CTR");
}

BOOST_AUTO_TEST_CASE(the_simulators_answer_is_known_by_its_first_word)
{
    using enum ControllerAnswer;
    BOOST_TEST((read_controller_answer("") == incomplete));
    BOOST_TEST((read_controller_answer("CONNECTE") == incomplete));
    BOOST_TEST((read_controller_answer("CONNECTED") == connected));
    BOOST_TEST((read_controller_answer(std::string_view("CONNECTED\1\0", 11)) == connected));
    for (std::string_view const word :
         {"FAILED", "PROCESSING", "FORBIDDEN", "FORBIDDENFAILED", "CONNECTION", "F"})
        BOOST_TEST((read_controller_answer(word) == refused), word);
}

BOOST_AUTO_TEST_CASE(a_session_server_is_told_the_machine_by_its_port)
{
    auto const machine_of = [](std::string const& path) {
        auto const read = read_controller_greeting(greeting_of(path));
        BOOST_TEST_REQUIRE((read && *read), path);
        BOOST_TEST((*read)->key == key);
        return std::to_string((*read)->machine) + " " + (*read)->robot;
    };
    BOOST_TEST(machine_of("2000/" + key + "/my robot") == "2000 my%20robot");
    BOOST_TEST(machine_of("2000%2F" + key + "%2Fmy%2520robot") == "2000 my%20robot");
    BOOST_TEST(machine_of("65535/" + key) == "65535 ");
    BOOST_TEST(machine_of(key + "/2000") == "0 2000");
    for (std::string const& path :
         {"0/" + key, "02000/" + key, "65536/" + key, "2000" + key, "2000//" + key, "-1/" + key,
          "2000x/" + key, "2000/2000/" + key, "99999999999999999999/" + key})
        BOOST_TEST(robot_of(path) == "[wrong]", path);
    for (auto const* path : {"2", "2000", "2000%", "2000%2", "2000/", "2000/abc"})
        BOOST_TEST(robot_of(path) == "[incomplete]", path);
    BOOST_TEST(port_of_machine("sim.example.org/2000") == 2000);
    BOOST_TEST(port_of_machine("[::1]:2001") == 2001);
    for (auto const* address : {"sim.example.org/webots", "announced", "", "h:0"})
        BOOST_TEST(port_of_machine(address) == 0, address);
    // What a session server says to the machine.
    BOOST_TEST(robot_of(controller_path(key, "my%20robot")) == "my%20robot");
    BOOST_TEST(robot_of(controller_path(key, "")) == "");
}

// libController compares 6, 9 and 10 bytes.
BOOST_AUTO_TEST_CASE(our_answers_begin_with_webots_own_words)
{
    BOOST_TEST(controller_forbidden("Why.") == "FORBIDDEN: Why.\n");
    BOOST_TEST(controller_failed("Why.") == "FAILED: Why.\n");
}

BOOST_AUTO_TEST_SUITE_END()
