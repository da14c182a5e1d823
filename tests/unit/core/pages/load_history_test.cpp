#include "unit_test.hpp"

#include "core/pages/load_history.hpp"

#include <cmath>
#include <limits>

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

// Protocol section 9.3: ten minutes.
BOOST_AUTO_TEST_SUITE(load_history)

namespace {

constexpr TimePoint start(1h);
constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

/// A history, and a series of it.
struct OneSeries
{
    explicit OneSeries(Duration step) : history(step) {}

    void add(float value, TimePoint now)
    {
        history.set_next(series, value);
        history.advance(now);
    }
    std::vector<float> values() const { return history.line(series, 1000).values; }

    LoadHistory history;
    LoadHistory::Series series = history.series();
};

} // namespace

BOOST_AUTO_TEST_CASE(points_come_back_oldest_first)
{
    OneSeries one(5s);
    BOOST_TEST(one.values().empty());
    one.add(1, start);
    one.add(2, start + 5s);
    BOOST_TEST(one.values() == (std::vector<float>{1, 2}), boost::test_tools::per_element());
    BOOST_TEST((one.history.last() == start + 5s));
    BOOST_TEST((one.history.line(one.series, 1000).spacing == 5s));
    BOOST_TEST((one.history.spacing(1) == 10s));
}

BOOST_AUTO_TEST_CASE(what_is_older_than_ten_minutes_is_forgotten)
{
    OneSeries one(5s);
    for (int i = 0; i < 300; ++i)
        one.add(static_cast<float>(i), start + i * 5s);
    auto const kept = one.values();
    BOOST_TEST(kept.size() == 120u);
    BOOST_TEST(kept.front() == 180);
    BOOST_TEST(kept.back() == 299);
}

BOOST_AUTO_TEST_CASE(a_point_is_due_once_a_step_and_at_most_once_a_second)
{
    OneSeries one(200ms);
    BOOST_TEST(one.history.is_due(start));
    one.add(1, start);
    BOOST_TEST(!one.history.is_due(start + 999ms));
    BOOST_TEST(one.history.is_due(start + 1s));
}

BOOST_AUTO_TEST_CASE(few_points_are_the_means_of_neighbours_that_are_known)
{
    OneSeries one(1s);
    for (float const value : {9.f, 1.f, 3.f, unknown, 7.f, unknown, unknown})
        one.add(value, start);
    auto const line = one.history.line(one.series, 4);
    BOOST_TEST((line.spacing == 2s));
    BOOST_TEST(line.values.size() == 4u);
    BOOST_TEST(line.values[0] == 9); // the mean of a pair of which one value is unknown
    BOOST_TEST(line.values[1] == 2);
    BOOST_TEST(line.values[2] == 7);
    BOOST_TEST(std::isnan(line.values[3]));
    BOOST_TEST(one.history.line(one.series, 0).values.empty());
}

BOOST_AUTO_TEST_CASE(the_points_of_a_later_series_are_unknown_before_it_came)
{
    OneSeries one(1s);
    one.add(1, start);
    auto later = one.history.series();
    one.history.set_next(later, 7);
    one.add(2, start + 1s);
    BOOST_TEST(one.values() == (std::vector<float>{1, 2}), boost::test_tools::per_element());
    auto const values = one.history.line(later, 1000).values;
    BOOST_TEST(std::isnan(values.at(0)));
    BOOST_TEST(values.at(1) == 7);
}

BOOST_AUTO_TEST_SUITE_END()
