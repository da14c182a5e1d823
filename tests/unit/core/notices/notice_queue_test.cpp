#include "unit_test.hpp"

#include "core/notices/notice_queue.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(notice_queue)

namespace {

constexpr TimePoint start = TimePoint(100h);

Notice notice(int number)
{
    return {std::to_string(number), {}};
}

} // namespace

BOOST_AUTO_TEST_CASE(notices_leave_in_order_as_soon_as_they_come)
{
    core::NoticeQueue queue;
    BOOST_TEST(!queue.due());
    queue.push(notice(1));
    queue.push(notice(2));
    BOOST_TEST((*queue.due() <= start));
    BOOST_TEST(queue.attempt().notice.subject == "1");
    queue.delivered(queue.attempt());
    BOOST_TEST((*queue.due() <= start));
    BOOST_TEST(queue.attempt().notice.subject == "2");
    queue.delivered(queue.attempt());
    BOOST_TEST(!queue.due());
    BOOST_TEST(queue.empty());
}

BOOST_AUTO_TEST_CASE(each_failure_in_a_row_doubles_the_wait_up_to_a_quarter_of_an_hour)
{
    core::NoticeQueue queue;
    queue.push(notice(1));
    for (Duration const wait : {15s, 30s, 60s, 120s, 240s, 480s, 900s, 900s, 900s}) {
        BOOST_TEST(!queue.failed(queue.attempt(), errc::unreachable, start));
        BOOST_TEST((*queue.due() == start + wait));
    }
    BOOST_TEST(queue.attempt().notice.subject == "1");
}

BOOST_AUTO_TEST_CASE(a_retry_is_due_at_once_and_failures_count_anew)
{
    core::NoticeQueue queue;
    queue.push(notice(1));
    for (int i = 0; i < 5; ++i)
        BOOST_TEST(!queue.failed(queue.attempt(), errc::refused, start));
    queue.retry();
    BOOST_TEST((*queue.due() <= start));
    BOOST_TEST(!queue.failed(queue.attempt(), errc::refused, start));
    BOOST_TEST((*queue.due() == start + 15s));
}

BOOST_AUTO_TEST_CASE(what_was_taken_out_during_an_attempt_does_not_come_back)
{
    core::NoticeQueue queue;
    queue.push(notice(1));
    queue.push(notice(2));
    auto const attempt = queue.attempt();
    BOOST_TEST(queue.clear().size() == 2u);
    BOOST_TEST(queue.empty());
    queue.push(notice(3));
    queue.delivered(attempt);
    BOOST_TEST(queue.attempt().notice.subject == "3");
}

BOOST_AUTO_TEST_CASE(news_do_not_wake_a_mail_server_that_is_down)
{
    core::NoticeQueue queue;
    queue.push(notice(1));
    queue.failed(queue.attempt(), errc::timed_out, start);
    queue.push(notice(2));
    BOOST_TEST((*queue.due() == start + 15s));
}

BOOST_AUTO_TEST_CASE(a_success_ends_the_waiting)
{
    core::NoticeQueue queue;
    queue.push(notice(1));
    queue.push(notice(2));
    queue.failed(queue.attempt(), errc::unreachable, start);
    queue.failed(queue.attempt(), errc::unreachable, start);
    queue.delivered(queue.attempt());
    BOOST_TEST((*queue.due() <= start));
    queue.failed(queue.attempt(), errc::unreachable, start);
    BOOST_TEST((*queue.due() == start + 15s));
}

BOOST_AUTO_TEST_CASE(a_notice_that_is_refused_again_and_again_is_given_up)
{
    core::NoticeQueue queue;
    queue.push(notice(1));
    queue.push(notice(2));
    for (int i = 1; i < 6; ++i)
        BOOST_TEST(!queue.failed(queue.attempt(), errc::refused, start), i);
    auto const given_up = queue.failed(queue.attempt(), errc::refused, start);
    BOOST_TEST_REQUIRE(given_up.has_value());
    BOOST_TEST(given_up->subject == "1");
    BOOST_TEST(queue.attempt().notice.subject == "2");
    BOOST_TEST(!queue.failed(queue.attempt(), errc::refused, start));
}

BOOST_AUTO_TEST_CASE(beyond_fifty_the_oldest_is_dropped)
{
    core::NoticeQueue queue;
    for (int i = 0; i < 50; ++i)
        BOOST_TEST(!queue.push(notice(i)));
    auto const dropped = queue.push(notice(50));
    BOOST_TEST_REQUIRE(dropped.has_value());
    BOOST_TEST(dropped->subject == "0");
    BOOST_TEST(queue.waiting().size() == 50u);
}

BOOST_AUTO_TEST_CASE(the_end_of_an_attempt_at_a_dropped_notice_does_not_touch_the_next_one)
{
    core::RetryRule rule;
    rule.longest = 1;
    core::NoticeQueue queue(rule);
    queue.push(notice(1));
    auto const attempt = queue.attempt();
    queue.push(notice(2));
    queue.delivered(attempt);
    BOOST_TEST(queue.attempt().notice.subject == "2");
    auto const next = queue.attempt();
    queue.push(notice(3));
    for (int i = 0; i < 9; ++i)
        BOOST_TEST(!queue.failed(next, errc::refused, start));
    BOOST_TEST(queue.attempt().notice.subject == "3");
}

BOOST_AUTO_TEST_SUITE_END()
