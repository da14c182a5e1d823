#include "unit_test.hpp"

#include "core/waiting/wait_estimate.hpp"

#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/gamma.hpp>

#include <cmath>

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::WaitEstimate;
using core::WaitRange;

BOOST_AUTO_TEST_SUITE(wait_estimate)

namespace {

constexpr TimePoint start{1000h};

double seconds(Duration time)
{
    return std::chrono::duration<double>(time).count();
}

/// After so many sessions of a minute, ten at a time, which end one after the other.
WaitEstimate after(int departures, TimePoint& now)
{
    WaitEstimate estimate;
    now = start;
    for (int i = 0; i < 10; ++i)
        estimate.session_began(now);
    for (int i = 0; i < departures; ++i) {
        now += 6s; // ten sessions of a minute
        estimate.session_ended(now);
        estimate.session_began(now);
    }
    return estimate;
}

} // namespace

BOOST_AUTO_TEST_CASE(before_five_departures_there_is_none)
{
    BOOST_TEST(!WaitEstimate().expect(0, start));
    TimePoint now;
    BOOST_TEST(!after(4, now).expect(0, now));
    BOOST_TEST(after(5, now).expect(0, now).has_value());
}

// People read 10, then 15, then 20 seconds.
BOOST_AUTO_TEST_CASE(what_somebody_was_told_is_not_taken_back_while_nobody_leaves)
{
    TimePoint now;
    auto const estimate = after(5, now);
    BOOST_TEST((estimate.expect(0, now + 30s)->most > estimate.expect(0, now)->most), "made anew it grows");
    core::WaitTold told;
    auto const first = rounded(*told.tell(0, estimate.expect(0, now), now));
    BOOST_TEST((first == rounded(*estimate.expect(0, now))));
    auto before = first;
    for (auto waited = 1s; waited < first.most; waited += 1s) {
        auto const range = told.tell(0, estimate.expect(0, now + waited), now + waited);
        BOOST_TEST_REQUIRE(range.has_value());
        BOOST_TEST(((waited + range->most) == first.most), "it counts down");
        BOOST_TEST((rounded(*range).least <= before.least && rounded(*range).most <= before.most));
        before = rounded(*range);
    }
    BOOST_TEST(!told.tell(0, estimate.expect(0, now + first.most), now + first.most),
               "nobody knows any more");
    auto const later = now + 3 * first.most;
    BOOST_TEST(!told.tell(0, estimate.expect(0, later), later));
}

BOOST_AUTO_TEST_CASE(another_place_is_another_wait)
{
    auto const range = [](auto least, auto most) { return WaitRange{least, most}; };
    core::WaitTold told;
    told.tell(3, range(60s, 120s), start);
    BOOST_TEST((*told.tell(2, range(60s, 150s), start + 60s) == range(0s, 60s)),
               "better: no longer than said");
    BOOST_TEST((*told.tell(2, range(5s, 10s), start + 60s) == range(0s, 10s)), "and perhaps shorter");
    BOOST_TEST((*told.tell(4, range(60s, 150s), start + 60s) == range(60s, 150s)), "somebody came before");
    BOOST_TEST(!told.tell(4, range(60s, 150s), start + 60s + 150s));
    BOOST_TEST((*told.tell(3, range(30s, 60s), start + 220s) == range(30s, 60s)), "it goes on after all");
    BOOST_TEST(!told.tell(3, std::nullopt, start + 221s));
    told.forget();
    BOOST_TEST((*told.tell(3, range(2min, 4min), start + 222s) == range(2min, 4min)), "for something else");
}

BOOST_AUTO_TEST_CASE(while_nothing_runs_there_is_none)
{
    TimePoint now;
    auto estimate = after(20, now);
    BOOST_TEST(estimate.running() == 10u);
    for (int i = 0; i < 10; ++i)
        estimate.session_ended(now);
    BOOST_TEST(estimate.running() == 0u);
    BOOST_TEST(!estimate.expect(0, now));
    estimate.session_ended(now); // of one that it never saw
    BOOST_TEST(estimate.running() == 0u);
}

BOOST_AUTO_TEST_CASE(after_many_departures_it_is_the_gamma_distribution)
{
    TimePoint now;
    auto const estimate = after(20'000, now);
    for (std::size_t const ahead : {0u, 1u, 9u, 99u}) {
        boost::math::gamma_distribution<> const wait(static_cast<double>(ahead) + 1, 6); // a departure in 6 s
        auto const range = estimate.expect(ahead, now).value();
        BOOST_TEST(std::abs(cdf(wait, seconds(range.least)) - 0.1) < 0.01);
        BOOST_TEST(std::abs(cdf(wait, seconds(range.most)) - 0.9) < 0.01);
    }
}

BOOST_AUTO_TEST_CASE(after_few_departures_the_range_is_wider)
{
    TimePoint now;
    auto const many = after(500, now).expect(9, now).value();
    auto const estimate = after(5, now);
    auto const few = estimate.expect(9, now).value();
    BOOST_TEST(seconds(few.least) < seconds(many.least));
    BOOST_TEST(seconds(few.most) > 1.3 * seconds(many.most));
    for (std::size_t const ahead : {0u, 1u, 9u, 99u}) {
        auto const awaited = static_cast<double>(ahead) + 1;
        boost::math::fisher_f_distribution<> const ratio(2 * awaited, 2 * 5);
        auto const range = estimate.expect(ahead, now).value();
        BOOST_TEST(std::abs(cdf(ratio, seconds(range.least) / (6 * awaited)) - 0.1) < 0.01);
        BOOST_TEST(std::abs(cdf(ratio, seconds(range.most) / (6 * awaited)) - 0.9) < 0.01);
    }
}

BOOST_AUTO_TEST_CASE(sessions_that_go_on_count_too)
{
    TimePoint now;
    auto const estimate = after(20, now);
    auto const at_once = estimate.expect(0, now).value();
    auto const later = estimate.expect(0, now + 2min).value();
    BOOST_TEST(seconds(later.most) > 1.5 * seconds(at_once.most));
}

BOOST_AUTO_TEST_CASE(what_was_hours_ago_is_forgotten)
{
    TimePoint now;
    auto estimate = after(600, now); // an hour
    for (int i = 0; i < 600; ++i) {  // and then five of sessions ten times as long
        now += 30s;
        estimate.session_ended(now);
        estimate.session_began(now);
    }
    auto const tenth = estimate.expect(9, now).value();
    BOOST_TEST(seconds(tenth.least) == 30 * 6.2213, boost::test_tools::tolerance(0.1));
    BOOST_TEST(!estimate.expect(0, now + 8h), "without any departure");
}

BOOST_AUTO_TEST_CASE(a_large_room_is_no_problem)
{
    TimePoint now;
    auto const estimate = after(100, now);
    auto const last = estimate.expect(9999, now).value();
    BOOST_TEST(seconds(last.least) > 6 * 9999 * 0.7);
    BOOST_TEST(seconds(last.most) < 6 * 9999 * 1.4);
    auto const beyond = estimate.expect(1'000'000'000, now).value();
    BOOST_TEST(seconds(beyond.most) == 86400.0, "a day at most");
}

BOOST_AUTO_TEST_CASE(ranges_are_rounded)
{
    auto const is = [](WaitRange range, WaitRange wanted) {
        auto const given = core::rounded(range);
        BOOST_TEST(seconds(given.least) == seconds(wanted.least));
        BOOST_TEST(seconds(given.most) == seconds(wanted.most));
    };
    is({0s, 0s}, {0s, 5s});
    is({4900ms, 5100ms}, {0s, 10s});
    is({5s, 10s}, {5s, 10s});
    is({59s, 59s}, {55s, 1min});
    is({61s, 61s}, {1min, 90s});
    is({119s, 4min + 46s}, {90s, 5min});
    is({5min + 59s, 14min + 1s}, {5min, 15min});
    is({19min, 58min}, {15min, 1h});
    is({67min, 77min}, {1h, 90min});
    is({4h + 59min, 30h}, {4h, 24h});
    is({30h, 40h}, {24h, 24h});
}

BOOST_AUTO_TEST_SUITE_END()
