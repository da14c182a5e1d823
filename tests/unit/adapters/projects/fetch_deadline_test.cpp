// When a fetch stops, and that all of its parts are told.
#include "unit_test.hpp"

#include "adapters/projects/fetch_deadline.hpp"
#include "refusal_sentences.hpp"

#include <webots_cloud/config.hpp>

#include <boost/asio/error.hpp>

#include <vector>

using namespace webots_cloud;
using namespace webots_cloud::adapters;

BOOST_AUTO_TEST_SUITE(fetch_deadline)

BOOST_AUTO_TEST_CASE(a_fetch_goes_on_until_it_is_cancelled)
{
    std::atomic<bool> aborted = false;
    FetchDeadline const deadline(&aborted, std::chrono::hours(1));
    auto const interrupt = deadline.interrupt();
    auto const waiting = deadline.waiting({});
    BOOST_TEST((deadline.may_go_on() && interrupt() && waiting.interrupt()));
    aborted = true;
    BOOST_TEST((deadline.may_go_on().error().code() == boost::asio::error::operation_aborted));
    BOOST_TEST((interrupt().error().code() == boost::asio::error::operation_aborted));
    BOOST_TEST((waiting.interrupt().error().code() == boost::asio::error::operation_aborted));
}

BOOST_AUTO_TEST_CASE(a_fetch_that_takes_too_long_is_told_so)
{
    FetchDeadline deadline(nullptr, std::chrono::seconds(-1));
    for (int time = 0; time < 2; ++time) {
        auto const outcome = deadline.may_go_on();
        BOOST_TEST_REQUIRE(outcome.has_error());
        BOOST_TEST((outcome.error() == errc::timed_out));
        BOOST_TEST(outcome.error().message() == sentence(core::Refused::fetch_too_slow));
        deadline.restart(); // is as short as before
    }
}

BOOST_AUTO_TEST_CASE(the_longest_time_is_not_over_at_once)
{
    BOOST_TEST(FetchDeadline(nullptr, Duration::max()).may_go_on().has_value());
}

BOOST_AUTO_TEST_CASE(a_download_ends_with_its_fetch_and_where_the_other_side_is_too_slow)
{
    LowSpeed const low_speed(7, std::chrono::seconds(8));
    std::atomic<bool> const aborted = false;
    FetchDeadline deadline(&aborted, std::chrono::hours(1));
    auto const limits = deadline.limits(low_speed, 1000);
    BOOST_TEST(limits.aborted == &aborted);
    BOOST_TEST(limits.bytes == 1000u);
    BOOST_TEST(limits.low_speed.bytes == 7u);
    BOOST_TEST((limits.low_speed.time == std::chrono::seconds(8)));
    BOOST_TEST((limits.deadline != TimePoint::max()));
    deadline.restart();
    BOOST_TEST((deadline.limits(low_speed, 1000).deadline > limits.deadline));
}

BOOST_AUTO_TEST_CASE(who_waits_for_the_budget_says_so_and_is_stopped)
{
    auto const budget = make_fetch_budget(10, 10);
    FetchBytes all;
    all.memory = 10;
    BOOST_TEST_REQUIRE(budget->take(all));
    std::vector<bool> told;
    FetchDeadline const deadline(nullptr, std::chrono::seconds(-1));
    FetchShare share(budget, deadline.waiting([&](bool waits) { told.push_back(waits); }));
    auto const taken = share.take(all);
    BOOST_TEST((taken.has_error() && taken.error() == errc::timed_out));
    BOOST_TEST((told == std::vector{true, false}));
    budget->give_back(all);
}

BOOST_AUTO_TEST_SUITE_END()
