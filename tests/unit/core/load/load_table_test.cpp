#include "unit_test.hpp"

#include "core/load/load_table.hpp"

using namespace webots_cloud;

// Protocol section 3, a case a row.
BOOST_AUTO_TEST_SUITE(poll_table)

namespace {

constexpr double threshold = 95;

ServerLoad known(ServerState state, double load = 0)
{
    ServerLoad server("a:2000");
    server.state = state;
    server.report.load = load;
    return server;
}

LoadTransition after(ServerLoad const& before, result<LoadReport> const& outcome)
{
    return core::classify(before, outcome, threshold);
}

/// Of servers `a:2000`, `b:2000`, ...
std::string order_of(core::LoadTable const& table)
{
    std::string order;
    for (auto const& server : table.servers())
        order += server.address.substr(0, 1) + " ";
    return order;
}

} // namespace

BOOST_AUTO_TEST_CASE(the_first_failure_is_news_and_the_second_is_not)
{
    auto const refused = result<LoadReport>(Failure(errc::unreachable));
    BOOST_TEST((after(known(ServerState::up), refused) == LoadTransition::not_responding));
    BOOST_TEST((after(known(ServerState::unknown), refused) == LoadTransition::not_responding));
    BOOST_TEST((after(known(ServerState::down), refused) == LoadTransition::none));
}

BOOST_AUTO_TEST_CASE(running_out_of_time_has_its_own_line)
{
    auto const slow = result<LoadReport>(Failure(errc::timed_out));
    BOOST_TEST((after(known(ServerState::up), slow) == LoadTransition::too_slow));
    BOOST_TEST((after(known(ServerState::down), slow) == LoadTransition::none));
}

BOOST_AUTO_TEST_CASE(an_answer_after_a_failure_means_up_and_running_again_even_when_full)
{
    BOOST_TEST((after(known(ServerState::down), LoadReport(5)) == LoadTransition::working_again));
    BOOST_TEST((after(known(ServerState::down), LoadReport(99)) == LoadTransition::working_again));
}

BOOST_AUTO_TEST_CASE(crossing_the_threshold_is_news_in_both_directions)
{
    BOOST_TEST((after(known(ServerState::up, 94.9), LoadReport(95)) == LoadTransition::reached_maximum));
    BOOST_TEST((after(known(ServerState::up, 95), LoadReport(94.9)) == LoadTransition::available_again));
    BOOST_TEST((after(known(ServerState::up, 95), LoadReport(96)) == LoadTransition::none));
    BOOST_TEST((after(known(ServerState::up, 5), LoadReport(6)) == LoadTransition::none));
}

BOOST_AUTO_TEST_CASE(a_new_server_counts_as_idle_before_its_first_answer)
{
    BOOST_TEST((after(known(ServerState::unknown), LoadReport(5)) == LoadTransition::none));
    BOOST_TEST((after(known(ServerState::unknown), LoadReport(95)) == LoadTransition::reached_maximum));
}

BOOST_AUTO_TEST_CASE(a_failed_poll_keeps_the_last_report_and_says_why)
{
    core::LoadTable table;
    table.put("a:2000");
    auto const& server = table.servers().front();
    table.record("a:2000", LoadReport(12), threshold, TimePoint());
    auto const event = table.record("a:2000", Failure(errc::unreachable, "connection refused"), threshold,
                                    TimePoint(std::chrono::seconds(5)));
    BOOST_TEST((event.transition == LoadTransition::not_responding));
    BOOST_TEST(event.server.problem == "connection refused");
    BOOST_TEST((server.state == ServerState::down));
    BOOST_TEST(server.report.load == 12);
    BOOST_TEST((server.reported == TimePoint()));
    BOOST_TEST(server.problem == "connection refused");
    table.record("a:2000", LoadReport(3), threshold, TimePoint(std::chrono::seconds(9)));
    BOOST_TEST((server.state == ServerState::up));
    BOOST_TEST(server.problem.empty());
    BOOST_TEST((server.reported == TimePoint(std::chrono::seconds(9))));
}

BOOST_AUTO_TEST_CASE(a_failure_is_repeated_only_when_it_is_for_the_same_reason)
{
    core::LoadTable table;
    table.put("a:2000");
    auto const is_repeated = [&](result<LoadReport> const& outcome) {
        return table.record("a:2000", outcome, threshold, TimePoint()).is_repeated;
    };
    result<LoadReport> const refused = Failure(errc::unreachable, "connection refused");
    result<LoadReport> const slow = Failure(errc::timed_out);
    BOOST_TEST(!is_repeated(refused));
    BOOST_TEST(is_repeated(refused));
    BOOST_TEST(!is_repeated(slow));
    BOOST_TEST(!is_repeated(LoadReport(3)));
    BOOST_TEST(!is_repeated(LoadReport(3)));
    BOOST_TEST(!is_repeated(slow));
}

BOOST_AUTO_TEST_CASE(servers_come_where_they_belong_and_keep_what_is_known_of_them)
{
    core::LoadTable table;
    BOOST_TEST(table.put("a:2000"));
    BOOST_TEST(table.put("c:2000", ""));
    BOOST_TEST(table.put("b:2000", "c:2000"));
    BOOST_TEST(table.put("d:2000", "gone:2000"));
    BOOST_TEST(order_of(table) == "a b c d ");
    auto const* const kept = table.find("b:2000");
    table.record("b:2000", LoadReport(7), threshold, TimePoint());
    BOOST_TEST(!table.put("b:2000"));
    BOOST_TEST(order_of(table) == "a b c d ");
    BOOST_TEST(!table.put("b:2000", "a:2000"));
    BOOST_TEST(!table.put("b:2000", "a:2000"));
    BOOST_TEST(!table.put("d:2000", "d:2000"));
    BOOST_TEST(order_of(table) == "b a c d ");
    table.remove("a:2000");
    table.remove("a:2000");
    BOOST_TEST(order_of(table) == "b c d ");
    BOOST_TEST(table.find("b:2000") == kept);
    BOOST_TEST(kept->report.load == 7);
    BOOST_TEST(!table.find("a:2000"));
}

BOOST_AUTO_TEST_CASE(what_was_removed_is_forgotten)
{
    core::LoadTable table;
    table.put("a:2000");
    table.record("a:2000", LoadReport(7), threshold, TimePoint());
    table.remove("a:2000");
    BOOST_TEST(table.put("a:2000"));
    LoadTotals expected;
    expected.unknown = 1;
    BOOST_TEST((table.totals() == expected));
}

BOOST_AUTO_TEST_SUITE_END()
