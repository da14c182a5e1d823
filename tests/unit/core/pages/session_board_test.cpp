#include "unit_test.hpp"

#include "core/pages/json_text.hpp"
#include "core/pages/session_board.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <list>
#include <map>

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

// Protocol section 2.4, live.
BOOST_AUTO_TEST_SUITE(session_board)

namespace {

constexpr TimePoint start(1h);
constexpr WallTime wall(1'700'000'000s);

/// A server; it is up if it has a load.
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

WaitingFigures waiting_figures(std::size_t waiting, Duration longest, std::size_t relayed)
{
    WaitingFigures figures;
    figures.waiting = waiting;
    figures.longest = longest;
    figures.relayed = relayed;
    return figures;
}

/// Of a snapshot: the day has tests of its own.
std::string without_day(std::string text)
{
    auto const begin = text.find("\"day\":{");
    auto const end = text.find("]}]},", begin);
    return begin == std::string::npos ? text : text.erase(begin, end + 5 - begin);
}

/// A board and what it looks at.
struct Fixture
{
    explicit Fixture(std::vector<ServerLoad> listed, Duration step = 5s) : board(step, 95)
    {
        list(std::move(listed));
    }

    void list(std::vector<ServerLoad> listed)
    {
        std::erase_if(servers, [&](ServerLoad const& server) {
            bool const stays =
                std::ranges::find(listed, server.address, &ServerLoad::address) != listed.end();
            if (!stays)
                board.remove(server.address);
            return !stays;
        });
        for (auto& server : listed) {
            auto const known = std::ranges::find(servers, server.address, &ServerLoad::address);
            auto& here = known == servers.end() ? servers.emplace_back(server.address) : *known;
            assign(here, std::move(server));
            put(here);
        }
    }
    void put(ServerLoad const& server, std::optional<std::string_view> before = std::nullopt)
    {
        auto& machine = machines[server.address];
        machine.spec.address = server.address;
        board.put(server, machine, nullptr, before);
    }
    /// Another fact of a machine.
    template<class Value>
    void change(std::size_t number, Value& known, Value value)
    {
        auto& machine = machines[row(number).address];
        auto const was = machine;
        known = std::move(value);
        board.put(row(number), machine, &was);
    }
    ServerLoad& row(std::size_t number)
    {
        return *std::next(servers.begin(), static_cast<std::ptrdiff_t>(number));
    }
    static void assign(ServerLoad& known, ServerLoad server) // all but the address, which the board looks at
    {
        known.state = server.state;
        known.report = std::move(server.report);
        known.reported = server.reported;
        known.problem = std::move(server.problem);
    }
    void know(std::size_t number, ServerLoad server)
    {
        assign(row(number), std::move(server));
        board.change(row(number).address);
    }
    void take(TimePoint now = start, WallTime at = wall) { board.take(now, at); }
    std::string snapshot() { return without_day(board.snapshot()); }
    std::string update() { return without_day(board.update()); }

    std::map<std::string, FleetMachine> machines; ///< By address.
    std::list<ServerLoad> servers;
    SessionBoard board;
};

} // namespace

BOOST_AUTO_TEST_CASE(rows_say_what_is_known_and_nothing_more)
{
    auto down = server("b:1", {}, "refused");
    down.report.load = 40; // from before it went down
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
    Fixture fixture({server("a:1", 7.875, {}, start - 2s), server("b\"</script>:1", {}, "bad\n")});
    fixture.take();
    fixture.board.count_placed([](std::string_view address) { return address == "a:1" ? 0u : 2u; });
    BOOST_TEST(
        fixture.board.snapshot() ==
        R"({"now":1700000000,"threshold":95,"last":0,"spacing":5,"day":{"last":0,"spacing":60,"series":[)"
        R"({"name":"load","history":[7.9]},{"name":"taken","history":[0]},)"
        R"({"name":"seats","history":[0]},{"name":"waiting","history":[null]}]},"servers":[)"
        R"({"address":"a:1","load":7.88,"placed":0,"age":2,"history":[7.9]},)"
        R"({"address":"b\"</script>:1","load":null,"placed":2,"problem":"bad\n","history":[null]}]})");
    BOOST_TEST(fixture.update() == fixture.snapshot()); // servers are listed that were not
}

BOOST_AUTO_TEST_CASE(an_update_names_only_the_rows_that_changed)
{
    Fixture fixture({server("a:1", 1), server("b:1", 2)});
    fixture.take();
    fixture.snapshot(); // as somebody who watches has got it
    fixture.take(start + 1s, wall + 1s);
    BOOST_TEST(fixture.update().empty());
    fixture.know(1, server("b:1", 2.5, {}, start + 1s)); // two polls, one row
    fixture.know(1, server("b:1", 3, {}, start + 2s));
    fixture.take(start + 2s, wall + 2s);
    BOOST_TEST(fixture.update() == R"({"now":1700000002,"rows":[{"row":1,"load":3,"placed":0,"age":0}]})");
    fixture.take(start + 5s, wall + 5s);
    BOOST_TEST(fixture.update() == R"({"now":1700000005,"point":true,"rows":[]})");
}

BOOST_AUTO_TEST_CASE(a_server_that_is_down_has_no_load_but_a_reason)
{
    Fixture fixture({server("a:1", 1)});
    fixture.take();
    fixture.know(0, server("a:1", {}, "refused"));
    fixture.take(start + 1s, wall + 1s);
    BOOST_TEST(fixture.update() ==
               R"({"now":1700000001,"rows":[{"row":0,"load":null,"placed":0,"problem":"refused"}]})");
}

BOOST_AUTO_TEST_CASE(who_drains_a_server_is_told_and_the_operator_goes_before_the_server_itself)
{
    auto draining = server("b:1", 2);
    draining.report.draining = true;
    Fixture fixture({server("a:1", 1), draining});
    fixture.take();
    BOOST_TEST(
        fixture.snapshot().find(R"("address":"b:1","load":2,"placed":0,"age":0,"drained":"machine")") !=
        std::string::npos);
    auto const drain = [&](bool is_drained) {
        fixture.change(1, fixture.machines["b:1"].is_drained, is_drained);
    };
    drain(true);
    fixture.take(start + 1s, wall + 1s);
    BOOST_TEST(fixture.update() ==
               R"({"now":1700000001,"rows":[{"row":1,"load":2,"placed":0,"age":1,"drained":"operator"}]})");
    drain(false);
    fixture.take(start + 3s, wall + 3s);
    BOOST_TEST(fixture.update() ==
               R"({"now":1700000003,"rows":[{"row":1,"load":2,"placed":0,"age":3,"drained":"machine"}]})");
}

BOOST_AUTO_TEST_CASE(how_a_server_was_found_is_in_the_snapshot)
{
    Fixture fixture({server("a:1", 1), server("b:1", 2)});
    fixture.take();
    fixture.snapshot(); // as somebody who watches has got it
    fixture.change(1, fixture.machines["b:1"].spec.found_by, std::string("dns:sim.test:1"));
    fixture.take();
    BOOST_TEST(fixture.snapshot().find(R"("address":"b:1","foundBy":"dns:sim.test:1","load":2)") !=
               std::string::npos);
    BOOST_TEST(fixture.snapshot().find(R"("address":"a:1","load":1)") != std::string::npos);
    BOOST_TEST(fixture.update() == fixture.snapshot()); // other servers are listed than before
}

BOOST_AUTO_TEST_CASE(sessions_placed_are_told_when_they_are_counted)
{
    Fixture fixture({server("a:1", 1), server("b:1", 2)});
    fixture.take();
    fixture.snapshot(); // as somebody who watches has got it
    fixture.board.count_placed([](std::string_view address) { return address == "b:1" ? 4u : 0u; });
    fixture.take(start + 1s, wall + 1s);
    BOOST_TEST(fixture.update() == R"({"now":1700000001,"rows":[{"row":1,"load":2,"placed":4,"age":1}]})");
}

BOOST_AUTO_TEST_CASE(what_is_heard_after_the_last_take_is_not_older_than_it)
{
    Fixture fixture({server("a:1", 1)});
    fixture.take();
    fixture.know(0, server("a:1", 2, {}, start + 500ms));
    BOOST_TEST(fixture.snapshot().find(R"("load":2,"placed":0,"age":0)") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_server_that_is_not_listed_is_left_out)
{
    Fixture fixture({server("a:1", 1)});
    fixture.take();
    fixture.board.change("b:1");
    fixture.take(start + 1s, wall + 1s);
    BOOST_TEST(fixture.update().empty());
}

BOOST_AUTO_TEST_CASE(other_servers_are_told_with_everything)
{
    Fixture fixture({server("a:1", 1)});
    fixture.take();
    fixture.list({server("b:1", 1)});
    fixture.take(start + 1s);
    BOOST_TEST(fixture.update() == fixture.snapshot());
    BOOST_TEST(fixture.snapshot().find("a:1") == std::string::npos);
    fixture.list({server("b:1", 2, {}, start + 1s)}); // the same ones
    fixture.take(start + 2s, wall + 2s);
    BOOST_TEST(fixture.update() == R"({"now":1700000002,"rows":[{"row":0,"load":2,"placed":0,"age":1}]})");
}

BOOST_AUTO_TEST_CASE(a_server_that_comes_or_goes_changes_nothing_of_the_others)
{
    Fixture fixture({server("a:1", 1), server("b:1", 2)});
    fixture.take();
    fixture.know(0, server("a:1", 1.5));
    auto const between = server("ab:1", 7);
    fixture.put(between, "b:1");
    fixture.take(start + 5s, wall + 5s);
    BOOST_TEST(fixture.update() == R"({"now":1700000005,"threshold":95,"last":0,"spacing":5,"servers":[)"
                                   R"({"address":"a:1","load":1.5,"placed":0,"age":5,"history":[1,1.5]},)"
                                   R"({"address":"ab:1","load":7,"placed":0,"age":5,"history":[null,7]},)"
                                   R"({"address":"b:1","load":2,"placed":0,"age":5,"history":[2,2]}]})");
    fixture.know(0, server("a:1", 2.5)); // rows that are to be told may go
    fixture.board.change("ab:1");
    fixture.board.remove("ab:1");
    fixture.board.remove("ab:1");
    fixture.take(start + 6s, wall + 6s);
    BOOST_TEST(fixture.update() == R"({"now":1700000006,"threshold":95,"last":1,"spacing":5,"servers":[)"
                                   R"({"address":"a:1","load":2.5,"placed":0,"age":6,"history":[1,1.5]},)"
                                   R"({"address":"b:1","load":2,"placed":0,"age":6,"history":[2,2]}]})");
    fixture.know(1, server("b:1", 3));
    fixture.take(start + 7s, wall + 7s);
    BOOST_TEST(fixture.update() == R"({"now":1700000007,"rows":[{"row":1,"load":3,"placed":0,"age":7}]})");
}

BOOST_AUTO_TEST_CASE(a_server_that_moves_takes_what_is_known_of_it_along)
{
    Fixture fixture({server("a:1", 1), server("b:1", 2)});
    fixture.take();
    fixture.put(fixture.row(0), "b:1"); // there it is
    fixture.put(fixture.row(0));
    fixture.take(start + 1s, wall + 1s);
    BOOST_TEST(fixture.update() == R"({"now":1700000001,"rows":[{"row":0,"load":1,"placed":0,"age":1}]})");
    fixture.put(fixture.row(0), "");
    fixture.take(start + 2s, wall + 2s);
    BOOST_TEST(fixture.update() == R"({"now":1700000002,"threshold":95,"last":2,"spacing":5,"servers":[)"
                                   R"({"address":"b:1","load":2,"placed":0,"age":2,"history":[2]},)"
                                   R"({"address":"a:1","load":1,"placed":0,"age":2,"history":[1]}]})");
}

BOOST_AUTO_TEST_CASE(what_a_server_refused_its_last_start_with_is_told_until_it_serves)
{
    Fixture fixture({server("a:1", 1), server("b:1", 2)});
    fixture.take();
    BOOST_TEST(fixture.snapshot().find("refusal") == std::string::npos);
    std::string said = "The disk is \"full\".";
    auto const refusals = [&said](std::string_view address) {
        return address == "b:1" ? std::string_view(said) : std::string_view();
    };
    for (int again = 0; again < 2; ++again) {
        fixture.board.note_refusals(refusals);
        fixture.board.take(start + 1s, wall + 1s);
        BOOST_TEST(
            fixture.update() ==
            (again == 0
                 ? R"({"now":1700000001,"rows":[{"row":1,"load":2,"placed":0,"age":1,"refusal":"The disk is \"full\"."}]})"
                 : ""));
    }
    said.clear();
    fixture.board.note_refusals(refusals);
    fixture.board.take(start + 2s, wall + 2s);
    BOOST_TEST(fixture.update() == R"({"now":1700000002,"rows":[{"row":1,"load":2,"placed":0,"age":2}]})");
}

BOOST_AUTO_TEST_CASE(a_thousand_servers_fit_into_a_browsers_queue_with_room_to_spare)
{
    std::vector<ServerLoad> servers;
    for (int i = 0; i < 1000; ++i)
        servers.push_back(server("simulation-server-" + std::to_string(i) + ".example.org:2000", 33.3333));
    Fixture fixture(servers, 1s);
    for (int i = 0; i < 700; ++i)
        fixture.take(start + i * 1s);
    BOOST_TEST(fixture.snapshot().size() < 200'000u);
    for (std::size_t i = 0; i < servers.size(); ++i)
        fixture.know(i, server(servers[i].address, 99.9999));
    fixture.take(start + 700s);
    BOOST_TEST(fixture.update().size() < 60'000u);
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

BOOST_AUTO_TEST_CASE(who_waits_and_who_is_relayed_is_told_by_a_server_that_relays)
{
    Fixture fixture({});
    fixture.take();
    BOOST_TEST(fixture.snapshot().find("waiting") == std::string::npos);
    auto figures = waiting_figures(12, 125900ms, 40);
    figures.reasons = {{"seat", 11}, {"room", 1}};
    fixture.board.note_waiting(figures);
    fixture.take(start + 1s, wall + 1s);
    BOOST_TEST(fixture.update() ==
               R"({"now":1700000001,"threshold":95,"last":1,"spacing":0,)"
               R"("waiting":12,"longestWait":125,"relayed":40,"waitingFor":{"seat":11,"room":1},)"
               R"("servers":[]})");
    figures.longest = 125950ms;
    fixture.board.note_waiting(figures); // nothing that watchers see
    fixture.take(start + 2s, wall + 2s);
    BOOST_TEST(fixture.update() == "");
    for (auto const& next :
         {waiting_figures(12, 126s, 40), waiting_figures(11, 126s, 40), waiting_figures(11, 126s, 41)}) {
        fixture.board.note_waiting(next);
        fixture.take(start + 2s, wall + 2s);
        BOOST_TEST(fixture.update() == "{\"now\":1700000002,\"waiting\":" + std::to_string(next.waiting) +
                                           ",\"longestWait\":126,\"relayed\":" +
                                           std::to_string(next.relayed) + ",\"waitingFor\":{},\"rows\":[]}");
    }
    fixture.board.note_waiting({}); // it relays no longer: the line has to go
    fixture.take(start + 3s, wall + 3s);
    BOOST_TEST(fixture.update() == fixture.snapshot());
    BOOST_TEST(fixture.update().find("waiting") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(seats_and_what_a_server_is_are_told_and_what_the_site_is)
{
    auto full = server("a:1", 12.5);
    full.report.sessions = full.report.capacity = 4;
    Fixture fixture({full});
    fixture.board.note_states([](ServerLoad const&) { return SiteState::full; });
    fixture.board.note_site(SiteState::full);
    fixture.take();
    BOOST_TEST(fixture.snapshot().find(
                   R"("state":"full","stateText":"Every seat is taken.","servers":[{"address":"a:1",)"
                   R"("load":12.5,"placed":0,"age":0,"sessions":4,"seats":4,"state":"full",)") !=
               std::string::npos);
    fixture.board.note_states([](ServerLoad const&) { return SiteState::free; });
    fixture.board.note_site(SiteState::free);
    fixture.take(start + 1s, wall + 1s);
    BOOST_TEST(fixture.update() ==
               R"({"now":1700000001,"state":"free","stateText":"A machine is free.","rows":[{"row":0,)"
               R"("load":12.5,"placed":0,"age":1,"sessions":4,"seats":4,"state":"free"}]})");
    fixture.board.note_site(SiteState::free);
    fixture.take(start + 2s, wall + 2s);
    BOOST_TEST(fixture.update().empty());
}

BOOST_AUTO_TEST_CASE(a_day_of_seats_and_who_waits_is_kept_minute_by_minute)
{
    auto half = server("a:1", 40);
    half.report.sessions = 3;
    half.report.capacity = 8;
    Fixture fixture({half, server("b:1", {})});
    fixture.take();
    BOOST_TEST(!fixture.board.ends_minute(start + 59s));
    BOOST_TEST(fixture.board.ends_minute(start + 60s));
    fixture.board.snapshot();
    fixture.board.note_waiting(waiting_figures(2, 5s, 0));
    fixture.take(start + 59s, wall);
    BOOST_TEST(fixture.board.update().find("dayPoint") == std::string::npos);
    fixture.take(start + 60s, wall);
    BOOST_TEST(fixture.board.update().find(R"("dayPoint":[40,3,8,2])") != std::string::npos,
               fixture.board.update());
    BOOST_TEST(fixture.board.snapshot().find(R"({"name":"waiting","history":[null,2]})") !=
               std::string::npos);
}

BOOST_AUTO_TEST_CASE(watchers_learn_a_new_threshold_with_the_next_state)
{
    Fixture fixture({});
    fixture.take();
    fixture.board.set_threshold(80);
    fixture.take();
    BOOST_TEST(fixture.update() == fixture.snapshot());
    BOOST_TEST(fixture.update().find("\"threshold\":80") != std::string::npos);
    fixture.board.set_threshold(80);
    fixture.take();
    BOOST_TEST(fixture.update() == "");
}

BOOST_AUTO_TEST_SUITE_END()
