#include "client_message.hpp"

#include <boost/test/unit_test.hpp>

using namespace webots_cloud::demo;

namespace {

template<class Expected>
bool is(std::string_view text)
{
    return std::holds_alternative<Expected>(message::parse(text));
}

template<class Expected>
Expected as(std::string_view text)
{
    message::Message const parsed = message::parse(text);
    BOOST_REQUIRE(std::holds_alternative<Expected>(parsed));
    return std::get<Expected>(parsed);
}

} // namespace

BOOST_AUTO_TEST_SUITE(client_message)

BOOST_AUTO_TEST_CASE(mode_lines_of_all_generations_are_understood)
{
    for (char const* line : {"x3d", "w3d", "x3dom"})
        BOOST_TEST(!as<message::JoinScene>(line).broadcast);
    for (char const* line : {"x3d;broadcast", "w3d;broadcast", "x3dom;broadcast"})
        BOOST_TEST(as<message::JoinScene>(line).broadcast);
    BOOST_TEST(as<message::JoinPictures>("mjpeg: 800x600").size.width == 800);
    BOOST_TEST(as<message::JoinPictures>("mjpeg: 800x600").size.height == 600);
    BOOST_TEST(is<message::Unsupported>("x3domino"));
    BOOST_TEST(is<message::Unsupported>("mjpeg: 800"));
    BOOST_TEST(is<message::Unsupported>("mjpeg: -1x5"));
}

BOOST_AUTO_TEST_CASE(run_commands_carry_a_whole_number)
{
    BOOST_TEST(as<message::Run>("real-time:-1").duration == -1);
    BOOST_TEST(as<message::Run>("fast:300000").duration == 300000);
    BOOST_TEST(as<message::Run>("fast:1").fast);
    BOOST_TEST(!as<message::Run>("real-time:1").fast);
    BOOST_TEST(as<message::Timeout>("timeout:5").duration == 5);
    for (char const* text :
         {"fast", "fast:", "fast:1.5", "fast:1e3", "real-time:99999999999999999999", "timeout:"})
        BOOST_TEST(is<message::Unsupported>(text), text);
}

BOOST_AUTO_TEST_CASE(load_drops_directories)
{
    BOOST_TEST(as<message::Load>("load:worlds/a.wbt").name == "a.wbt");
    BOOST_TEST(as<message::Load>("load:../../etc/passwd").name == "passwd");
    BOOST_TEST(as<message::Load>("load:..\\a.wbt").name == "a.wbt");
}

BOOST_AUTO_TEST_CASE(messages_to_robots_come_in_two_spellings)
{
    BOOST_TEST(as<message::ToRobot>("robot:blue:a:b").text == "a:b");
    BOOST_TEST(as<message::ToRobot>(R"(robot:{"name":"blue","message":"hi"})").name == "blue");
    BOOST_TEST(is<message::Ignored>("robot:blue:init robot window"));
    BOOST_TEST(is<message::Unsupported>("robot:{\"name\":\"blue\"}"));
    BOOST_TEST(is<message::Unsupported>("robot:{"));
}

BOOST_AUTO_TEST_CASE(editors_ask_for_files_and_change_them)
{
    BOOST_TEST(as<message::GetController>("get controller:drive").name == "drive");
    BOOST_TEST(as<message::GetController>("get controller:drive").file == "");
    BOOST_TEST(as<message::GetController>("sync controller:drive/drive.py").name == "drive");
    BOOST_TEST(as<message::GetController>("sync controller:drive/drive.py").file == "drive.py");
    auto const change = as<message::SetController>("set controller:drive/a:b.py:2\nx = 'set:1'\n\n");
    BOOST_TEST(change.name == "drive");
    BOOST_TEST(change.file == "a:b.py");
    BOOST_TEST(change.content == "x = 'set:1'\n\n");
    BOOST_TEST(as<message::SetController>("set controller:../x/../y:0\n").file == "x/../y");
    for (char const* text :
         {"sync controller:drive", "set controller:drive/a.py", "set controller:drive/a.py:1",
          "set controller:drive/a.py\nx", "set controller:drive/a.py:one\nx", "set controller:drive\nx"})
        BOOST_TEST(is<message::Unsupported>(text), text);
}

BOOST_AUTO_TEST_CASE(words_are_exact)
{
    BOOST_TEST(is<message::Pause>("pause"));
    BOOST_TEST(is<message::Reload>("reload"));
    BOOST_TEST(is<message::Reload>("revert"));
    for (char const* text : {"Pause", "pause ", "pausé", "", "stepping"})
        BOOST_TEST(is<message::Unsupported>(text), text);
}

BOOST_AUTO_TEST_SUITE_END()
