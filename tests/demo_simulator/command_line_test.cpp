#include "command_line.hpp"

#include <boost/test/unit_test.hpp>

using namespace webots_cloud::demo;

namespace {

Options accepted(std::vector<std::string> const& arguments, Environment const& environment = {})
{
    CommandLine const line = parse_command_line(arguments, environment);
    BOOST_REQUIRE(std::holds_alternative<Options>(line));
    return std::get<Options>(line);
}

bool is_refused(std::vector<std::string> const& arguments, Environment const& environment = {})
{
    return std::holds_alternative<Refusal>(parse_command_line(arguments, environment));
}

} // namespace

BOOST_AUTO_TEST_SUITE(command_line)

BOOST_AUTO_TEST_CASE(the_command_line_of_a_simulation_server_is_read)
{
    Options const options =
        accepted({"--batch", "--mode=pause", "--minimize", "--no-rendering", "--port=2001",
                  "--heartbeat=5000", "--stream=mjpeg", "/p/worlds/a.wbt"});
    BOOST_TEST(options.port == 2001);
    BOOST_TEST(options.heartbeat.count() == 5000);
    BOOST_TEST((options.mode == Mode::pause));
    BOOST_TEST((options.stream == StreamMode::mjpeg));
    BOOST_TEST(options.world.string() == "/p/worlds/a.wbt");
    BOOST_TEST(!options.old_protocol);
}

BOOST_AUTO_TEST_CASE(the_old_stream_option_is_read_with_its_literal_quotes)
{
    Options const options = accepted(
        {"--stream=\"port=2005;monitorActivity;mode=mjpeg;controllerEdit;ssl\"", "--no-sandbox", "a.wbt"});
    BOOST_TEST(options.port == 2005);
    BOOST_TEST(options.controller_edit);
    BOOST_TEST((options.stream == StreamMode::mjpeg));
    BOOST_TEST(options.old_protocol);
}

BOOST_AUTO_TEST_CASE(defaults_are_those_of_webots)
{
    Options const options = accepted({"--stream", "--heartbeat", "a.wbt"});
    BOOST_TEST(options.port == 1234);
    BOOST_TEST(options.heartbeat.count() == 1000);
    BOOST_TEST((options.mode == Mode::real_time));
    BOOST_TEST((options.stream == StreamMode::scene));
}

BOOST_AUTO_TEST_CASE(mistakes_are_refused)
{
    for (char const* option :
         {"--port=0", "--port=65536", "--port=", "--port=1x", "--mode=x", "--stream=", "--stream=vr",
          "--heartbeat=-1", "--demo-faults=x", "--demo-faults=exit-before-ready=256", "-x",
          "--demo-faults=flood=3", "--demo-faults=ready-delay", "--demo-faults=hang=-1"})
        BOOST_TEST(is_refused({option, "a.wbt"}), option);
    BOOST_TEST(is_refused({"a.wbt", "b.wbt"}));
    BOOST_TEST(is_refused({}));
    BOOST_TEST(is_refused({"a.wbt"}, {"nonsense", ""}));
}

BOOST_AUTO_TEST_CASE(faults_of_both_sources_add_up)
{
    Faults const faults = accepted({"--demo-faults=crash-after-ready=20,,hang", "a.wbt"},
                                   {"ready-delay=300,exit-before-ready", ""})
                              .faults;
    BOOST_TEST(faults.ready_delay.count() == 300);
    BOOST_TEST(faults.exit_before_ready.value() == 1);
    BOOST_TEST(faults.crash_after_ready.value().count() == 20);
    BOOST_TEST(faults.hang.value().count() == 0);
    BOOST_TEST(!faults.flood);
}

BOOST_AUTO_TEST_SUITE_END()
