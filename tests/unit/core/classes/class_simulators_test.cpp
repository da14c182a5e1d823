#include "unit_test.hpp"

#include "core/classes/class_simulators.hpp"

#include <string>

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(class_simulators)

BOOST_AUTO_TEST_CASE(simulators_of_a_machine_have_other_ports_or_are_below_it)
{
    StudentMachine const machine{"h:2000", "ws://h:2000"};
    BOOST_TEST(simulator_entry("ws://h:2001", machine) == "h:2001");
    BOOST_TEST(simulator_entry("ws://H:2001/", machine) == "h:2001");
    BOOST_TEST(simulator_entry("ws://h:2000/simulation/abc/2001", machine) == "h:2000/simulation/abc/2001");
    for (auto const* other :
         {"wss://h:2001", "ws://i:2001", "ws://h", "ws://h:0", "ws://h:2001/x", "ws://h:2001/2002",
          "ws://h:2001/simulation/abc/2001", "ws://h:2000/simulation/abc/2001/x", "ws://h@i:2001",
          "ws://u@h:2001", "ws://i\\@h:2001", "http://h:2001", "h:2001", "", "ws://", "ws:h:2001"})
        BOOST_TEST(simulator_entry(other, machine).empty(), other);
}

// A page would take these for something to start, or for a file.
BOOST_AUTO_TEST_CASE(what_starts_something_is_no_simulator)
{
    for (auto const& machine :
         {StudentMachine{"h:2000", "ws://h:2000"}, StudentMachine{"h/2000", "ws://h/2000"},
          StudentMachine{"*/2000", "ws://h:1999/2000", true}})
        for (auto const* other :
             {"ws://h:1999/session?url=https://e.org/a.wbt", "ws://h:2001?url=https://e.org/a.wbt",
              "ws://h:2001#x", "ws://h:1999/p/worlds/a.wbt", "ws://h/p/worlds/a.WBT", "ws://h/a.w3d",
              "ws://h:2001/a.x3d", "ws://h/2001?url=x", "ws://h:1999/2000/simulation/abc/2001?url=x",
              "ws://h:1999/2000/simulation/abc/2001/a.wbt", "ws://h/2000/../worlds/a.wbt"})
            BOOST_TEST(simulator_entry(other, machine).empty(), other);
}

BOOST_AUTO_TEST_CASE(with_ports_in_paths_simulators_are_beside_the_machine)
{
    StudentMachine machine{"h/2000", "wss://h/2000"};
    BOOST_TEST(simulator_entry("wss://h/2001", machine) == "h/2001");
    BOOST_TEST(simulator_entry("wss://h/2000/simulation/abc/2001", machine) == "h/2000/simulation/abc/2001");
    for (auto const* other :
         {"wss://h:2001", "wss://h:2001/2001", "wss://h/", "wss://h/session", "wss://h/02001",
          "wss://h/2001/x", "wss://h/x/2001", "wss://h/2002/simulation/abc/2001"})
        BOOST_TEST(simulator_entry(other, machine).empty(), other);
    // Below a gateway there is nothing beside it.
    machine.is_closed = true;
    BOOST_TEST(simulator_entry("wss://h/2001", machine).empty());
    BOOST_TEST(simulator_entry("wss://h/2000/simulation/abc/2001", machine) == "h/2000/simulation/abc/2001");
    BOOST_TEST(simulator_entry("wss://h/20001/simulation/abc/2001", machine).empty());
}

BOOST_AUTO_TEST_CASE(the_path_of_a_proxy_is_for_each_browser_to_be_told)
{
    StudentMachine const below{"*/2000", "wss://h/webots/2000", true};
    BOOST_TEST(simulator_entry("wss://h/webots/2000/simulation/abc/2001", below) ==
               "*/2000/simulation/abc/2001");
    for (auto const* other : {"wss://h/2000/simulation/abc/2001", "wss://h/webots/2001",
                              "wss://h/other/2000/simulation/abc/2001", "wss://h/webots/2000"})
        BOOST_TEST(simulator_entry(other, below).empty(), other);
    StudentMachine const python{"h/webots_simulation_server", "wss://h/webots_simulation_server"};
    BOOST_TEST(simulator_entry("wss://h/webots_simulation_server/2001", python) ==
               "h/webots_simulation_server/2001");
    BOOST_TEST(simulator_entry("wss://h/webots_simulation_server/simulation/abc/2001", python) ==
               "h/webots_simulation_server/simulation/abc/2001");
    for (auto const* other : {"wss://h/2001", "wss://h/other/2001", "wss://h/webots_simulation_server/x"})
        BOOST_TEST(simulator_entry(other, python).empty(), other);
}

BOOST_AUTO_TEST_CASE(a_host_that_the_student_chose_is_not_kept)
{
    BOOST_TEST(simulator_entry("ws://evil.example:2001", {"*:2000", "ws://evil.example:2000"}) == "*:2001");
    BOOST_TEST(simulator_entry("ws://evil.example:666/2000/simulation/abc/2001",
                               {"*/2000", "ws://evil.example:666/2000", true}) ==
               "*/2000/simulation/abc/2001");
    BOOST_TEST(simulator_entry("ws://10.0.0.1:2001", {"*:2000", "ws://evil.example:2000"}).empty());
    BOOST_TEST(simulator_entry("ws://[::1]:2001", {"[::1]:2000", "ws://[::1]:2000"}) == "[::1]:2001");
}

BOOST_AUTO_TEST_SUITE_END()
