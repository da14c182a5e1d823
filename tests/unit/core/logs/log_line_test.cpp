#include "unit_test.hpp"

#include "core/logs/log_line.hpp"

using namespace webots_cloud;
using core::json_log_line;

BOOST_AUTO_TEST_SUITE(log_line)

BOOST_AUTO_TEST_CASE(a_line_is_an_object_with_time_level_and_message)
{
    WallTime const when{std::chrono::milliseconds(1'767'323'045'006)};
    BOOST_TEST(
        json_log_line(when, LogLevel::info, "Session server running on port 1999") ==
        R"({"time":"2026-01-02T03:04:05.006Z","level":"info","message":"Session server running on port 1999"})");
    BOOST_TEST(json_log_line(when, LogLevel::warning, "").ends_with(R"("level":"warning","message":""})"));
    BOOST_TEST(json_log_line(when, LogLevel::error, "x").find(R"("level":"error")") != std::string::npos);
    BOOST_TEST(json_log_line(when, LogLevel::debug, "x").find(R"("level":"debug")") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(whatever_a_message_holds_it_stays_one_line_of_json)
{
    auto const line = json_log_line(WallTime(), LogLevel::info, "a\n\"b\\ \x01 \xc3\xa9");
    BOOST_TEST(line.ends_with("\"message\":\"a\\n\\\"b\\\\ \\u0001 \xc3\xa9\"}"), line);
    BOOST_TEST(json_log_line(WallTime(), LogLevel::info, "\xff").ends_with(R"("message":"\\xff"})"));
}

BOOST_AUTO_TEST_SUITE_END()
