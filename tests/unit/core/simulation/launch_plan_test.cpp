#include "unit_test.hpp"

#include "core/simulation/launch_plan.hpp"

#include <algorithm>

using namespace webots_cloud::core;

namespace {

std::string joined(std::vector<std::string> const& argv)
{
    std::string text;
    for (auto const& argument : argv)
        text += text.empty() ? argument : "|" + argument;
    return text;
}

} // namespace

// Protocol sections 6.1 and 6.2, and quirk Q22.
BOOST_AUTO_TEST_SUITE(launch_plan)

BOOST_AUTO_TEST_CASE(without_a_mode_webots_runs_minimised_with_a_bare_stream_option)
{
    BOOST_TEST(joined(webots_command("/w/webots", "", 2001, "/p/worlds/a b.wbt")) ==
               "/w/webots|--batch|--mode=pause|--minimize|--no-rendering|--port=2001|--heartbeat=5000|--stream|"
               "/p/worlds/a b.wbt");
}

BOOST_AUTO_TEST_CASE(video_runs_unminimised)
{
    BOOST_TEST(joined(webots_command("/w/webots", "mjpeg", 2002, "/p/worlds/a.wbt")) ==
               "/w/webots|--batch|--mode=pause|--port=2002|--heartbeat=5000|--stream=mjpeg|/p/worlds/a.wbt");
}

BOOST_AUTO_TEST_CASE(only_the_older_scene_mode_runs_minimised)
{
    BOOST_TEST(
        joined(webots_command("/w/webots", "x3d", 2002, "/p/worlds/a.wbt")) ==
        "/w/webots|--batch|--mode=pause|--minimize|--no-rendering|--port=2002|--heartbeat=5000|--stream=x3d|"
        "/p/worlds/a.wbt");
    BOOST_TEST(joined(webots_command("/w/webots", "w3d", 2002, "/p/worlds/a.wbt")) ==
               "/w/webots|--batch|--mode=pause|--port=2002|--heartbeat=5000|--stream=w3d|/p/worlds/a.wbt");
}

BOOST_AUTO_TEST_CASE(the_old_command_line_has_one_stream_option_in_literal_quotes)
{
    OldStream stream;
    BOOST_TEST(joined(old_webots_command("/w/webots", stream, 2003, "/p/worlds/a.wbt")) ==
               "/w/webots|--batch|--mode=pause|--minimize|--no-rendering|--stream=\"port=2003;monitorActivity\"|"
               "/p/worlds/a.wbt");
    stream.controller_edit = true;
    stream.ssl = true;
    BOOST_TEST(old_webots_command("/w/webots", stream, 2003, "/p/worlds/a.wbt")[5] ==
               "--stream=\"port=2003;monitorActivity;controllerEdit;ssl\"");
}

BOOST_AUTO_TEST_CASE(the_old_command_line_names_the_multimedia_server_and_stream_of_the_operator)
{
    OldStream stream;
    stream.multimedia_server = "https://video.org/janus";
    stream.multimedia_stream = "video.org:8004";
    stream.ssl = true;
    BOOST_TEST(old_webots_command("/w/webots", stream, 2003, "/p/worlds/a.wbt")[5] ==
               "--stream=\"port=2003;monitorActivity;multimediaServer=https://video.org/janus;"
               "multimediaStream=video.org:8004;ssl\"");
}

BOOST_AUTO_TEST_CASE(the_scene_mode_has_the_name_that_this_generation_of_webots_knows)
{
    auto const old = parse_world_header("#VRML_SIM R2023a utf8");
    auto const current = parse_world_header("#VRML_SIM R2025a utf8");
    BOOST_TEST(stream_mode("w3d", old) == "x3d");
    BOOST_TEST(stream_mode("x3d", old) == "x3d");
    BOOST_TEST(stream_mode("x3d", current) == "w3d");
    BOOST_TEST(stream_mode("x3d", parse_world_header("#VRML_SIM R2023b utf8")) == "w3d");
    BOOST_TEST(stream_mode("x3d", std::nullopt) == "w3d");
    BOOST_TEST(stream_mode("mjpeg", old) == "mjpeg");
    BOOST_TEST(stream_mode("", old) == "");
}

BOOST_AUTO_TEST_CASE(headers_that_name_no_release_are_recognised)
{
    BOOST_TEST(!parse_world_header("#VRML V2.0 utf8"));
    BOOST_TEST(!parse_world_header("#VRML_SIM V8.6 utf8"));
    BOOST_TEST(!parse_world_header("#VRML_SIM R99999999999 utf8"));
    BOOST_TEST(!parse_world_header(""));
    BOOST_TEST((parse_world_header("#VRML_SIM R2023b utf8") == WebotsVersion{2023, 'b'}));
}

BOOST_AUTO_TEST_CASE(modes_are_a_closed_set_so_that_no_option_can_be_smuggled_in)
{
    BOOST_TEST(is_known_mode("w3d"));
    BOOST_TEST(!is_known_mode("mjpeg --extern"));
    BOOST_TEST(!is_known_mode("-"));
}

BOOST_AUTO_TEST_CASE(the_environment_holds_what_webots_needs_and_no_secrets)
{
    auto const environment = webots_environment(
        {{"HOME", "/h"}, {"AWS_SECRET_ACCESS_KEY", "s"}, {"WEBOTS_HOME", "/w"}, {"LC_ALL", "C"}, {"DISPLAY", ":9"}}, ":0");
    auto const value_of = [&](std::string const& name) {
        auto const found = std::find_if(environment.begin(), environment.end(), [&](auto const& v) { return v.first == name; });
        return found == environment.end() ? std::string("absent") : found->second;
    };
    BOOST_TEST(value_of("HOME") == "/h");
    BOOST_TEST(value_of("WEBOTS_HOME") == "/w");
    BOOST_TEST(value_of("LC_ALL") == "C");
    BOOST_TEST(value_of("DISPLAY") == ":0");
    BOOST_TEST(value_of("AWS_SECRET_ACCESS_KEY") == "absent");
}

BOOST_AUTO_TEST_SUITE_END()
