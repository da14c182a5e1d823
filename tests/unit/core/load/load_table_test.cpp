#include "unit_test.hpp"

#include "core/load/load_table.hpp"

using namespace webots_cloud;

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

} // namespace

// Protocol section 3, a case a row.
BOOST_AUTO_TEST_SUITE(poll_table)

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
    auto server = known(ServerState::up, 12);
    core::apply(server, Failure(errc::unreachable, "connection refused"), TimePoint());
    BOOST_TEST((server.state == ServerState::down));
    BOOST_TEST(server.report.load == 12);
    BOOST_TEST(server.problem == "connection refused");
    core::apply(server, LoadReport(3), TimePoint(std::chrono::seconds(9)));
    BOOST_TEST((server.state == ServerState::up));
    BOOST_TEST(server.problem.empty());
    BOOST_TEST((server.reported == TimePoint(std::chrono::seconds(9))));
}

BOOST_AUTO_TEST_SUITE_END()
