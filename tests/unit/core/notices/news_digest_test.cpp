#include "unit_test.hpp"

#include "core/notices/news_digest.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(news_digest)

namespace {

constexpr TimePoint start = TimePoint(100h);

core::News change(std::string sentence = "it changed")
{
    core::News news;
    news.sentence = std::move(sentence);
    return news;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_fall_and_its_end_are_told_at_once)
{
    core::NewsDigest digest;
    BOOST_TEST(digest.at_once("a", change(), start));
    BOOST_TEST(digest.at_once("a", change(), start + 5s));
    BOOST_TEST(!digest.due());
}

BOOST_AUTO_TEST_CASE(what_follows_is_one_digest_ten_minutes_after_its_first_news)
{
    core::NewsDigest digest;
    digest.at_once("a", change(), start);
    digest.at_once("a", change(), start + 5s);
    BOOST_TEST(!digest.at_once("a", change("third"), start + 10s));
    BOOST_TEST(!digest.at_once("a", change("fourth"), start + 15s));
    BOOST_TEST((digest.due() == start + 10s + 10min));
    auto const taken = digest.take();
    BOOST_TEST_REQUIRE(taken.news.size() == 2u);
    BOOST_TEST(taken.news[0].sentence == "third");
    BOOST_TEST(taken.news[1].sentence == "fourth");
    BOOST_TEST(taken.left_out == 0u);
    BOOST_TEST(!digest.due());
    BOOST_TEST(digest.take().news.empty());
}

BOOST_AUTO_TEST_CASE(a_server_that_never_calms_down_is_heard_of_once_in_ten_minutes)
{
    core::NewsDigest digest;
    int at_once = 0;
    int digests = 0;
    for (auto now = start; now < start + 10h; now += 5s) {
        at_once += digest.at_once("a", change(), now) ? 1 : 0;
        if (digest.due() && *digest.due() <= now) {
            ++digests;
            digest.take();
        }
    }
    BOOST_TEST(at_once == 2);
    BOOST_TEST(digests == 59);
}

BOOST_AUTO_TEST_CASE(ten_calm_minutes_make_news_urgent_again)
{
    core::NewsDigest digest;
    for (int i = 0; i < 3; ++i)
        digest.at_once("a", change(), start);
    BOOST_TEST(!digest.at_once("a", change(), start + 9min));
    BOOST_TEST(!digest.at_once("a", change(), start + 18min + 59s));
    BOOST_TEST(digest.at_once("a", change(), start + 28min + 59s));
}

BOOST_AUTO_TEST_CASE(servers_do_not_use_up_each_others_urgency)
{
    core::NewsDigest digest;
    for (int i = 0; i < 5; ++i)
        digest.at_once("a", change(), start);
    BOOST_TEST(digest.at_once("b", change(), start + 1s));
}

BOOST_AUTO_TEST_CASE(when_everything_falls_at_once_ten_are_told_and_the_rest_is_a_digest)
{
    core::NewsDigest digest;
    int at_once = 0;
    for (int i = 0; i < 400; ++i)
        at_once += digest.at_once(std::to_string(i), change(), start) ? 1 : 0;
    BOOST_TEST(at_once == 10);
    BOOST_TEST(digest.take().news.size() == 390u);
    BOOST_TEST(!digest.at_once("new", change(), start + 9min));
    BOOST_TEST(digest.at_once("new", change(), start + 19min));
}

BOOST_AUTO_TEST_CASE(a_digest_is_bounded_and_counts_what_it_lost)
{
    core::DigestRule rule;
    rule.longest = 3;
    core::NewsDigest digest(rule);
    for (int i = 0; i < 7; ++i)
        digest.at_once("a", change(std::to_string(i)), start);
    auto const taken = digest.take();
    BOOST_TEST_REQUIRE(taken.news.size() == 3u);
    BOOST_TEST(taken.news.front().sentence == "4");
    BOOST_TEST(taken.left_out == 2u);
    BOOST_TEST(digest.take().left_out == 0u);
}

BOOST_AUTO_TEST_SUITE_END()
