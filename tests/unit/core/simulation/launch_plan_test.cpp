#include "unit_test.hpp"

#include "core/simulation/launch_plan.hpp"

using namespace webots_cloud::core;

// Protocol sections 6.1 and 6.2, and quirk Q22.
BOOST_AUTO_TEST_SUITE(launch_plan)

namespace {

std::string joined(std::vector<std::string> const& argv)
{
    std::string text;
    for (auto const& argument : argv)
        text += text.empty() ? argument : "|" + argument;
    return text;
}

} // namespace

BOOST_AUTO_TEST_CASE(without_a_mode_webots_runs_minimised_with_a_bare_stream_option)
{
    BOOST_TEST(
        joined(webots_command("/w/webots", "", 2001, "/p/worlds/a b.wbt")) ==
        "/w/webots|--batch|--mode=pause|--minimize|--no-rendering|--port=2001|--heartbeat=5000|--stream|"
        "/p/worlds/a b.wbt");
}

BOOST_AUTO_TEST_CASE(video_runs_unminimised)
{
    BOOST_TEST(joined(webots_command("/w/webots", "mjpeg", 2002, "/p/worlds/a.wbt")) ==
               "/w/webots|--batch|--mode=pause|--port=2002|--heartbeat=5000|--stream=mjpeg|/p/worlds/a.wbt");
}

BOOST_AUTO_TEST_CASE(webots_is_asked_for_the_robots_that_wait_for_controllers_where_they_may_come)
{
    BOOST_TEST(joined(webots_command("/w/webots", "mjpeg", 2002, "/p/worlds/a.wbt", true)) ==
               "/w/webots|--batch|--mode=pause|--port=2002|--heartbeat=5000|--extern-urls|--stream=mjpeg|"
               "/p/worlds/a.wbt");
}

// Each release of Webots knows one of the two values and refuses the other; the option without a value means
// the same mode to all.
BOOST_AUTO_TEST_CASE(where_the_browser_draws_webots_does_not_and_calls_the_mode_as_it_likes)
{
    auto const without_a_mode = webots_command("/w/webots", "", 2001, "/p/worlds/a.wbt");
    for (std::string const mode : {"x3d", "w3d"})
        BOOST_TEST(joined(webots_command("/w/webots", mode, 2001, "/p/worlds/a.wbt")) ==
                       joined(without_a_mode),
                   mode);
}

BOOST_AUTO_TEST_CASE(the_old_command_line_has_one_stream_option_in_literal_quotes)
{
    OldStream stream;
    BOOST_TEST(
        joined(old_webots_command("/w/webots", stream, 2003, "/p/worlds/a.wbt")) ==
        "/w/webots|--batch|--mode=pause|--minimize|--no-rendering|--stream=\"port=2003;monitorActivity\"|"
        "/p/worlds/a.wbt");
    stream.controller_edit = true;
    stream.ssl = true;
    BOOST_TEST(old_webots_command("/w/webots", stream, 2003, "/p/worlds/a.wbt")[5] ==
               "--stream=\"port=2003;monitorActivity;controllerEdit;ssl\"");
}

BOOST_AUTO_TEST_CASE(the_old_command_line_renders_where_the_page_wants_a_picture)
{
    OldStream stream;
    stream.picture = true;
    BOOST_TEST(
        joined(old_webots_command("/w/webots", stream, 2003, "/p/worlds/a.wbt")) ==
        "/w/webots|--batch|--mode=pause|--stream=\"port=2003;monitorActivity;mode=mjpeg\"|/p/worlds/a.wbt");
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

BOOST_AUTO_TEST_CASE(modes_are_a_closed_set_so_that_no_option_can_be_smuggled_in)
{
    BOOST_TEST(is_known_mode("w3d"));
    BOOST_TEST(!is_known_mode("mjpeg --extern"));
    BOOST_TEST(!is_known_mode("-"));
}

BOOST_AUTO_TEST_SUITE_END()
