#include "unit_test.hpp"

#include "core/simulation/simulator_greeting.hpp"

#include <string>
#include <vector>

using namespace webots_cloud;
using namespace webots_cloud::core;

// Protocol section 4.1.1.
BOOST_AUTO_TEST_SUITE(simulator_greeting)

namespace {

using Texts = std::vector<std::string>;

std::optional<SimulatorGreeting> greeting_of(std::string const& members)
{
    auto const message = parse_client_message(R"({"start":{"url":"u",)" + members + "}}");
    return greeting_for(std::get<SimulationRequest>(message));
}

} // namespace

BOOST_AUTO_TEST_CASE(a_page_that_runs_its_simulation_at_once_has_that_said)
{
    auto const greeting = greeting_of(R"("mode":"mjpeg","size":"1280x665","run":true)");
    BOOST_TEST_REQUIRE(greeting.has_value());
    BOOST_TEST(greeting->words == (Texts{"mjpeg: 1280x665", "real-time:-1"}),
               boost::test_tools::per_element());
    BOOST_TEST(greeting->picture_size == "1280x665");
    BOOST_TEST(is_answered(*greeting, {"multimedia: mjpeg pause ", "pause: 0", "real-time"}));
    BOOST_TEST(!is_answered(*greeting, {"multimedia: mjpeg real-time "}));
    BOOST_TEST(!is_answered(*greeting, {}));
}

BOOST_AUTO_TEST_CASE(nothing_runs_before_the_page_has_asked_for_it)
{
    for (auto const* run : {"", R"(,"run":false)", R"(,"run":"true")", R"(,"run":1)"}) {
        auto const greeting = greeting_of(std::string(R"("mode":"mjpeg","size":"1x1")") + run);
        BOOST_TEST_REQUIRE(greeting.has_value(), run);
        BOOST_TEST(greeting->words == (Texts{"mjpeg: 1x1", "pause"}), boost::test_tools::per_element());
        BOOST_TEST(is_answered(*greeting, {"paused by client"}), run);
    }
}

BOOST_AUTO_TEST_CASE(only_pages_that_show_pictures_of_a_size_have_something_said)
{
    BOOST_TEST(!greeting_of(R"("mode":"mjpeg","run":true)"));
    BOOST_TEST(!greeting_of(R"("mode":"w3d","size":"1x1","run":true)"));
    BOOST_TEST(!greeting_of(R"("size":"1x1")"));
    for (auto const* size : {R"("")", R"("1x")", R"("x1")", R"("0x1")", R"("1x10000")", R"("1x1x1")",
                             R"("-1x1")", R"("1x1 ")", R"("1x1\nreal-time:-1")", "1", R"(["1x1"])"})
        BOOST_TEST(!greeting_of(std::string(R"("mode":"mjpeg","size":)") + size), size);
    auto const website =
        parse_client_message(R"({"init":["https://w.org","robots","a.wbt"],"mode":"mjpeg"})");
    BOOST_TEST(!greeting_for(std::get<SimulationRequest>(website)));
}

BOOST_AUTO_TEST_CASE(the_page_gets_what_the_simulator_says_once)
{
    auto const said =
        said_messages({"multimedia: mjpeg pause ", "pause: 0", "world:a.wbt:a.wbt", "stdout:hello\nstderr:oh",
                       "scene load completed", "robot: {}", "real-time", "stderr:late"});
    BOOST_TEST(said == (Texts{"said: stdout:hello\nstderr:oh", "said: robot: {}", "said: stderr:late"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_simulator_that_says_very_much_is_cut_short)
{
    std::string line = "stdout:";
    for (int i = 0; i < 100'000; ++i)
        line += "\xc3\xbc";
    auto const said = said_messages(Texts(10, line));
    BOOST_TEST(said.size() == 3u);
    for (auto const& message : said) {
        BOOST_TEST(message.size() < 20'000u);
        BOOST_TEST((message.ends_with("\xbc") && message.starts_with("said: stdout:\xc3")));
    }
}

BOOST_AUTO_TEST_CASE(what_is_kept_for_the_page_is_counted_with_its_beginning_and_its_place)
{
    constexpr std::size_t limit = 64 * 1024;
    for (auto const* text : {"robot:", "stdout:a line of some length, which has memory of its own"}) {
        auto const said = said_messages(Texts(20'000, text));
        BOOST_TEST_REQUIRE(!said.empty(), text);
        auto const one = said.front().size() + sizeof said.front();
        BOOST_TEST(said.size() == limit / one, text);
    }
}

BOOST_AUTO_TEST_SUITE_END()
