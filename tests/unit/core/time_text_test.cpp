#include "unit_test.hpp"

#include "core/time_text.hpp"

#include <regex>

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(time_text)

namespace {

constexpr WallTime moment{1'767'323'045'006ms}; // a Friday

bool has_shape(std::string const& text, char const* shape)
{
    return std::regex_match(text, std::regex(shape));
}

} // namespace

BOOST_AUTO_TEST_CASE(moments_are_written_as_each_standard_wants_them)
{
    BOOST_TEST(iso_time(moment) == "2026-01-02T03:04:05.006Z");
    BOOST_TEST(utc_time(moment) == "2026-01-02 03:04:05 UTC");
    BOOST_TEST(mail_date(moment) == "Fri, 02 Jan 2026 03:04:05 +0000");
    BOOST_TEST(http_date(moment) == "Fri, 02 Jan 2026 03:04:05 GMT");
    BOOST_TEST(unix_seconds(moment) == "1767323045");
}

BOOST_AUTO_TEST_CASE(the_last_second_of_a_year_belongs_to_it)
{
    constexpr WallTime new_year{1'767'225'600s};
    BOOST_TEST(mail_date(new_year) == "Thu, 01 Jan 2026 00:00:00 +0000");
    BOOST_TEST(mail_date(new_year - 1s) == "Wed, 31 Dec 2025 23:59:59 +0000");
    BOOST_TEST(iso_time(new_year - 1ms) == "2025-12-31T23:59:59.999Z");
    BOOST_TEST(iso_time(WallTime() - 1ms) == "1969-12-31T23:59:59.999Z");
    BOOST_TEST(unix_seconds(WallTime() - 1ms) == "-1");
}

BOOST_AUTO_TEST_CASE(local_times_are_those_of_this_machine)
{
    BOOST_TEST(has_shape(local_time(moment), "2026-01-0[123] \\d\\d:\\d\\d:05"), local_time(moment));
    BOOST_TEST(has_shape(long_local_time(moment), "[A-Z][a-z]+day, January 0[123], 2026 at \\d\\d:\\d\\d:05"),
               long_local_time(moment));
}

BOOST_AUTO_TEST_CASE(an_age_has_the_unit_that_suits_it)
{
    BOOST_TEST(age_text(0s) == "0 s");
    BOOST_TEST(age_text(119'999ms) == "119 s");
    BOOST_TEST(age_text(120s) == "2 min");
    BOOST_TEST(age_text(7199s) == "119 min");
    BOOST_TEST(age_text(2h) == "2 h");
}

BOOST_AUTO_TEST_CASE(seconds_are_cut_off_or_rounded_up)
{
    BOOST_TEST(seconds_text(1999ms) == "1");
    BOOST_TEST(seconds_rounded_up(1001ms) == "2");
    BOOST_TEST(seconds_rounded_up(2s) == "2");
}

BOOST_AUTO_TEST_SUITE_END()
