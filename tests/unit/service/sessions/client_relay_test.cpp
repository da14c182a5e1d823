#include "refusal_sentences.hpp"
#include "service/run.hpp"
#include "unit_test.hpp"

#include "async/task_count.hpp"
#include "async/task_group.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/text.hpp"
#include "core/waiting/waiting_messages.hpp"

#include <webots_cloud/session_service.hpp>
#include <webots_cloud/testing/loopback_channel.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/scripted_http.hpp>
#include <webots_cloud/testing/scripted_websockets.hpp>
#include <webots_cloud/testing/world.hpp>

#include <algorithm>
#include <array>
#include <functional>
#include <list>
#include <map>
#include <tuple>

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::concat;

// Protocol section 13.16.
BOOST_AUTO_TEST_SUITE(client_relay)

namespace {

constexpr std::string_view todays_start =
    R"({"start":{"url":"https://e.org/o/r/blob/main/worlds/a.wbt","mode":"mjpeg"}})";
constexpr std::string_view our_start =
    R"({"start":{"url":"https://e.org/o/r/blob/main/worlds/a.wbt","waiting":true,"reconnect":true,"heartbeat":true}})";
constexpr std::string_view refused = "loading: Error: Not here.";

SessionConfig relaying()
{
    SessionConfig config;
    config.address.ssl = false;
    config.service.relay = true;
    config.address.host = "localhost";
    config.service.teacher_password = "secret";
    return config;
}

std::string bytes(std::size_t size, int& next)
{
    std::string text(size, '\0');
    for (auto& each : text)
        each = static_cast<char>(++next % 256);
    return text;
}

/// A session server that relays, and whose machines are the test: polls are not made, but for those tests
/// that ask for them.
struct Fixture
{
    explicit Fixture(SessionConfig config = relaying(),
                     std::vector<std::string> machines = {"a:2000", "b:2000"})
        : http(world.clock), sockets(world.clock), monitor(http, world.clock),
          service(std::move(config), fleet, monitor, scheduler, world.clock, log.logger(), hooks()),
          tasks(world.executor()), conversations(world.executor())
    {
        std::vector<ServerSpec> servers;
        for (auto const& machine : machines) {
            servers.emplace_back(machine);
            sockets.expect(concat("ws://", machine, "/client")).always();
        }
        fleet.set(servers);
        tasks.spawn(run(service));
        world.advance(3s); // who waited before a restart would have come by now
    }

    ~Fixture()
    {
        for (auto& browser : browsers)
            browser.browser_leaves();
        world.run(conversations.join());
        world.run(tasks.end());
        BOOST_TEST(world.clock.pending() == 0u);
    }

    SessionServiceHooks hooks()
    {
        SessionServiceHooks given;
        given.websockets = &sockets;
        given.random_bytes = [this](std::size_t size) { return bytes(size, random); };
        given.sign_waiting_ticket = [](std::string_view message) {
            return std::string(32, static_cast<char>(std::hash<std::string_view>()(message) % 256));
        };
        return given;
    }

    /// The machine has room for so many more.
    void has_room(std::string_view machine, int seats)
    {
        LoadReport report(10);
        auto const so_many = ++arrivals[std::string(machine)];
        report.sessions = 10;
        report.starting = 0;
        report.capacity = 10 + seats;
        report.arrivals = 1000 * so_many; // whoever was placed there has come
        report.failed = 0;
        report.departures = *report.arrivals - 10;
        scheduler.report(machine, report, world.clock.now());
        world.advance(1100ms);
    }

    testing::LoopbackChannel& connect(std::string client = "192.0.2.1")
    {
        auto& browser = browsers.emplace_back(world.executor());
        ChannelInfo info;
        info.path = "/client";
        info.asked.host = "localhost:1999";
        info.client = info.quota_key = std::move(client);
        conversations.spawn(service.serve_websocket(std::move(info), browser));
        world.settle();
        return browser;
    }

    testing::LoopbackChannel& start(std::string_view request = todays_start, std::string client = "192.0.2.1")
    {
        auto& browser = connect(std::move(client));
        browser.browser_says(std::string(request));
        world.settle();
        return browser;
    }

    /// Says the first word of a conversation of a class, and returns the texts `keys` of the answer.
    std::vector<std::string> talk_of_class(std::string text, std::vector<std::string_view> const& keys)
    {
        auto& browser = browsers.emplace_back(world.executor());
        ChannelInfo info;
        info.path = "/class";
        info.asked.host = "localhost:1999";
        info.quota_key = "192.0.2.1";
        conversations.spawn(service.serve_websocket(std::move(info), browser));
        world.settle();
        browser.browser_says(std::move(text));
        world.settle();
        BOOST_REQUIRE(!browser.sent.empty());
        std::vector<std::string> found;
        for (auto const key : keys) {
            auto const begin = browser.sent.front().find(concat("\"", key, "\":\""));
            BOOST_REQUIRE(begin != std::string::npos);
            auto const rest = browser.sent.front().substr(begin + key.size() + 4);
            found.push_back(rest.substr(0, rest.find('"')));
        }
        return found;
    }

    /// Opens a class; returns its code.
    std::string open_class(int seats)
    {
        return talk_of_class(
                   concat(
                       R"({"teach":{"password":"secret","world":"https://e.org/o/r/blob/main/worlds/a.wbt",)",
                       R"("mode":"mjpeg","seats":)", std::to_string(seats), "}}"),
                   {"code"})
            .front();
    }

    /// Somebody joins the class, and asks for a simulation.
    testing::LoopbackChannel& start_in_class(std::string_view code, std::string_view name)
    {
        auto const told =
            talk_of_class(concat(R"({"join":{"code":")", code, R"(","name":")", name, "\"}}"), {"seat"});
        return start(
            concat(R"({"start":{"url":"https://e.org/o/r/blob/main/worlds/a.wbt","mode":"mjpeg","class":")",
                   told.front(), "\"}}"));
    }

    testing::ScriptedWebSockets::Peer& machine(std::string_view name)
    {
        return sockets.peer(concat("ws://", name, "/client"));
    }

    /// Somebody who looks at the lamp.
    testing::LoopbackChannel& watch()
    {
        auto& browser = browsers.emplace_back(world.executor());
        ChannelInfo info;
        info.path = "/";
        info.query = "state";
        conversations.spawn(service.serve_websocket(std::move(info), browser));
        world.settle();
        return browser;
    }

    std::string answer(std::string_view path)
    {
        std::array<std::pair<std::string_view, std::string_view>, 1> headers{{{"Host", "localhost:1999"}}};
        IncomingRequest request;
        request.method = "GET";
        request.path = path;
        request.headers = headers;
        return std::get<HttpResponse>(service.respond(request)).body;
    }

    int random = 0;
    std::map<std::string, std::int64_t> arrivals;
    testing::World world;
    std::list<testing::LoopbackChannel> browsers;
    testing::RecordingLog log;
    testing::ScriptedHttp http;
    testing::ScriptedWebSockets sockets;
    Fleet fleet{[](std::string_view) { return std::string(32, 'm'); }};
    LoadMonitor monitor;
    Scheduler scheduler;
    SessionService service;
    async::TaskGroup tasks;
    async::TaskCount conversations; // nobody cancels those
};

std::string last_of(testing::LoopbackChannel const& browser, std::string_view beginning)
{
    for (auto each = browser.sent.rbegin(); each != browser.sent.rend(); ++each)
        if (each->starts_with(beginning))
            return *each;
    return {};
}

} // namespace

BOOST_AUTO_TEST_CASE(browsers_are_sent_to_the_session_server_itself_and_take_no_place)
{
    Fixture fixture;
    fixture.has_room("a:2000", 1);
    for (int i = 0; i < 5; ++i)
        BOOST_TEST(fixture.answer("/session") == "ws://localhost:1999");
    BOOST_TEST(fixture.answer("/") == "1");
}

BOOST_AUTO_TEST_CASE(without_relay_there_is_no_client_here)
{
    auto config = relaying();
    config.service.relay = false;
    Fixture fixture(config);
    IncomingRequest request;
    request.method = "GET";
    request.path = "/client";
    request.upgrade = true;
    BOOST_TEST(std::get<HttpResponse>(fixture.service.respond(request)).status == 404);
}

BOOST_AUTO_TEST_CASE(what_both_say_is_relayed)
{
    Fixture fixture;
    fixture.has_room("a:2000", 1);
    auto& browser = fixture.start();
    auto& machine = fixture.machine("a:2000");
    BOOST_TEST(
        machine.received().front() ==
        R"({"start":{"url":"https://e.org/o/r/blob/main/worlds/a.wbt","mode":"mjpeg","relayed":true,"heartbeat":true}})");
    BOOST_TEST((machine.request().headers == HttpHeaders{{"X-Forwarded-For", "192.0.2.1"}}));
    for (auto const* text : {"heartbeat: 1", ".", "shutdownTimeout: 7200", "webots:ws://a:2001"})
        machine.says(text);
    fixture.world.settle();
    BOOST_TEST(browser.sent == (std::vector<std::string>{"shutdownTimeout: 7200", "webots:ws://a:2001"}),
               boost::test_tools::per_element());
    browser.browser_says(R"({"reset controller":"c/c.py"})");
    fixture.world.settle();
    BOOST_TEST(machine.received().back() == R"({"reset controller":"c/c.py"})");
    BOOST_TEST(fixture.answer("/metrics").find("webots_relayed 1\n") != std::string::npos);
    browser.browser_leaves(1000);
    fixture.world.settle();
    BOOST_TEST(machine.close_code().value() == 1000);
    BOOST_TEST(machine.dropped_at().has_value());
    BOOST_TEST(fixture.answer("/metrics").find("webots_relayed 0\n") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_machine_below_this_server_is_told_where_its_browsers_reach_it)
{
    Fixture fixture(relaying(), {});
    fixture.sockets.expect("wss://machines.test:2000/client").always();
    ServerSpec server("10.0.0.2:2000");
    server.internal_address = "https://10.0.0.2:2000";
    server.internal_name = "machines.test";
    server.has_own_path = true;
    fixture.fleet.set({server});
    fixture.has_room("10.0.0.2:2000", 1);
    (void)fixture.start();
    auto const& request = fixture.sockets.peer("wss://machines.test:2000/client").request();
    BOOST_TEST(request.address == "10.0.0.2");
    BOOST_TEST_REQUIRE(request.headers.size() == 2);
    BOOST_TEST(request.headers[0].first == "Webots-Cloud-Address");
    BOOST_TEST(request.headers[0].second.starts_with("ws://localhost:1999/machine/"));
    BOOST_TEST(request.headers[1].first == "X-Forwarded-For");
}

BOOST_AUTO_TEST_CASE(a_connection_that_breaks_breaks_on_the_other_side_too)
{
    Fixture fixture;
    fixture.has_room("a:2000", 2);
    auto& browser = fixture.start();
    browser.browser_is_lost();
    fixture.world.settle();
    BOOST_TEST(!fixture.machine("a:2000").close_code().has_value());
    BOOST_TEST(fixture.machine("a:2000").dropped_at().has_value());
    auto& other = fixture.start();
    fixture.machine("a:2000").says("webots:ws://a:2001");
    fixture.machine("a:2000").is_lost();
    fixture.world.settle();
    BOOST_TEST(other.close_code.value() == 1012);
}

BOOST_AUTO_TEST_CASE(the_machine_ends_the_conversation_with_its_code_unless_that_is_not_its_to_say)
{
    for (auto const& [said, told] : {std::pair(4001, 4001), std::pair(4000, 1011)}) {
        Fixture fixture;
        fixture.has_room("a:2000", 1);
        auto& browser = fixture.start();
        fixture.machine("a:2000").says("webots:ws://a:2001");
        fixture.machine("a:2000").closes(static_cast<std::uint16_t>(said));
        fixture.world.settle();
        BOOST_TEST(browser.close_code.value() == told);
    }
}

BOOST_AUTO_TEST_CASE(who_finds_no_room_waits_and_starts_when_it_is_their_turn)
{
    Fixture fixture;
    fixture.has_room("a:2000", 0);
    auto& first = fixture.start(todays_start, "192.0.2.1");
    auto& second = fixture.start(our_start, "192.0.2.2");
    BOOST_TEST(first.sent.at(0) == "queue:0");
    BOOST_TEST(first.sent.at(1).starts_with("loading: You are next"));
    BOOST_TEST(second.sent.at(0).starts_with("waitingTicket: "));
    BOOST_TEST(second.sent.at(1) == "waiting: 1 - -");
    BOOST_TEST(fixture.sockets.accepted() == 0u);
    BOOST_TEST(fixture.answer("/metrics").find("webots_waiting 2\n") != std::string::npos);
    fixture.world.advance(11s);
    BOOST_TEST(std::count(second.sent.begin(), second.sent.end(), "waiting: 1 - -") == 2);
    fixture.has_room("a:2000", 1);
    BOOST_TEST(first.was_told("loading: A machine is free."));
    BOOST_TEST(fixture.sockets.accepted() == 1u);
    fixture.world.advance(1s);
    BOOST_TEST(second.was_told("waiting: 0 - -"));
    fixture.has_room("a:2000", 1);
    BOOST_TEST(fixture.sockets.accepted() == 2u);
    BOOST_TEST(fixture.answer("/metrics").find("webots_waiting_seconds_count 2\n") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_student_who_waits_gets_the_seat_that_is_held_for_the_class)
{
    Fixture fixture(relaying(), {"a:2000"});
    fixture.has_room("a:2000", 1);
    auto const code = fixture.open_class(2);
    auto& ada = fixture.start_in_class(code, "Ada");
    BOOST_TEST_REQUIRE(fixture.sockets.accepted() == 1u);
    fixture.has_room("a:2000", 0);
    auto& visitor = fixture.start(todays_start, "192.0.2.9");
    auto& grace = fixture.start_in_class(code, "Grace");
    BOOST_TEST(last_of(grace, "queue:") == "queue:1");
    ada.browser_leaves();
    fixture.has_room("a:2000", 1);
    fixture.world.advance(2s);
    BOOST_TEST(grace.was_told("loading: A machine is free."));
    BOOST_TEST(!visitor.was_told("loading: A machine is free."));
    BOOST_TEST(fixture.sockets.accepted() == 2u);
    fixture.has_room("a:2000", 1); // beyond the class's two
    fixture.world.advance(2s);
    BOOST_TEST(fixture.sockets.accepted() == 3u);
}

BOOST_AUTO_TEST_CASE(a_student_beyond_the_seats_of_a_class_takes_one_that_another_gives_up)
{
    Fixture fixture(relaying(), {"a:2000"});
    fixture.has_room("a:2000", 1);
    auto const code = fixture.open_class(1);
    auto& ada = fixture.start_in_class(code, "Ada");
    auto& of_ada = *std::prev(fixture.browsers.end(), 2); // her conversation of the class
    fixture.has_room("a:2000", 0);
    auto& grace = fixture.start_in_class(code, "Grace");
    BOOST_TEST(last_of(grace, "queue:") == "queue:0");
    ada.browser_leaves();
    of_ada.browser_says(R"({"leave":true})");
    fixture.has_room("a:2000", 1);
    fixture.world.advance(2s);
    BOOST_TEST(fixture.sockets.accepted() == 2u);
}

BOOST_AUTO_TEST_CASE(who_leaves_the_line_gives_the_place_up)
{
    Fixture fixture;
    fixture.has_room("a:2000", 0);
    auto& first = fixture.start(todays_start, "192.0.2.1");
    auto& second = fixture.start(todays_start, "192.0.2.2");
    first.browser_leaves(1000);
    fixture.world.advance(2s);
    BOOST_TEST(last_of(second, "queue:") == "queue:0");
    BOOST_TEST(fixture.answer("/metrics").find("webots_waiting_given_up_total 1\n") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_new_place_is_told_at_once_but_not_more_than_once_a_second)
{
    Fixture fixture;
    std::vector<testing::LoopbackChannel*> line;
    for (int i = 0; i < 4; ++i)
        line.push_back(&fixture.start(todays_start, concat("192.0.2.", std::to_string(i + 1))));
    fixture.world.advance(5s);
    BOOST_TEST(last_of(*line[3], "queue:") == "queue:3");
    line[0]->browser_leaves();
    fixture.world.settle();
    BOOST_TEST(last_of(*line[3], "queue:") == "queue:2");
    line[1]->browser_leaves();
    fixture.world.settle();
    BOOST_TEST(last_of(*line[3], "queue:") == "queue:2");
    fixture.world.advance(1250ms);
    BOOST_TEST(last_of(*line[3], "queue:") == "queue:1");
}

// They are told in parts of 500, and the line may change in between.
BOOST_AUTO_TEST_CASE(in_a_long_line_everybody_knows_their_place)
{
    auto config = relaying();
    config.service.waiting_room = 1100;
    Fixture fixture(config);
    std::map<std::string, testing::LoopbackChannel*> by_place;
    for (int i = 0; i < 1100; ++i)
        fixture.start(todays_start,
                      concat("10.0.", std::to_string(i / 250), ".", std::to_string(i % 250 + 1)));
    fixture.world.advance(2s);
    for (auto& browser : fixture.browsers)
        by_place.emplace(last_of(browser, "queue:"), &browser);
    BOOST_TEST(by_place.size() == 1100u, "each has a place of its own");
    for (std::string_view leaver : {"queue:0", "queue:499", "queue:500", "queue:999"})
        by_place.extract(std::string(leaver)).mapped()->browser_leaves();
    fixture.world.advance(1250ms);
    std::size_t ahead = 0;
    for (int before = 0; before < 1100; ++before)
        if (auto const browser = by_place.find(core::queue_message(static_cast<std::size_t>(before)));
            browser != by_place.end())
            BOOST_TEST(last_of(*browser->second, "queue:") == core::queue_message(ahead++));
}

BOOST_AUTO_TEST_CASE(a_ticket_keeps_the_place_of_who_was_lost)
{
    Fixture fixture;
    fixture.has_room("a:2000", 0);
    auto& first = fixture.start(our_start, "192.0.2.1");
    auto const ticket = last_of(first, "waitingTicket: ").substr(15);
    fixture.world.advance(1s);
    fixture.start(todays_start, "192.0.2.2");
    first.browser_is_lost();
    fixture.world.advance(30s);
    auto& again = fixture.start(
        concat(
            R"({"start":{"url":"https://e.org/o/r/blob/main/worlds/a.wbt","waiting":true,"waitingTicket":")",
            ticket, "\"}}"),
        "198.51.100.9");
    BOOST_TEST(last_of(again, "waiting: ") == "waiting: 0 - -");
    // The same ticket a second time takes the place over.
    auto& thief = fixture.start(
        concat(
            R"({"start":{"url":"https://e.org/o/r/blob/main/worlds/a.wbt","waiting":true,"waitingTicket":")",
            ticket, "\"}}"),
        "198.51.100.10");
    BOOST_TEST(again.close_code.value() == 4001);
    BOOST_TEST(last_of(thief, "waiting: ") == "waiting: 0 - -");
    // Once it has had its turn it is worth nothing.
    fixture.has_room("a:2000", 1);
    BOOST_TEST(thief.was_told("loading: A machine is free."));
    auto& late = fixture.start(
        concat(
            R"({"start":{"url":"https://e.org/o/r/blob/main/worlds/a.wbt","waiting":true,"waitingTicket":")",
            ticket, "\"}}"),
        "198.51.100.11");
    BOOST_TEST(last_of(late, "waiting: ") == "waiting: 1 - -");
}

BOOST_AUTO_TEST_CASE(a_machine_that_refuses_is_not_noticed)
{
    Fixture fixture;
    fixture.has_room("a:2000", 5);
    fixture.has_room("b:2000", 1);
    auto& browser = fixture.start();
    auto& first = fixture.sockets.peer(0);
    first.says("refusal: machine");
    first.says(std::string(refused));
    fixture.world.settle();
    BOOST_TEST(fixture.sockets.accepted() == 2u);
    BOOST_TEST(fixture.sockets.peer(0).request().url != fixture.sockets.peer(1).request().url);
    BOOST_TEST(first.dropped_at().has_value());
    fixture.sockets.peer(1).says("webots:ws://b:2001");
    fixture.world.settle();
    BOOST_TEST(browser.sent ==
                   (std::vector<std::string>{"loading: Trying another machine.", "webots:ws://b:2001"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(where_all_refuse_the_last_sentence_is_told)
{
    auto config = relaying();
    config.service.waiting_room = 0;
    Fixture fixture(config);
    fixture.has_room("a:2000", 5);
    fixture.has_room("b:2000", 5);
    auto& browser = fixture.start();
    for (std::size_t number = 0; number < 2; ++number) {
        fixture.sockets.peer(number).says("refusal: machine");
        fixture.sockets.peer(number).says(std::string(refused));
        fixture.world.settle();
    }
    BOOST_TEST(browser.sent.back() == refused);
    BOOST_TEST(browser.close_code.value() == 0);
}

namespace {

/// Why a simulation server refuses a start: sentences of every kind, as it says them (protocol,
/// section 4.1.2).
std::string const reasons[] = {
    "Error: Cannot run simulation from blocked repository: https://e.org/o/r.", // "allowedRepositories"
    "Error: Unable to start Webots: it exited with status 1 before the world was loaded: cannot open "
    "display.",
    "Error: https://e.org can't be reached: Connection refused. Try again later.", // or a proxy can't
    "Error: /a/folder can't be written: No space left on device",
    "Error: /a/folder can't be written: Permission denied",
    "Error: localhost can't be read", // the key of a website
    "Error: This simulation server is not configured to share idle time.",
    "Error: " + sentence(core::Refused::ended_early, {{"how", "it was ended by signal 11"}}),
    "Error: This simulation server is being stopped. Please start again.",
};

std::string name_of_machine(int number)
{
    return concat("m", std::to_string(number), ":2000");
}

} // namespace

// With one machine, or two, they waited for ever, as the next in the line.
BOOST_AUTO_TEST_CASE(where_every_machine_refuses_its_word_is_told_however_many_there_are)
{
    for (int const count : {1, 2, 5}) {
        for (auto const& reason : reasons) {
            std::vector<std::string> names;
            for (int number = 0; number < count; ++number)
                names.push_back(name_of_machine(number));
            Fixture fixture(relaying(), names);
            for (auto const& name : names)
                fixture.has_room(name, 5);
            auto& browser = fixture.start(our_start);
            auto const sentence = concat("loading: ", reason);
            std::size_t asked = 0;
            for (; asked < fixture.sockets.accepted(); ++asked) {
                fixture.sockets.peer(asked).says("refusal: machine");
                fixture.sockets.peer(asked).says(sentence);
                fixture.world.settle();
            }
            BOOST_TEST(asked == std::min<std::size_t>(names.size(), 3));
            BOOST_TEST(browser.sent.back() == sentence);
            BOOST_TEST(std::count(browser.sent.begin(), browser.sent.end(), sentence) == 1);
            BOOST_TEST(browser.close_code.value_or(1) == 0);
            BOOST_TEST(last_of(browser, "waiting:").empty());
            BOOST_TEST(fixture.log.contains(concat("refuses a start: ", reason.substr(7))));
        }
    }
}

// What kept the machine may be mended, and others are served there meanwhile.
BOOST_AUTO_TEST_CASE(a_machine_that_has_refused_is_asked_again_while_another_one_is_full)
{
    Fixture fixture;
    fixture.has_room("a:2000", 5);
    fixture.has_room("b:2000", 0);
    auto& browser = fixture.start();
    fixture.machine("a:2000").says("refusal: machine");
    fixture.machine("a:2000").says(std::string(refused));
    fixture.world.settle();
    BOOST_TEST(last_of(browser, "queue:") == "queue:0");
    // Both answer all the time.
    auto const wait_until = [&, since = fixture.world.clock.now()](Duration later) {
        while (fixture.world.clock.now() < since + later) {
            fixture.has_room("a:2000", 5);
            fixture.has_room("b:2000", 0);
        }
    };
    wait_until(50s);
    BOOST_TEST(fixture.sockets.accepted() == 1u);
    wait_until(65s);
    BOOST_TEST_REQUIRE(fixture.sockets.accepted() == 2u);
    fixture.sockets.peer(1).says("webots:ws://a:2001");
    fixture.world.settle();
    BOOST_TEST(browser.was_told("webots:ws://a:2001"));
}

BOOST_AUTO_TEST_CASE(who_waits_for_a_machine_that_goes_away_is_told_why_the_others_refused)
{
    Fixture fixture;
    fixture.has_room("a:2000", 5);
    fixture.has_room("b:2000", 0);
    auto& browser = fixture.start();
    fixture.machine("a:2000").says("refusal: machine");
    fixture.machine("a:2000").says(std::string(refused));
    fixture.world.advance(5s);
    BOOST_TEST(!browser.close_code.has_value());
    fixture.scheduler.mark_unreachable("b:2000", fixture.world.clock.now());
    fixture.world.advance(2s);
    BOOST_TEST(browser.sent.back() == refused);
    BOOST_TEST(browser.close_code.has_value());
}

// Whoever was refused everywhere takes nobody along who was not.
BOOST_AUTO_TEST_CASE(only_those_whom_all_machines_have_refused_are_told_so)
{
    Fixture fixture;
    fixture.has_room("a:2000", 5);
    fixture.has_room("b:2000", 0);
    auto& first = fixture.start(todays_start, "192.0.2.1");
    auto& second = fixture.start(todays_start, "192.0.2.2");
    for (std::size_t number = 0; number < 2; ++number) { // a refuses both
        fixture.sockets.peer(number).says("refusal: machine");
        fixture.sockets.peer(number).says(std::string(refused));
        fixture.world.settle();
    }
    BOOST_TEST(last_of(second, "queue:") == "queue:1");
    fixture.has_room("b:2000", 1);
    fixture.has_room("b:2000", 0);
    BOOST_TEST_REQUIRE(fixture.sockets.accepted() == 3u); // b refuses the first
    fixture.sockets.peer(2).says("refusal: machine");
    fixture.sockets.peer(2).says(std::string(refused));
    fixture.world.advance(2s);
    BOOST_TEST(first.sent.back() == refused);
    BOOST_TEST(first.close_code.has_value());
    BOOST_TEST(!second.close_code.has_value());
}

BOOST_AUTO_TEST_CASE(who_comes_to_a_full_machine_waits_again_where_it_was)
{
    Fixture fixture(relaying(), {"a:2000"});
    fixture.has_room("a:2000", 1);
    auto& first = fixture.start(todays_start, "192.0.2.1");
    fixture.has_room("a:2000", 0);
    auto& second = fixture.start(todays_start, "192.0.2.2");
    fixture.machine("a:2000").says("refusal: full");
    fixture.machine("a:2000").says(std::string(refused));
    fixture.world.settle();
    BOOST_TEST(last_of(first, "queue:") == "queue:0");
    fixture.world.advance(2s);
    BOOST_TEST(last_of(second, "queue:") == "queue:1");
    BOOST_TEST(!first.was_told(refused));
}

BOOST_AUTO_TEST_CASE(a_fault_of_the_project_is_told_and_nothing_is_tried_again)
{
    Fixture fixture;
    fixture.has_room("a:2000", 5);
    fixture.has_room("b:2000", 5);
    auto& browser = fixture.start();
    fixture.sockets.peer(0).says("loading: Error: Wrong Webots simulation URL");
    fixture.sockets.peer(0).closes();
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == "loading: Error: Wrong Webots simulation URL");
    BOOST_TEST(browser.close_code.has_value());
    BOOST_TEST(fixture.sockets.accepted() == 1u);
}

BOOST_AUTO_TEST_CASE(labels_that_no_machine_has_are_said_at_once)
{
    Fixture fixture;
    fixture.has_room("a:2000", 5);
    fixture.has_room("b:2000", 5);
    auto& browser = fixture.start();
    fixture.sockets.peer(0).says("refusal: needs gpu");
    fixture.sockets.peer(0).says(std::string(refused));
    fixture.world.settle();
    BOOST_TEST(browser.sent.back().find("none has the label \"gpu\"") != std::string::npos,
               browser.sent.back());
    BOOST_TEST(browser.close_code.has_value());
}

BOOST_AUTO_TEST_CASE(where_the_only_machine_with_the_labels_refuses_its_word_is_told)
{
    Fixture fixture(relaying(), {"a:2000", "b:2000"});
    ServerSpec with_label("b:2000");
    with_label.labels = {"gpu"};
    fixture.fleet.set({ServerSpec("a:2000"), with_label});
    fixture.has_room("b:2000", 2);
    fixture.has_room("a:2000", 9);
    auto& browser = fixture.start();
    fixture.machine("a:2000").says("refusal: needs gpu");
    fixture.machine("a:2000").says(std::string(refused));
    fixture.world.settle();
    fixture.machine("b:2000").says("refusal: machine");
    fixture.machine("b:2000").says("loading: Error: The disk is full.");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == "loading: Error: The disk is full.");
    BOOST_TEST(browser.close_code.has_value(), "it waits for a machine that has no such label");
}

BOOST_AUTO_TEST_CASE(labels_stay_needed_when_the_next_machine_is_full)
{
    Fixture fixture(relaying(), {"a:2000", "b:2000", "c:2000"});
    ServerSpec with_label("b:2000");
    with_label.labels = {"gpu"};
    fixture.fleet.set({ServerSpec("a:2000"), with_label, ServerSpec("c:2000")});
    fixture.has_room("b:2000", 2);
    fixture.has_room("c:2000", 1);
    fixture.has_room("a:2000", 9);
    auto& browser = fixture.start();
    fixture.machine("a:2000").says("refusal: needs gpu");
    fixture.machine("a:2000").says(std::string(refused));
    fixture.world.settle();
    fixture.machine("b:2000").says("refusal: full");
    fixture.machine("b:2000").says(std::string(refused));
    fixture.world.settle();
    BOOST_TEST(fixture.sockets.accepted() == 2u, "c has no such label");
    BOOST_TEST(browser.was_told("queue:0"));
}

BOOST_AUTO_TEST_CASE(a_machine_that_hangs_is_left_alone_for_a_while)
{
    Fixture fixture(relaying(), {"a:2000"});
    fixture.http.expect("GET http://a:2000/load")
        .reply(200,
               R"({"load":1,"sessions":0,"starting":0,"capacity":9,"arrivals":0,"failed":0,"departures":0})")
        .always();
    fixture.tasks.spawn(run(fixture.monitor));
    fixture.world.advance(1s);
    auto& browser = fixture.start();
    fixture.world.advance(9s);
    BOOST_TEST(fixture.sockets.accepted() == 1u);
    BOOST_TEST(browser.sent.empty());
    fixture.world.advance(2s); // it is silent for longer than a server of ours would be
    BOOST_TEST(fixture.sockets.peer(0).dropped_at().has_value());
    BOOST_TEST(browser.was_told("queue:0"));
    fixture.world.advance(7s);
    BOOST_TEST(fixture.sockets.accepted() == 1u);
    BOOST_TEST(fixture.log.contains("does not answer on /client"));
}

namespace {

std::string load_with(int sessions)
{
    auto const count = std::to_string(sessions);
    return concat(R"({"load":1,"capacity":9,"failed":0,"departures":0,"sessions":)", count, R"(,"starting":)",
                  count, R"(,"arrivals":)", count, "}");
}

/// Another session server has sent somebody to each of two machines, which are polled.
struct SharedFixture : Fixture
{
    SharedFixture() : Fixture(relaying())
    {
        for (auto const* const machine : {"a:2000", "b:2000"})
            for (int const sessions : {0, 1})
                poll(machine).reply(200, load_with(sessions));
        tasks.spawn(run(monitor));
        world.advance(4s);
        BOOST_TEST_REQUIRE(http.requests().size() == 4u); // the next ones are not due for two seconds
    }

    testing::ScriptedHttp::Step& poll(std::string_view machine)
    {
        return http.expect(concat("GET http://", machine, "/load"));
    }

    std::size_t polls() const { return http.requests().size() - 4; }
};

} // namespace

BOOST_AUTO_TEST_CASE(where_others_place_too_machines_are_asked_first)
{
    SharedFixture fixture;
    fixture.poll("a:2000").after(5ms).reply(200, load_with(4)).always();
    fixture.poll("b:2000").after(5ms).reply(200, load_with(1)).always();
    for (int i = 1; i <= 3; ++i) { // the fourth could as well go to a
        fixture.start();
        BOOST_TEST(fixture.polls() == 2u * static_cast<std::size_t>(i));
        BOOST_TEST(fixture.sockets.accepted() == static_cast<std::size_t>(i - 1));
        fixture.world.advance(5ms);
        BOOST_TEST(fixture.sockets.accepted() == static_cast<std::size_t>(i));
        BOOST_TEST(fixture.sockets.peer(static_cast<std::size_t>(i - 1)).request().url ==
                   "ws://b:2000/client");
        fixture.world.advance(200ms); // those reports are old now
    }
    BOOST_TEST(fixture.answer("/metrics").find("webots_relay_questions_total 6\n") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(however_many_come_at_once_each_machine_is_asked_once)
{
    SharedFixture fixture;
    fixture.poll("a:2000").after(5ms).reply(200, load_with(2)).always();
    fixture.poll("b:2000").after(5ms).reply(200, load_with(1)).always();
    for (int i = 0; i < 12; ++i)
        fixture.start(todays_start, concat("192.0.2.", std::to_string(i)));
    BOOST_TEST(fixture.sockets.accepted() == 0u);
    BOOST_TEST(fixture.polls() == 2u);
    fixture.world.advance(5ms);
    BOOST_TEST(fixture.sockets.accepted() == 12u);
    fixture.start();
    BOOST_TEST(fixture.sockets.accepted() == 13u); // these reports are good for all of a tenth of a second
    BOOST_TEST(fixture.polls() == 2u);
}

BOOST_AUTO_TEST_CASE(a_machine_that_does_not_answer_delays_few_and_not_for_long)
{
    SharedFixture fixture;
    fixture.poll("a:2000").hang().always();
    fixture.poll("b:2000").after(5ms).reply(200, load_with(8)).always();
    fixture.start();
    fixture.world.advance(199ms);
    BOOST_TEST(fixture.sockets.accepted() == 0u);
    fixture.world.advance(1ms);
    BOOST_TEST(fixture.sockets.accepted() == 1u);
    fixture.start();
    fixture.world.advance(5ms);
    BOOST_TEST(fixture.sockets.accepted() == 2u);
}

BOOST_AUTO_TEST_CASE(who_leaves_while_machines_are_asked_goes_nowhere)
{
    SharedFixture fixture;
    for (auto const* const machine : {"a:2000", "b:2000"})
        fixture.poll(machine).after(5ms).reply(200, load_with(1)).always();
    fixture.start().browser_leaves();
    fixture.world.advance(10ms);
    BOOST_TEST(fixture.sockets.accepted() == 0u);
    BOOST_TEST(fixture.answer("/metrics").find("webots_relayed 0\n") != std::string::npos);
    fixture.start();
    fixture.world.advance(10ms);
    BOOST_TEST(fixture.sockets.accepted() == 1u);
}

BOOST_AUTO_TEST_CASE(who_has_asked_in_vain_waits_in_the_line)
{
    SharedFixture fixture;
    for (auto const* const machine : {"a:2000", "b:2000"})
        fixture.poll(machine).after(5ms).reply(200, load_with(9)).always();
    auto& browser = fixture.start();
    fixture.world.advance(5ms);
    BOOST_TEST(browser.was_told("queue:0"));
    BOOST_TEST(fixture.sockets.accepted() == 0u);
}

BOOST_AUTO_TEST_CASE(a_browser_that_says_too_much_is_to_blame_itself)
{
    Fixture fixture(relaying(), {"a:2000"});
    fixture.has_room("a:2000", 5);
    auto& browser = fixture.start();
    for (int i = 0; i < 3; ++i)
        browser.browser_says(std::string(8000, 'x'));
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == "loading: Error: This page sends too much: please start again.");
    browser.browser_leaves();
    fixture.world.settle();
    fixture.start(todays_start, "192.0.2.2");
    BOOST_TEST(fixture.sockets.accepted() == 2u); // the machine is as good as before
    BOOST_TEST(!fixture.log.contains("does not answer"));
}

BOOST_AUTO_TEST_CASE(those_who_want_what_is_busy_hold_up_nobody)
{
    Fixture fixture;
    fixture.has_room("a:2000", 2);
    fixture.has_room("b:2000", 0);
    for (int i = 0; i < 2; ++i) { // what they want is busy now
        fixture.start(todays_start, "192.0.2.1");
        fixture.sockets.peer(static_cast<std::size_t>(i)).says("refusal: machine");
        fixture.sockets.peer(static_cast<std::size_t>(i)).says(std::string(refused));
        fixture.world.settle();
    }
    BOOST_TEST(fixture.sockets.accepted() == 2u);
    auto& other = fixture.start(todays_start, "192.0.2.2");
    fixture.has_room("a:2000", 1);
    BOOST_TEST(fixture.sockets.accepted() == 3u);
    BOOST_TEST(other.was_told("loading: A machine is free."));
}

namespace {

/// One machine of four processors, which has shown what two worlds want.
struct HeavyWorld : Fixture
{
    HeavyWorld() : Fixture(relaying(), {"a:2000"})
    {
        show(1, 1, 5min);
        show(4, 0, 1min);
    }

    static std::string start_of(std::string_view name, std::string_view more = "")
    {
        return concat(R"({"start":{"url":"https://e.org/o/)", name, "/blob/main/worlds/", name, ".wbt\"",
                      more, "}}");
    }

    void show(int light, int heavy, Duration time)
    {
        for (auto const end = world.clock.now() + time; world.clock.now() < end; world.advance(1s))
            report(light, heavy);
    }

    /// Simulations of a light world, each with half a processor, and of one that takes two and a half.
    void report(int light, int heavy)
    {
        auto const load = 12.5 * light + 62.5 * heavy;
        LoadReport said(load);
        said.sessions = light + heavy;
        said.starting = 0;
        said.capacity = 100;
        said.processors = 4;
        said.arrivals = 1000 * ++reports + light + heavy; // whoever was placed there has come
        said.departures = 1000 * reports;
        said.failed = 0;
        for (auto const& [name, running, each] :
             {std::tuple("light", light, 0.5), std::tuple("heavy", heavy, 2.5)}) {
            WorldUse use;
            auto const message = core::parse_client_message(start_of(name));
            auto const& asked = std::get<core::SimulationRequest>(message);
            use.key = world_key(core::world_of(asked), std::get<core::StartMessage>(asked).mode);
            use.running = running;
            use.processors = running * each;
            said.worlds.push_back(use);
        }
        scheduler.report("a:2000", said, world.clock.now());
    }

    std::int64_t reports = 0;
};

} // namespace

BOOST_FIXTURE_TEST_CASE(who_wants_much_room_waits_for_it_and_is_passed_by_others, HeavyWorld)
{
    auto& heavy = start(start_of("heavy", R"(,"waiting":true)"), "192.0.2.1");
    BOOST_TEST(sockets.accepted() == 0u);
    show(4, 0, 1s);
    BOOST_TEST(last_of(heavy, "waiting: ") == "waiting: 0 0 90 room");
    auto& light = start(start_of("light"), "192.0.2.2");
    show(4, 0, 1s); // others place there, too, so the machine is asked
    BOOST_TEST(sockets.accepted() == 1u);
    BOOST_TEST(last_of(light, "queue:") == "", "it does not wait at all");
    show(1, 0, 1min);
    BOOST_TEST(sockets.accepted() == 2u);
    BOOST_TEST(heavy.was_told("loading: A machine is free."));
}

// "A machine is available" stood beside "You are number 3 in line".
BOOST_FIXTURE_TEST_CASE(while_somebody_waits_for_room_the_lamp_does_not_say_that_a_machine_is_free,
                        HeavyWorld)
{
    auto const& lamp = watch();
    BOOST_TEST(lamp.sent.back() == "free");
    auto& heavy = start(start_of("heavy", R"(,"waiting":true)"));
    BOOST_TEST(lamp.sent.back() == "busy", "at once");
    BOOST_TEST(answer("/") == "1", "as of old: other worlds are served");
    heavy.browser_leaves();
    world.settle();
    BOOST_TEST(lamp.sent.back() == "free");
}

BOOST_AUTO_TEST_CASE(the_lamp_and_the_line_say_the_same)
{
    Fixture fixture(relaying(), {"a:2000"});
    auto& http = fixture.http;
    http.expect("GET http://a:2000/load").reply(200, R"({"load":20,"sessions":4,"capacity":4})");
    http.expect("GET http://a:2000/load").reply(200, R"({"load":96,"sessions":3,"capacity":4})");
    http.expect("GET http://a:2000/load")
        .reply(200, R"({"load":20,"sessions":3,"capacity":4,"draining":true})");
    http.expect("GET http://a:2000/load").fail(errc::unreachable).always();
    auto const& lamp = fixture.watch();
    auto const& browser = fixture.start(our_start);
    fixture.tasks.spawn(run(fixture.monitor));
    fixture.world.advance(20s);
    BOOST_TEST(lamp.sent == (std::vector<std::string>{"unknown", "full", "busy", "draining", "down"}),
               boost::test_tools::per_element());
    std::vector<std::string> places;
    for (auto const& each : browser.sent)
        if (each.starts_with("waiting: ") && (places.empty() || places.back() != each))
            places.push_back(each);
    BOOST_TEST(places == (std::vector<std::string>{"waiting: 0 - -", "waiting: 0 - - busy",
                                                   "waiting: 0 - - draining", "waiting: 0 - - down"}),
               boost::test_tools::per_element());
}

// The estimate went from 10 to 15 to 20 seconds.
BOOST_AUTO_TEST_CASE(a_wait_that_was_told_gets_only_shorter)
{
    Fixture fixture(relaying(), {"a:2000"});
    auto const run_one = [&]() -> testing::LoopbackChannel& {
        fixture.has_room("a:2000", 1);
        auto& browser = fixture.start(our_start);
        fixture.sockets.peer(fixture.sockets.accepted() - 1).says("webots:ws://a:2001");
        fixture.world.settle();
        return browser;
    };
    for (int i = 0; i < 6; ++i) {
        auto& browser = run_one();
        fixture.world.advance(10s);
        browser.browser_leaves();
        fixture.world.settle();
    }
    (void)run_one();
    fixture.has_room("a:2000", 0);
    auto const& waits = fixture.start(our_start, "192.0.2.2");
    for (int i = 0; i < 100; ++i)
        fixture.has_room("a:2000", 0); // a second passes
    std::vector<int> most;
    for (auto const& each : waits.sent)
        if (each.starts_with("waiting: 0 ") && !each.ends_with("-"))
            most.push_back(std::stoi(each.substr(each.rfind(' '))));
    BOOST_TEST_REQUIRE(most.size() >= 2u);
    BOOST_TEST(std::ranges::is_sorted(most, std::ranges::greater()));
    BOOST_TEST(last_of(waits, "waiting: ") == "waiting: 0 - -", "nobody knows any more");
}

BOOST_FIXTURE_TEST_CASE(who_wants_much_room_is_passed_by_nobody_who_wants_the_same, HeavyWorld)
{
    auto& first = start(start_of("heavy"), "192.0.2.1");
    show(4, 0, 500ms);
    BOOST_TEST(sockets.accepted() == 0u); // it is not tried for another half second
    report(1, 0);                         // there is room for one
    auto& second = start(start_of("heavy"), "192.0.2.2");
    BOOST_TEST(last_of(second, "queue:") == "queue:1");
    show(1, 0, 1s);
    BOOST_TEST(sockets.accepted() == 1u);
    BOOST_TEST(first.was_told("loading: A machine is free."));
}

BOOST_FIXTURE_TEST_CASE(who_wants_much_room_does_not_wait_for_long, HeavyWorld)
{
    auto& heavy = start(start_of("heavy"), "192.0.2.1");
    show(4, 0, 89s);
    BOOST_TEST(sockets.accepted() == 0u);
    show(4, 0, 2s);
    BOOST_TEST(sockets.accepted() == 1u);
    BOOST_TEST(heavy.was_told("loading: A machine is free."));
}

BOOST_FIXTURE_TEST_CASE(who_waits_for_a_free_machine_is_passed_by_nobody, HeavyWorld)
{
    auto& heavy = start(start_of("heavy"), "192.0.2.1");
    BOOST_TEST(last_of(heavy, "queue:") == "queue:0");
    show(8, 0, 30s); // full
    auto& light = start(start_of("light"), "192.0.2.2");
    BOOST_TEST(last_of(light, "queue:") == "queue:1");
    show(8, 0, 60s); // the first one has waited long enough for room
    show(7, 0, 30s);
    BOOST_TEST(heavy.was_told("loading: A machine is free."));
}

BOOST_AUTO_TEST_CASE(a_browser_returns_to_its_machine_by_the_token)
{
    Fixture fixture;
    fixture.has_room("a:2000", 1);
    auto& browser = fixture.start(our_start);
    fixture.machine("a:2000").says("webots:ws://a:2001");
    fixture.machine("a:2000").says("reconnectToken: abc");
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == "reconnectToken: abc@a:2000");
    auto& again = fixture.start(R"({"reconnect":"abc@a:2000"})");
    BOOST_TEST(fixture.machine("a:2000").received().front() == R"({"reconnect":"abc"})");
    fixture.machine("a:2000").says("webots:ws://a:2001");
    fixture.world.settle();
    BOOST_TEST(again.was_told("webots:ws://a:2001"));
}

BOOST_AUTO_TEST_CASE(no_token_leads_to_another_host)
{
    Fixture fixture;
    for (auto const* token : {"abc@evil.example:2000", "abc", "abc@", "@a:2000", ""}) {
        auto& browser = fixture.start(concat(R"({"reconnect":")", token, "\"}"));
        BOOST_TEST(browser.sent.back() == "loading: Error: This simulation has ended. Please start it again.",
                   token);
        BOOST_TEST(browser.close_code.has_value());
    }
    BOOST_TEST(fixture.sockets.requests().empty());
}

BOOST_AUTO_TEST_CASE(who_returns_before_the_machine_is_found_is_told_to_come_again)
{
    auto config = relaying();
    config.announcements = true;
    Fixture fixture(config, {});
    auto const returns = R"({"reconnect":"abc@a:2000"})";
    auto& early = fixture.start(returns);
    BOOST_TEST(early.sent.empty());
    BOOST_TEST(early.close_code.value() == 1012);
    BOOST_TEST(
        fixture.start(R"({"reconnect":"abc"})").sent.back() ==
        "loading: Error: This simulation has ended. Please start it again."); // no machine has such tokens
    fixture.fleet.set({ServerSpec("a:2000")});
    fixture.sockets.expect("ws://a:2000/client").always();
    fixture.start(returns);
    BOOST_TEST(fixture.machine("a:2000").received().front() == R"({"reconnect":"abc"})");
    fixture.world.advance(12s);
    auto& late = fixture.start(R"({"reconnect":"abc@b:2000"})");
    BOOST_TEST(late.sent.back() == "loading: Error: This simulation has ended. Please start it again.");
}

BOOST_AUTO_TEST_CASE(a_server_that_stops_asks_all_to_come_back)
{
    Fixture fixture;
    fixture.has_room("a:2000", 1);
    auto& relayed = fixture.start(our_start);
    fixture.machine("a:2000").says("webots:ws://a:2001");
    auto& waits = fixture.start(our_start, "192.0.2.2");
    fixture.service.stopping();
    BOOST_TEST(relayed.close_code.value() == 1012);
    BOOST_TEST(waits.close_code.value() == 1012);
    relayed.browser_leaves(1012);
    fixture.world.settle();
    BOOST_TEST(!fixture.machine("a:2000").close_code().has_value()); // the grace begins
    BOOST_TEST(fixture.machine("a:2000").dropped_at().has_value());
}

BOOST_AUTO_TEST_CASE(pages_that_ask_for_reasons_get_them_before_the_sentence)
{
    auto config = relaying();
    config.service.waiting_room = 0;
    Fixture fixture(config);
    auto& none =
        fixture.start(R"({"start":{"url":"https://github.com/o/r/blob/m/worlds/a.wbt","reasons":true}})");
    BOOST_TEST(none.sent == (std::vector<std::string>{
                                R"(reason: {"code":"no-machine","values":{}})",
                                "loading: Error: No simulation server available at the moment."}),
               boost::test_tools::per_element());
    auto& old = fixture.start(todays_start, "192.0.2.2");
    BOOST_TEST(old.sent ==
                   std::vector<std::string>{"loading: Error: No simulation server available at the moment."},
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_room_that_is_full_refuses_as_ever)
{
    auto config = relaying();
    config.service.waiting_room = 1;
    Fixture fixture(config);
    fixture.has_room("a:2000", 0);
    fixture.start(todays_start, "192.0.2.1");
    BOOST_TEST(fixture.answer("/session") == "Error: no simulation server available at the moment.");
    auto& browser = fixture.start(todays_start, "192.0.2.2");
    BOOST_TEST(browser.sent.back() == "loading: Error: No simulation server available at the moment.");
    BOOST_TEST(browser.close_code.has_value());
    BOOST_TEST(fixture.answer("/metrics").find("webots_waiting_refused_total 1\n") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(whoever_asks_too_often_is_refused)
{
    auto config = relaying();
    config.service.session_burst = 2;
    config.service.session_rate = 0.1;
    Fixture fixture(config);
    fixture.has_room("a:2000", 9);
    fixture.start();
    fixture.start();
    BOOST_TEST(fixture.start().sent.back().find("too many sessions") != std::string::npos);
    BOOST_TEST(fixture.sockets.accepted() == 2u);
}

BOOST_AUTO_TEST_CASE(what_is_no_request_is_told_so)
{
    Fixture fixture;
    for (auto const* text :
         {"", "[]", R"({"start":{}})", R"({"extend":60})", R"({"start":{"url":"u","fetch_only":true}})"}) {
        auto& browser = fixture.start(text);
        BOOST_TEST(browser.sent.back().starts_with("loading: Error: "), text);
        BOOST_TEST(browser.close_code.has_value(), text);
    }
    auto& silent = fixture.connect();
    fixture.world.advance(31s);
    BOOST_TEST(silent.sent.back().find("in time") != std::string::npos);
    BOOST_TEST(silent.close_code.has_value());
}

BOOST_AUTO_TEST_SUITE_END()
