#include "unit_test.hpp"

#include "core/pages/day_history.hpp"

#include <algorithm>
#include <array>
#include <limits>

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

// Protocol section 13.9: a day.
BOOST_AUTO_TEST_SUITE(day_history)

namespace {

constexpr TimePoint start(1h);
constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
constexpr std::array<std::string_view, 2> names = {"load", "waiting"};

std::string text_of(DayHistory const& day, TimePoint now)
{
    std::string text = "{";
    day.append_to(text, now);
    return text;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_point_is_the_mean_of_its_minute)
{
    DayHistory day(names);
    day.add(std::array{1.0f, unknown});
    BOOST_TEST(day.advance(start));
    for (int second = 1; second < 60; ++second) {
        day.add(std::array{second < 30 ? 10.0f : 20.0f, second == 7 ? 3.0f : unknown});
        BOOST_TEST(!day.advance(start + second * 1s));
    }
    BOOST_TEST(!day.is_due(start + 59s));
    BOOST_TEST(day.is_due(start + 60s));
    day.add(std::array{15.0f, unknown});
    BOOST_TEST(day.advance(start + 60s));
    std::string point = "{";
    day.append_point_to(point);
    BOOST_TEST(point == R"({"dayPoint":[15.1,3])");
    BOOST_TEST(text_of(day, start + 70s) == R"({"day":{"last":10,"spacing":60,"series":[)"
                                            R"({"name":"load","history":[1,15.1]},)"
                                            R"({"name":"waiting","history":[null,3]}]})");
    BOOST_TEST(day.advance(start + 120s));
    point = "{";
    day.append_point_to(point);
    BOOST_TEST(point == R"({"dayPoint":[null,null])", "nothing was added");
}

BOOST_AUTO_TEST_CASE(what_is_older_than_a_day_is_forgotten_and_the_text_is_bounded)
{
    DayHistory day(names);
    for (int minute = 0; minute < 3 * 24 * 60; ++minute) {
        day.add(std::array{minute < 2 * 24 * 60 ? 99.9f : 11.1f, 0.0f});
        BOOST_TEST(day.advance(start + minute * 1min));
    }
    auto const text = text_of(day, start);
    BOOST_TEST(text.find("99.9") == std::string::npos);
    BOOST_TEST(text.find(R"("spacing":180,)") != std::string::npos);
    BOOST_TEST(static_cast<std::size_t>(std::ranges::count(text, ',')) <= 2 * DayHistory::max_points + 10);
}

BOOST_AUTO_TEST_SUITE_END()
