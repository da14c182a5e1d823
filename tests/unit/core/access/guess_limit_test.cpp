#include "unit_test.hpp"

#include <webots_cloud/guess_limit.hpp>

#include <string>

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(guess_limit)

BOOST_AUTO_TEST_CASE(a_client_that_guesses_may_try_no_more_and_others_may)
{
    GuessLimit limit({3, 0.1}, {100, 1});
    TimePoint const now{1000s};
    for (int i = 0; i < 3; ++i) {
        BOOST_TEST(limit.may_try("a", now));
        limit.count_wrong("a", now);
    }
    BOOST_TEST(!limit.may_try("a", now));
    BOOST_TEST(limit.may_try("b", now));
    BOOST_TEST(!limit.may_try("a", now + 9s));
    BOOST_TEST(limit.may_try("a", now + 10s));
    limit.count_wrong("a", now + 10s);
    BOOST_TEST(!limit.may_try("a", now + 10s));
}

// Nobody shuts out those who have guessed nothing.
BOOST_AUTO_TEST_CASE(many_addresses_gain_one_guess_each)
{
    GuessLimit limit({3, 0.1}, {20, 1});
    TimePoint const now{1000s};
    auto const guesses = [&limit](TimePoint when) {
        int tries = 0;
        for (int address = 0; address < 1000; ++address)
            if (auto const key = std::to_string(address); limit.may_try(key, when)) {
                limit.count_wrong(key, when);
                ++tries;
            }
        return tries;
    };
    BOOST_TEST(guesses(now) == 1000);
    BOOST_TEST(guesses(now) == 0);
    BOOST_TEST(limit.may_try("a stranger", now));
    BOOST_TEST(!limit.may_try("", now)); // that may be anybody
    BOOST_TEST(guesses(now + 1s) == 1);
    BOOST_TEST(guesses(now + 10s) == 9);
    BOOST_TEST(guesses(now + 2h) == 1000);
}

BOOST_AUTO_TEST_CASE(a_client_without_a_key_counts_among_all)
{
    GuessLimit limit({3, 0.1}, {20, 1});
    TimePoint const now{1000s};
    for (int i = 0; i < 20; ++i) {
        BOOST_TEST(limit.may_try("", now));
        limit.count_wrong("", now);
    }
    BOOST_TEST(!limit.may_try("", now));
}

BOOST_AUTO_TEST_SUITE_END()
