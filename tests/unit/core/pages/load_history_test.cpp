#include "unit_test.hpp"

#include "core/pages/load_history.hpp"

#include <cmath>
#include <limits>

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

namespace {

constexpr TimePoint start(1h);
constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

std::vector<float> values(LoadHistory const& history, std::size_t series, std::size_t max = 1000)
{
    return history.line(series, max).values;
}

} // namespace

// Protocol section 9.3: ten minutes.
BOOST_AUTO_TEST_SUITE(load_history)

BOOST_AUTO_TEST_CASE(points_come_back_oldest_first)
{
    LoadHistory history(5s);
    history.set_series({"a", "b"});
    BOOST_TEST(values(history, 0).empty());
    history.add({1, 10}, start);
    history.add({2, 20}, start + 5s);
    BOOST_TEST(values(history, 0) == (std::vector<float>{1, 2}), boost::test_tools::per_element());
    BOOST_TEST(values(history, 1) == (std::vector<float>{10, 20}), boost::test_tools::per_element());
    BOOST_TEST((history.last() == start + 5s));
    BOOST_TEST((history.line(0, 1000).spacing == 5s));
}

BOOST_AUTO_TEST_CASE(what_is_older_than_ten_minutes_is_forgotten)
{
    LoadHistory history(5s);
    history.set_series({"a"});
    for (int i = 0; i < 300; ++i)
        history.add({static_cast<float>(i)}, start + i * 5s);
    auto const kept = values(history, 0);
    BOOST_TEST(kept.size() == 120u);
    BOOST_TEST(kept.front() == 180);
    BOOST_TEST(kept.back() == 299);
}

BOOST_AUTO_TEST_CASE(a_point_is_due_once_a_step_and_at_most_once_a_second)
{
    LoadHistory history(200ms);
    history.set_series({"a"});
    BOOST_TEST(history.is_due(start));
    history.add({1}, start);
    BOOST_TEST(!history.is_due(start + 999ms));
    BOOST_TEST(history.is_due(start + 1s));
}

BOOST_AUTO_TEST_CASE(few_points_are_the_means_of_neighbours_that_are_known)
{
    LoadHistory history(1s);
    history.set_series({"a"});
    for (float const value : {9.f, 1.f, 3.f, unknown, 7.f, unknown, unknown})
        history.add({value}, start);
    auto const line = history.line(0, 4);
    BOOST_TEST((line.spacing == 2s));
    BOOST_TEST(line.values.size() == 4u);
    BOOST_TEST(line.values[0] == 9); // the mean of a pair of which one value is unknown
    BOOST_TEST(line.values[1] == 2);
    BOOST_TEST(line.values[2] == 7);
    BOOST_TEST(std::isnan(line.values[3]));
    BOOST_TEST(history.line(0, 0).values.empty());
}

BOOST_AUTO_TEST_CASE(series_that_stay_keep_their_points_wherever_they_stand)
{
    LoadHistory history(1s);
    history.set_series({"a", "b"});
    history.add({1, 2}, start);
    history.set_series({"new", "b"});
    BOOST_TEST(std::isnan(values(history, 0)[0]));
    BOOST_TEST(values(history, 1)[0] == 2);
    history.set_series({"b", "b"}); // an operator may name one twice
    history.add({3, 4}, start + 1s);
    BOOST_TEST(values(history, 0) == (std::vector<float>{2, 3}), boost::test_tools::per_element());
    BOOST_TEST(values(history, 1)[1] == 4);
}

BOOST_AUTO_TEST_SUITE_END()
