#include "unit_test.hpp"

#include "core/access/token_buckets.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::TokenBuckets;

BOOST_TEST_DONT_PRINT_LOG_VALUE(TokenBuckets::Verdict)

BOOST_AUTO_TEST_SUITE(token_buckets)

using Verdict = TokenBuckets::Verdict;

namespace {

constexpr TimePoint start(1h);

/// How many of `times` requests of a client are admitted.
int taken(TokenBuckets& buckets, std::string_view client, TimePoint now, int times)
{
    int count = 0;
    for (int i = 0; i < times; ++i)
        count += buckets.take(client, now) == Verdict::taken ? 1 : 0;
    return count;
}

std::string stranger(int number)
{
    return "2001:" + std::to_string(number / 10'000) + ":" + std::to_string(number % 10'000) + "::/64";
}

} // namespace

BOOST_AUTO_TEST_CASE(whether_there_is_a_token_can_be_asked_without_taking_it)
{
    TokenBuckets buckets(2, 1);
    for (int i = 0; i < 5; ++i)
        BOOST_TEST(buckets.has_token("a", start));
    BOOST_TEST(taken(buckets, "a", start, 2) == 2);
    BOOST_TEST(!buckets.has_token("a", start));
    BOOST_TEST(buckets.has_token("b", start));
    BOOST_TEST(!buckets.has_token("a", start + 999ms));
    BOOST_TEST(buckets.has_token("a", start + 1s));
    BOOST_TEST(buckets.has_token("", start));
    BOOST_TEST(TokenBuckets().has_token("a", start));
}

BOOST_AUTO_TEST_CASE(a_class_asks_at_once_and_then_so_often_a_second)
{
    TokenBuckets buckets(200, 10);
    BOOST_TEST(taken(buckets, "a", start, 300) == 200);
    BOOST_TEST(taken(buckets, "a", start + 99ms, 5) == 0);
    BOOST_TEST(taken(buckets, "a", start + 100ms, 5) == 1);
    BOOST_TEST(taken(buckets, "a", start + 1s, 50) == 9);
    BOOST_TEST(taken(buckets, "b", start + 1s, 300) == 200);
    BOOST_TEST(taken(buckets, "a", start + 21s, 300) == 200);
    BOOST_TEST(taken(buckets, "a", start + 24h, 300) == 200, "no more gathers than fits");
}

BOOST_AUTO_TEST_CASE(the_first_refusal_is_told_until_the_bucket_was_full_again)
{
    TokenBuckets buckets(2, 1);
    BOOST_TEST(taken(buckets, "a", start, 2) == 2);
    BOOST_TEST(buckets.take("a", start) == Verdict::refused_first);
    BOOST_TEST(buckets.take("a", start) == Verdict::refused);
    BOOST_TEST(buckets.take("a", start + 1s) == Verdict::taken);
    BOOST_TEST(buckets.take("a", start + 1s) == Verdict::refused);
    BOOST_TEST(taken(buckets, "a", start + 3s, 2) == 2);
    BOOST_TEST(buckets.take("a", start + 3s) == Verdict::refused_first);
}

BOOST_AUTO_TEST_CASE(nobody_and_a_budget_of_0_are_not_counted)
{
    TokenBuckets buckets(1, 1);
    BOOST_TEST(taken(buckets, "", start, 10) == 10);
    for (auto off : {TokenBuckets(), TokenBuckets(0, 10), TokenBuckets(10, 0)}) {
        BOOST_TEST(taken(off, "a", start, 1000) == 1000);
        BOOST_TEST(off.size() == 0u);
    }
}

BOOST_AUTO_TEST_CASE(extreme_budgets_are_kept)
{
    TokenBuckets slow(100'000, 0.01);
    BOOST_TEST(taken(slow, "a", start, 100'001) == 100'000);
    BOOST_TEST(taken(slow, "a", start + 100s, 5) == 1);
    TokenBuckets fast(1, 100'000);
    BOOST_TEST(taken(fast, "a", start, 5) == 1);
    BOOST_TEST(taken(fast, "a", start + 10us, 5) == 1);
}

BOOST_AUTO_TEST_CASE(a_million_addresses_find_a_small_table_and_are_not_locked_out)
{
    TokenBuckets buckets(200, 10, 10'000);
    std::size_t max = 0;
    int refused = 0;
    for (int i = 0; i < 1'000'000; ++i) {
        refused += buckets.take(stranger(i), start) == Verdict::taken ? 0 : 1;
        max = std::max(max, buckets.size());
    }
    BOOST_TEST(max <= 10'000u); // networks, each with two wider ones
    BOOST_TEST(max > 9'900u);
    BOOST_TEST(refused == 0);
    BOOST_TEST(taken(buckets, "newcomer", start, 300) == 200);
}

BOOST_AUTO_TEST_CASE(who_asks_too_much_is_remembered_among_many_who_ask_little)
{
    TokenBuckets buckets(200, 10, 1000);
    BOOST_TEST(taken(buckets, "greedy", start, 300) == 200);
    for (int i = 0; i < 100'000; ++i)
        (void)buckets.take(stranger(i), start);
    BOOST_TEST(taken(buckets, "greedy", start, 10) == 0);
}

BOOST_AUTO_TEST_CASE(full_buckets_go_first)
{
    TokenBuckets buckets(2, 1, 10);
    for (int i = 0; i < 9; ++i)
        (void)buckets.take("stranger " + std::to_string(i), start);
    BOOST_TEST(taken(buckets, "busy", start, 5) == 2);
    BOOST_TEST(buckets.size() == 10u);
    BOOST_TEST(taken(buckets, "new", start + 1500ms, 1) == 1);
    BOOST_TEST(buckets.size() == 2u);
    BOOST_TEST(taken(buckets, "busy", start + 1500ms, 5) == 1);
}

BOOST_AUTO_TEST_SUITE_END()
