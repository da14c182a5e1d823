#include "unit_test.hpp"

#include "guess_limit.hpp"

#include <string>

using website_host::GuessLimit;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(website_guesses)

BOOST_AUTO_TEST_CASE(who_has_guessed_wrong_too_often_waits_and_others_do_not)
{
    GuessLimit limit;
    GuessLimit::TimePoint now(1h);
    for (int i = 0; i < GuessLimit::burst; ++i) {
        BOOST_TEST(limit.may_guess("a", now), i);
        limit.was_wrong("a", now);
    }
    BOOST_TEST(!limit.may_guess("a", now));
    BOOST_TEST(limit.may_guess("b", now));
    now += GuessLimit::interval - 1ms;
    BOOST_TEST(!limit.may_guess("a", now));
    now += 1ms;
    BOOST_TEST(limit.may_guess("a", now));
    limit.was_wrong("a", now);
    BOOST_TEST(!limit.may_guess("a", now));
}

BOOST_AUTO_TEST_CASE(a_proxy_that_names_nobody_is_no_client)
{
    GuessLimit limit;
    GuessLimit::TimePoint const now(1h);
    for (int i = 0; i < 100; ++i)
        limit.was_wrong("", now);
    BOOST_TEST(limit.may_guess("", now));
    BOOST_TEST(limit.size() == 0u);
}

BOOST_AUTO_TEST_CASE(the_table_has_a_limit)
{
    GuessLimit limit;
    GuessLimit::TimePoint now(1h);
    for (std::size_t i = 0; i < GuessLimit::max_clients + 10; ++i)
        limit.was_wrong(std::to_string(i), now);
    BOOST_TEST(limit.size() <= GuessLimit::max_clients);
}

BOOST_AUTO_TEST_SUITE_END()
