#include "unit_test.hpp"

#include "core/json_text.hpp"
#include "core/session_board.hpp"

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

} // namespace

// Protocol section 2.4, live.
BOOST_AUTO_TEST_SUITE(session_board)

BOOST_AUTO_TEST_CASE(rows_say_what_is_known_and_nothing_more)
{
    ServerLoad up("a:1");
    up.state = ServerState::up;
    up.report.load = 12.5;
    up.report.sessions = 3;
    up.reported = start;
    ServerLoad down("b:1");
    down.state = ServerState::down;
    down.report.load = 40; // from better days
    down.problem = "refused";
    auto const placed = [](std::string_view address) { return address == "b:1" ? 7u : 0u; };
    auto const rows = session_rows({up, down, ServerLoad("c:1")}, placed);
    BOOST_TEST(rows[0].load.value() == 12.5);
    BOOST_TEST(rows[0].sessions.value() == 3);
    BOOST_TEST(rows[0].placed == 0u);
    BOOST_TEST(!rows[1].load.has_value());
    BOOST_TEST(rows[1].problem == "refused");
    BOOST_TEST(rows[1].placed == 7u);
    BOOST_TEST((!rows[2].load && rows[2].problem.empty()));
}

BOOST_AUTO_TEST_CASE(who_comes_gets_everything)
{
    SessionBoard board(5s, 95);
    auto hostile = row("b\"</script>:1", {});
    hostile.problem = "bad\n";
    hostile.placed = 2;
    board.take({row("a:1", 7.875, start - 2s), hostile}, start, wall);
    BOOST_TEST(board.snapshot() ==
               R"({"now":1700000000,"threshold":95,"last":0,"spacing":5,"servers":[)"
               R"({"address":"a:1","load":7.88,"placed":0,"age":2,"history":[7.9]},)"
               R"({"address":"b\"</script>:1","load":null,"placed":2,"problem":"bad\n","history":[null]}]})");
    BOOST_TEST(board.update() == board.snapshot()); // servers are listed that were not
}

BOOST_AUTO_TEST_CASE(an_update_names_only_the_rows_that_changed)
{
    SessionBoard board(5s, 95);
    board.take({row("a:1", 1), row("b:1", 2)}, start, wall);
    board.take({row("a:1", 1), row("b:1", 2)}, start + 1s, wall + 1s);
    BOOST_TEST(board.update().empty());
    board.take({row("a:1", 1), row("b:1", 3, start + 2s)}, start + 2s, wall + 2s);
    BOOST_TEST(board.update() == R"({"now":1700000002,"rows":[{"row":1,"load":3,"placed":0,"age":0}]})");
    board.take({row("a:1", 1), row("b:1", 3, start + 2s)}, start + 5s, wall + 5s);
    BOOST_TEST(board.update() == R"({"now":1700000005,"point":true,"rows":[]})");
}

BOOST_AUTO_TEST_CASE(other_servers_are_told_with_everything)
{
    SessionBoard board(5s, 95);
    board.take({row("a:1", 1)}, start, wall);
    board.take({row("b:1", 1)}, start + 1s, wall);
    BOOST_TEST(board.update() == board.snapshot());
    BOOST_TEST(board.snapshot().find("a:1") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_thousand_servers_fit_into_a_browsers_queue_with_room_to_spare)
{
    SessionBoard board(1s, 95);
    std::vector<SessionRow> rows;
    for (int i = 0; i < 1000; ++i)
        rows.push_back(row("simulation-server-" + std::to_string(i) + ".example.org:2000", 33.3333));
    for (int i = 0; i < 700; ++i)
        board.take(rows, start + i * 1s, wall);
    BOOST_TEST(board.snapshot().size() < 200'000u);
    for (auto& each : rows)
        each.load = 99.9999;
    board.take(rows, start + 700s, wall);
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
    board.take({}, now, WallTime());
    board.set_threshold(80);
    board.take({}, now, WallTime());
    BOOST_TEST(board.update() == board.snapshot());
    BOOST_TEST(board.update().find("\"threshold\":80") != std::string::npos);
    board.set_threshold(80);
    board.take({}, now, WallTime());
    BOOST_TEST(board.update() == "");
}

BOOST_AUTO_TEST_SUITE_END()
