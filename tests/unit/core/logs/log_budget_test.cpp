#include "core/logs/log_budget.hpp"
#include "unit_test.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::LogBudget;

namespace {

struct LogBudgetFixture
{
    bool take(LogCause const& cause, std::string_view line, LogLevel level = LogLevel::error)
    {
        bool const written = budget.take(now, level, cause, line);
        if (written)
            bytes += line.size();
        return written;
    }

    int take_many(int count, LogCause const& cause, std::string_view line, LogLevel level = LogLevel::error)
    {
        int written = 0;
        for (int i = 0; i < count; ++i)
            written += take(cause, line, level) ? 1 : 0;
        return written;
    }

    LogBudget budget;
    TimePoint now{1000s};
    std::size_t bytes = 0;
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(log_budget, LogBudgetFixture)

BOOST_AUTO_TEST_CASE(a_client_gets_ten_lines_and_then_one_a_minute_with_their_number)
{
    LogCause const cause("failure", "7");
    BOOST_TEST(take_many(323, cause, "[7] No such file") == 10);
    now += 59s;
    BOOST_TEST(budget.sum_up(now).empty());
    now += 1s;
    auto const first = budget.sum_up(now);
    BOOST_TEST_REQUIRE(first.size() == 1u);
    BOOST_TEST(first[0].second == "[7] No such file (312 more like this in the last 60 s)");
    BOOST_TEST((first[0].first == LogLevel::error));
    BOOST_TEST(take_many(100, cause, "[7] No such file") == 0);
    now += 60s;
    BOOST_TEST(budget.sum_up(now).size() == 1u);
}

BOOST_AUTO_TEST_CASE(a_client_that_was_quiet_for_a_minute_starts_again)
{
    LogCause const cause("failure", "7");
    BOOST_TEST(take_many(20, cause, "line") == 10);
    now += 60s;
    BOOST_TEST(budget.sum_up(now).size() == 1u);
    now += 60s;
    BOOST_TEST(budget.sum_up(now).empty());
    BOOST_TEST(take_many(20, cause, "line") == 10);
}

BOOST_AUTO_TEST_CASE(other_texts_get_no_more_lines_and_the_last_of_them_is_told)
{
    LogCause const cause("failure", "7");
    int written = 0;
    for (int i = 0; i < 100; ++i)
        written += take(cause, std::to_string(i)) ? 1 : 0;
    BOOST_TEST(written == 10);
    now += 60s;
    BOOST_TEST(budget.sum_up(now).front().second == "99 (89 more like this in the last 60 s)");
}

BOOST_AUTO_TEST_CASE(a_single_line_that_was_left_out_is_told_as_it_was)
{
    BOOST_TEST(take_many(11, LogCause("failure", "7"), "line") == 10);
    now += 60s;
    BOOST_TEST(budget.sum_up(now).front().second == "line");
}

BOOST_AUTO_TEST_CASE(one_client_takes_no_line_of_another)
{
    (void)take_many(100'000, LogCause("failure", "7"), std::string(500, 'x'));
    BOOST_TEST(take_many(10, LogCause("failure", "8"), "line") == 10);
    BOOST_TEST(take_many(10, LogCause("answer", "7"), "line") == 10);
}

BOOST_AUTO_TEST_CASE(many_clients_share_a_budget_and_what_is_over_it_is_counted_by_topic)
{
    for (int i = 0; i < 100'000; ++i)
        (void)take(LogCause("failure", std::to_string(i)), std::string(500, 'x'));
    BOOST_TEST(bytes <= 100'000u);
    now += 60s;
    auto const lines = budget.sum_up(now);
    BOOST_TEST_REQUIRE(lines.size() == 1u);
    BOOST_TEST(lines[0].second.ends_with(" more like this in the last 60 s)"), lines[0].second);
}

BOOST_AUTO_TEST_CASE(visits_and_failures_have_a_budget_each)
{
    LogCause const visit("client");
    int const visits = take_many(100'000, visit, "[1] New client", LogLevel::info);
    BOOST_TEST(visits > 5'000);
    BOOST_TEST(visits < 10'000);
    BOOST_TEST(take(LogCause("failure", "7"), "line"));
    BOOST_TEST(!take(visit, "[1] New client", LogLevel::info));
}

BOOST_AUTO_TEST_CASE(a_day_of_refusals_is_less_than_the_files_of_the_log_hold)
{
    std::uint64_t told = 0;
    for (int second = 0; second < 24 * 3600; ++second, now += 1s) {
        for (int i = 0; i < 20; ++i)
            (void)take(LogCause("failure", std::to_string(20 * second + i)), std::string(300, 'x'));
        if (second % 10 == 0)
            for (auto const& [level, line] : budget.sum_up(now))
                told += line.size();
    }
    BOOST_TEST(bytes + told < 5'500'000u);
}

BOOST_AUTO_TEST_CASE(the_budget_comes_back_with_time)
{
    LogCause const cause("failure");
    (void)take_many(100'000, cause, "line");
    BOOST_TEST(!take(cause, "line"));
    now += 10s;
    BOOST_TEST(take(cause, "line"));
}

BOOST_AUTO_TEST_CASE(what_nobody_has_told_yet_is_told_at_the_end)
{
    (void)take_many(30, LogCause("failure", "7"), "a");
    (void)take_many(30, LogCause("failure", "8"), "b");
    now += 5s;
    auto const lines = budget.sum_up_everything(now);
    BOOST_TEST_REQUIRE(lines.size() == 1u);
    BOOST_TEST(lines[0].second == "b (39 more like this in the last 5 s)");
    BOOST_TEST(budget.sum_up_everything(now).empty());
}

BOOST_AUTO_TEST_CASE(a_long_client_and_a_text_that_is_cut_in_a_character_do_no_harm)
{
    std::string const robots = "x" + [] {
        std::string text;
        for (int i = 0; i < 400; ++i)
            text += "\xf0\x9f\xa4\x96";
        return text;
    }();
    (void)take_many(12, LogCause("failure", std::string(100'000, 'c')), robots);
    now += 60s;
    auto const line = budget.sum_up(now).front().second;
    BOOST_TEST(line.size() < 2'000u);
    BOOST_TEST(line.ends_with(" (1 more like this in the last 60 s)"));
}

BOOST_AUTO_TEST_SUITE_END()
