#include "unit_test.hpp"

#include "core/json_text.hpp"
#include "core/pages/session_board.hpp"

#include <cmath>
#include <limits>

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

namespace {

constexpr TimePoint start(1h);
constexpr WallTime wall(1'700'000'000s);

SessionRow row(std::string address, std::optional<double> load, TimePoint reported = start)
{
    SessionRow row;
    row.address = std::move(address);
    row.load = load;
    row.reported = reported;
    return row;
}

/// One that is up where it has a load.
ServerLoad server(std::string address, std::optional<double> load, std::string problem = {},
                  TimePoint reported = start)
{
    ServerLoad server(std::move(address));
    server.state = load ? ServerState::up : ServerState::down;
    server.report.load = load.value_or(0);
    server.reported = reported;
    server.problem = std::move(problem);
    return server;
}

} // namespace

// Protocol section 2.4, live.
BOOST_AUTO_TEST_SUITE(session_board)

BOOST_AUTO_TEST_CASE(rows_say_what_is_known_and_nothing_more)
{
    auto down = server("b:1", {}, "refused");
    down.report.load = 40; // from better days
    auto up = server("a:1", 12.5);
    up.report.sessions = 3;
    auto const shown = session_row(up, 0);
    BOOST_TEST(shown.load.value() == 12.5);
    BOOST_TEST(shown.sessions.value() == 3);
    BOOST_TEST(shown.placed == 0u);
    auto const failed = session_row(down, 7);
    BOOST_TEST(!failed.load.has_value());
    BOOST_TEST(failed.problem == "refused");
    BOOST_TEST(failed.placed == 7u);
    auto const unknown = session_row(ServerLoad("c:1"), 0);
    BOOST_TEST((!unknown.load && unknown.problem.empty()));
}

BOOST_AUTO_TEST_CASE(who_comes_gets_everything)
{
    SessionBoard board(5s, 95);
    auto hostile = row("b\"</script>:1", {});
    hostile.problem = "bad\n";
    hostile.placed = 2;
    board.list({row("a:1", 7.875, start - 2s), hostile});
    board.take(start, wall);
    BOOST_TEST(board.snapshot() ==
               R"({"now":1700000000,"threshold":95,"last":0,"spacing":5,"servers":[)"
               R"({"address":"a:1","load":7.88,"placed":0,"age":2,"history":[7.9]},)"
               R"({"address":"b\"</script>:1","load":null,"placed":2,"problem":"bad\n","history":[null]}]})");
    BOOST_TEST(board.update() == board.snapshot()); // servers are listed that were not
}

BOOST_AUTO_TEST_CASE(an_update_names_only_the_rows_that_changed)
{
    SessionBoard board(5s, 95);
    board.list({row("a:1", 1), row("b:1", 2)});
    board.take(start, wall);
    board.take(start + 1s, wall + 1s);
    BOOST_TEST(board.update().empty());
    board.note(server("b:1", 2.5, {}, start + 1s)); // two polls, one row
    board.note(server("b:1", 3, {}, start + 2s));
    board.take(start + 2s, wall + 2s);
    BOOST_TEST(board.update() == R"({"now":1700000002,"rows":[{"row":1,"load":3,"placed":0,"age":0}]})");
    board.take(start + 5s, wall + 5s);
    BOOST_TEST(board.update() == R"({"now":1700000005,"point":true,"rows":[]})");
}

BOOST_AUTO_TEST_CASE(a_server_that_stays_down_for_the_same_reason_is_told_once)
{
    SessionBoard board(5s, 95);
    board.list({row("a:1", 1)});
    board.take(start, wall);
    board.note(server("a:1", {}, "refused"));
    board.take(start + 1s, wall + 1s);
    BOOST_TEST(board.update() ==
               R"({"now":1700000001,"rows":[{"row":0,"load":null,"placed":0,"problem":"refused"}]})");
    board.note(server("a:1", {}, "refused"));
    board.take(start + 2s, wall + 2s);
    BOOST_TEST(board.update().empty());
    board.note(server("a:1", {}, "no answer"));
    board.take(start + 3s, wall + 3s);
    BOOST_TEST(board.update().find("no answer") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(sessions_placed_are_told_when_they_are_counted)
{
    SessionBoard board(5s, 95);
    board.list({row("a:1", 1, start), row("b:1", 2, start)});
    board.take(start, wall);
    board.count_placed([](std::string_view address) { return address == "b:1" ? 4u : 0u; });
    board.take(start + 1s, wall + 1s);
    BOOST_TEST(board.update() == R"({"now":1700000001,"rows":[{"row":1,"load":2,"placed":4,"age":1}]})");
}

BOOST_AUTO_TEST_CASE(what_is_heard_after_the_last_take_is_not_older_than_it)
{
    SessionBoard board(5s, 95);
    board.list({row("a:1", 1)});
    board.take(start, wall);
    board.note(server("a:1", 2, {}, start + 500ms));
    BOOST_TEST(board.snapshot().find(R"("load":2,"placed":0,"age":0)") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_server_that_is_not_listed_is_left_out)
{
    SessionBoard board(5s, 95);
    board.list({row("a:1", 1)});
    board.take(start, wall);
    board.note(server("b:1", 3));
    board.take(start + 1s, wall + 1s);
    BOOST_TEST(board.update().empty());
}

BOOST_AUTO_TEST_CASE(other_servers_are_told_with_everything)
{
    SessionBoard board(5s, 95);
    board.list({row("a:1", 1)});
    board.take(start, wall);
    board.list({row("b:1", 1)});
    board.take(start + 1s, wall);
    BOOST_TEST(board.update() == board.snapshot());
    BOOST_TEST(board.snapshot().find("a:1") == std::string::npos);
    board.note(server("b:1", 2, {}, start + 1s));
    board.list({row("b:1", 2, start + 1s)}); // the same ones
    board.take(start + 2s, wall + 2s);
    BOOST_TEST(board.update() == R"({"now":1700000002,"rows":[{"row":0,"load":2,"placed":0,"age":1}]})");
}

BOOST_AUTO_TEST_CASE(a_thousand_servers_fit_into_a_browsers_queue_with_room_to_spare)
{
    SessionBoard board(1s, 95);
    std::vector<SessionRow> rows;
    for (int i = 0; i < 1000; ++i)
        rows.push_back(row("simulation-server-" + std::to_string(i) + ".example.org:2000", 33.3333));
    board.list(rows);
    for (int i = 0; i < 700; ++i)
        board.take(start + i * 1s, wall);
    BOOST_TEST(board.snapshot().size() < 200'000u);
    for (auto const& each : rows)
        board.note(server(each.address, 99.9999, {}, start));
    board.take(start + 700s, wall);
    BOOST_TEST(board.update().size() < 60'000u);
}

BOOST_AUTO_TEST_CASE(numbers_are_short_and_never_break_the_text)
{
    std::string text;
    for (double const value :
         {1.0, 0.5, -0.001, 100.0, 1e20, std::numeric_limits<double>::infinity(), std::nan("")}) {
        append_number(text, value, 2);
        text += ' ';
    }
    BOOST_TEST(text == "1 0.5 0 100 100000000000000000000 null null ");
}

BOOST_AUTO_TEST_CASE(watchers_learn_a_new_threshold_with_the_next_state)
{
    core::SessionBoard board(std::chrono::seconds(5), 95);
    TimePoint const now{std::chrono::hours(1)};
    board.list({});
    board.take(now, WallTime());
    board.set_threshold(80);
    board.take(now, WallTime());
    BOOST_TEST(board.update() == board.snapshot());
    BOOST_TEST(board.update().find("\"threshold\":80") != std::string::npos);
    board.set_threshold(80);
    board.take(now, WallTime());
    BOOST_TEST(board.update() == "");
}

BOOST_AUTO_TEST_SUITE_END()
