#include "service/run.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"
#include "core/base64.hpp"
#include "core/text.hpp"

#include <webots_cloud/session_service.hpp>
#include <webots_cloud/testing/loopback_channel.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/scripted_http.hpp>
#include <webots_cloud/testing/scripted_websockets.hpp>
#include <webots_cloud/testing/world.hpp>

#include <algorithm>
#include <list>

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::concat;

// Protocol section 13.15.
BOOST_AUTO_TEST_SUITE(class_endpoint)

namespace {

constexpr std::string_view world_url = "https://e.org/o/r/blob/main/worlds/a.wbt";

SessionConfig config_with_password()
{
    SessionConfig config;
    config.address.ssl = false;
    config.service.teacher_password = "secret";
    return config;
}

SessionServiceHooks hooks_with_random()
{
    SessionServiceHooks hooks;
    hooks.random_bytes = [next = 0](std::size_t size) mutable {
        std::string bytes;
        while (bytes.size() < size)
            bytes += static_cast<char>(next++ % 200);
        return bytes;
    };
    hooks.make_ticket = [](std::string_view server) { return concat("for-", server); };
    return hooks;
}

constexpr std::string_view old_machine =
    R"({"load":1E1,"sessions":0,"starting":0,"capacity":5,"memory":1E1,"arrivals":0})";

/// A session server with one machine of ours that has five places, and one of others.
struct Fixture
{
    explicit Fixture(SessionConfig config = config_with_password(),
                     SessionServiceHooks hooks = hooks_with_random(), std::string_view report = old_machine)
        : ours(report), http(world.clock), monitor(http, world.clock),
          service(std::move(config), fleet, monitor, scheduler, world.clock, log.logger(),
                  with_sockets(std::move(hooks))),
          tasks(world.executor())
    {
        http.expect("GET http://a:2000/load").reply(200, ours).always();
        http.expect("GET http://b:2000/load").reply(200, "100").always();
        fleet.set({ServerSpec("a:2000"), ServerSpec("b:2000")});
        tasks.spawn(run(service));
        tasks.spawn(run(monitor));
        world.settle();
    }

    ~Fixture()
    {
        tasks.cancel_all();
        for (auto& browser : browsers)
            browser.browser_leaves();
        world.settle();
        world.run(tasks.join());
    }

    SessionServiceHooks with_sockets(SessionServiceHooks hooks)
    {
        hooks.websockets = &sockets;
        return hooks;
    }

    testing::LoopbackChannel& connect(std::string path = "/class", std::string query = {},
                                      std::string host = "localhost:1999")
    {
        auto& browser = browsers.emplace_back(world.executor());
        ChannelInfo info;
        info.path = std::move(path);
        info.query = std::move(query);
        info.asked.host = std::move(host);
        info.quota_key = "203.0.113.7";
        tasks.spawn(service.serve_websocket(std::move(info), browser));
        world.settle();
        return browser;
    }

    void say(testing::LoopbackChannel& browser, std::string text)
    {
        browser.browser_says(std::move(text));
        world.settle();
    }

    testing::LoopbackChannel& open_class(int seats)
    {
        auto& teacher = connect();
        say(teacher, concat(R"({"teach":{"password":"secret","world":")", world_url,
                            R"(","mode":"mjpeg","seats":)", std::to_string(seats), "}}"));
        BOOST_REQUIRE(teacher.was_told(R"({"class":{)"));
        code = part(teacher.sent.front(), R"("code":")");
        key = part(teacher.sent.front(), R"("key":")");
        return teacher;
    }

    testing::LoopbackChannel& join(std::string_view name)
    {
        auto& student = connect();
        say(student, concat(R"({"join":{"code":")", code, R"(","name":")", name, "\"}}"));
        BOOST_REQUIRE(student.was_told(R"({"joined":{)"));
        seat = part(student.sent.front(), R"("seat":")");
        return student;
    }

    /// What follows `key` in a text, up to the next quote.
    static std::string part(std::string const& text, std::string_view key)
    {
        auto const begin = text.find(key);
        BOOST_REQUIRE(begin != std::string::npos);
        auto const rest = text.substr(begin + key.size());
        return rest.substr(0, rest.find('"'));
    }

    HttpResponse get(std::string_view path, std::string_view query = {}, std::string_view method = "GET")
    {
        IncomingRequest request;
        request.method = method;
        request.path = path;
        request.query = query;
        return std::get<HttpResponse>(service.respond(request));
    }

    bool has_figure(std::string const& line)
    {
        return get("/metrics").body.find(line + "\n") != std::string::npos;
    }

    std::string ours;
    std::string code;
    std::string key;
    std::string seat; ///< The token of the last student for seats.
    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedHttp http;
    testing::ScriptedWebSockets sockets{world.clock};
    Fleet fleet;
    LoadMonitor monitor;
    Scheduler scheduler;
    SessionService service;
    std::list<testing::LoopbackChannel> browsers;
    async::TaskGroup tasks;
};

std::string picture()
{
    std::string jpeg("\xff\xd8\xff\xc0\0\x0b\x08\0\x78\0\xa0\x01\x01\x11", 14); // 160x120 pixels
    jpeg.resize(100);
    return concat(R"({"picture":")", core::base64(jpeg), "\"}");
}

auto count(testing::LoopbackChannel const& browser, std::string_view text)
{
    return std::count_if(browser.sent.begin(), browser.sent.end(),
                         [text](std::string const& each) { return each.starts_with(text); });
}

std::string stage_message(int count)
{
    return concat(R"({"stage":[{"url":")", world_url, R"(","mode":"mjpeg","count":)", std::to_string(count),
                  "}]}");
}

std::string staged_message(int ready, int taken)
{
    return concat(R"({"staged":[{"url":")", world_url, R"(","mode":"mjpeg","ready":)", std::to_string(ready),
                  R"(,"taken":)", std::to_string(taken), "}]}");
}

constexpr std::string_view staging_machine =
    R"({"load":1E1,"sessions":0,"capacity":5,"memory":1E1,"arrivals":0,"staging":4})";
constexpr auto machine_url = "ws://a:2000/ticket/for-a:2000/client";

constexpr std::string_view none_free = "Error: no simulation server available at the moment.";

} // namespace

BOOST_AUTO_TEST_CASE(a_teacher_is_told_the_seats_and_the_machines_of_ours_with_tickets)
{
    Fixture fixture;
    auto& teacher = fixture.open_class(30);
    BOOST_TEST(teacher.sent.size() == 1u);
    BOOST_TEST(teacher.sent[0].find(R"("seats":30,"reserved":5,)") != std::string::npos, teacher.sent[0]);
    BOOST_TEST(teacher.sent[0].find(R"("machines":["ws://a:2000/ticket/for-a:2000"])") != std::string::npos,
               teacher.sent[0]);
}

BOOST_AUTO_TEST_CASE(nothing_is_fetched_on_a_machine_that_drains)
{
    Fixture fixture;
    ServerSpec drained("a:2000");
    drained.drain = true;
    fixture.fleet.set({drained});
    auto& teacher = fixture.open_class(30);
    BOOST_TEST(teacher.sent[0].find(R"("machines":[])") != std::string::npos, teacher.sent[0]);
}

// Of the name `*` each browser has its own.
BOOST_AUTO_TEST_CASE(a_student_does_not_choose_the_host_that_the_teachers_page_connects_to)
{
    auto config = config_with_password();
    config.service.gateway = true;
    Fixture fixture(config);
    ServerSpec machine("*/2000");
    machine.internal_address = "a:2000";
    fixture.fleet.set({machine});
    fixture.world.advance(2s);
    auto& teacher = fixture.open_class(5);
    auto& ada = fixture.join("Ada");
    auto& session = fixture.connect("/session", concat("class=", fixture.seat), "evil.example");
    BOOST_TEST(session.sent.back().starts_with("ws://evil.example/2000/ticket/"), session.sent.back());
    fixture.say(ada, R"({"state":{"state":"running","simulator":"ws://evil.example/2001"}})");
    BOOST_TEST(teacher.sent.back().find("simulator") == std::string::npos, teacher.sent.back());
    fixture.say(ada,
                R"({"state":{"state":"running","simulator":"ws://evil.example/2000/simulation/a/2001"}})");
    BOOST_TEST(teacher.sent.back().find(R"("simulator":"ws://localhost:1999/2000/simulation/a/2001")") !=
                   std::string::npos,
               teacher.sent.back());
}

BOOST_AUTO_TEST_CASE(seats_of_a_class_are_its_students_alone)
{
    Fixture fixture;
    auto& lamp = fixture.connect("/");
    BOOST_TEST(lamp.sent.back() == "1");
    (void)fixture.open_class(5);
    fixture.world.advance(1s);
    BOOST_TEST(lamp.sent.back() == "0");
    BOOST_TEST(fixture.get("/session").body == none_free);
    (void)fixture.join("Ada");
    BOOST_TEST(fixture.get("/session", concat("url=x&class=", fixture.seat)).body ==
               "ws://a:2000/ticket/for-a:2000");
    BOOST_TEST(fixture.has_figure("webots_class_seats_held 4"));
    BOOST_TEST(fixture.get("/session", "class=guessed").body == none_free);
    BOOST_TEST(fixture.get("/session", concat("class=", fixture.seat), "HEAD").status == 200);
    auto& by_websocket = fixture.connect("/session", concat("class=", fixture.seat));
    BOOST_TEST(by_websocket.sent.back() == "ws://a:2000/ticket/for-a:2000");
    BOOST_TEST(fixture.has_figure("webots_class_seats_held 4"));
}

BOOST_AUTO_TEST_CASE(a_student_who_asks_again_and_again_waits)
{
    Fixture fixture;
    (void)fixture.open_class(5);
    (void)fixture.join("Ada");
    auto const query = concat("class=", fixture.seat);
    int placed = 0;
    for (int i = 0; i < 100; ++i)
        placed += fixture.get("/session", query).body.starts_with("ws://") ? 1 : 0;
    BOOST_TEST(placed <= 6);
    auto const answer = fixture.get("/session", query);
    BOOST_TEST(answer.body.starts_with("Error: "));
    fixture.world.advance(1s);
}

BOOST_AUTO_TEST_CASE(seats_are_free_again_when_a_class_ends)
{
    Fixture fixture;
    auto& teacher = fixture.open_class(5);
    BOOST_TEST(fixture.get("/session").body == none_free);
    fixture.say(teacher, R"({"close":true})");
    BOOST_TEST((teacher.close_code == 1000));
    BOOST_TEST(fixture.get("/session").body == "ws://a:2000/ticket/for-a:2000");
}

BOOST_AUTO_TEST_CASE(a_student_who_is_lost_is_away_and_gone_after_a_minute)
{
    Fixture fixture;
    auto& teacher = fixture.open_class(5);
    auto& ada = fixture.join("Ada");
    ada.browser_is_lost();
    fixture.world.settle();
    BOOST_TEST(teacher.sent.back().find(R"("state":"away")") != std::string::npos);
    fixture.world.advance(58s);
    BOOST_TEST(count(teacher, R"({"gone")") == 0);
    fixture.world.advance(4s);
    BOOST_TEST(count(teacher, R"({"gone":1})") == 1);
}

BOOST_AUTO_TEST_CASE(a_class_without_a_teacher_ends_after_an_hour)
{
    Fixture fixture;
    auto& teacher = fixture.open_class(5);
    auto& ada = fixture.join("Ada");
    teacher.browser_is_lost();
    fixture.world.advance(59min);
    BOOST_TEST(fixture.has_figure("webots_classes 1"));
    fixture.world.advance(2min);
    BOOST_TEST(ada.sent.back() == R"({"closed":"idle"})");
    BOOST_TEST((ada.close_code == 1000));
    BOOST_TEST(fixture.has_figure("webots_classes 0"));
    BOOST_TEST(fixture.has_figure("webots_class_students 0"));
}

BOOST_AUTO_TEST_CASE(a_teacher_returns_with_the_key_and_watches_in_two_windows)
{
    Fixture fixture;
    auto& first = fixture.open_class(5);
    auto& ada = fixture.join("Ada");
    auto& second = fixture.connect();
    fixture.say(second, concat(R"({"teach":{"key":")", fixture.key, "\"}}"));
    BOOST_TEST(second.was_told(R"({"class":{)"));
    fixture.say(second, R"({"watch":true})");
    fixture.say(ada, picture());
    BOOST_TEST(count(second, R"({"picture")") == 1);
    BOOST_TEST(count(first, R"({"picture")") == 0);
    BOOST_TEST(fixture.has_figure(R"(webots_class_pictures_total{result="relayed"} 1)"));
}

// A queue that is full drops the channel: so pictures must not be what fills it.
BOOST_AUTO_TEST_CASE(pictures_for_a_teacher_who_does_not_read_are_dropped_and_words_are_not)
{
    Fixture fixture;
    auto& teacher = fixture.open_class(5);
    auto& ada = fixture.join("Ada");
    fixture.say(teacher, R"({"watch":true})");
    teacher.unread = 40'000;
    fixture.say(ada, picture());
    BOOST_TEST(count(teacher, R"({"picture")") == 0);
    BOOST_TEST(fixture.has_figure(R"(webots_class_pictures_total{result="dropped"} 1)"));
    fixture.say(ada, R"({"state":{"state":"running"}})");
    BOOST_TEST(teacher.sent.back().find(R"("state":"running")") != std::string::npos);
    teacher.unread = 0;
    fixture.world.advance(1s);
    fixture.say(ada, picture());
    BOOST_TEST(count(teacher, R"({"picture")") == 1);
}

BOOST_AUTO_TEST_CASE(another_password_counts_for_new_classes)
{
    Fixture fixture;
    (void)fixture.open_class(5);
    auto config = config_with_password();
    config.service.teacher_password = "another";
    fixture.service.apply(config);
    auto& late = fixture.connect();
    auto const open =
        concat(R"({"teach":{"password":"secret","world":")", world_url, R"(","mode":"mjpeg","seats":1}})");
    fixture.say(late, open);
    BOOST_TEST(late.sent.back().starts_with(R"({"error":"password")"));
    auto& again = fixture.connect();
    fixture.say(again, concat(R"({"teach":{"key":")", fixture.key, "\"}}"));
    BOOST_TEST(again.was_told(R"({"class":{)"));
    config.service.teacher_password = "";
    fixture.service.apply(config);
    fixture.say(late, open);
    BOOST_TEST(late.sent.back().starts_with(R"({"error":"off")"));
    BOOST_TEST(fixture.has_figure("webots_classes 1"));
}

BOOST_AUTO_TEST_CASE(without_random_numbers_there_are_no_classes)
{
    Fixture fixture(config_with_password(), SessionServiceHooks());
    auto& teacher = fixture.connect();
    fixture.say(teacher, concat(R"({"teach":{"password":"secret","world":")", world_url,
                                R"(","mode":"mjpeg","seats":1}})"));
    BOOST_TEST(teacher.sent.back().starts_with(R"({"error":"off")"));
}

BOOST_AUTO_TEST_CASE(a_teacher_at_localhost_is_told_where_students_find_the_site)
{
    auto hooks = hooks_with_random();
    hooks.shared_addresses = [] { return std::vector<std::string>{"192.168.1.5"}; };
    auto config = config_with_password();
    config.address.host = "*";
    Fixture fixture(config, hooks);
    auto& teacher = fixture.open_class(5);
    constexpr std::string_view open = R"("network":{"addresses":["192.168.1.5"],"open":true}}})";
    BOOST_TEST(teacher.sent.front().ends_with(open), teacher.sent.front());
    // Who has come by an address of the network has a link for students, and needs no other.
    auto& other = fixture.connect("/class", {}, "192.168.1.5:1999");
    fixture.say(other, concat(R"({"teach":{"key":")", fixture.key, "\"}}"));
    BOOST_TEST(other.was_told(R"({"class":{)"));
    BOOST_TEST(other.sent.front().find("network") == std::string::npos, other.sent.front());
}

BOOST_AUTO_TEST_CASE(a_site_for_this_machine_alone_is_told_apart)
{
    auto hooks = hooks_with_random();
    hooks.shared_addresses = [] { return std::vector<std::string>{"192.168.1.5"}; };
    Fixture fixture(config_with_password(), hooks);
    auto const& told = fixture.open_class(5).sent.front();
    BOOST_TEST(told.ends_with(R"("open":false}}})"), told);
}

BOOST_AUTO_TEST_CASE(everybody_is_told_that_the_server_stops)
{
    Fixture fixture;
    auto& teacher = fixture.open_class(5);
    auto& ada = fixture.join("Ada");
    fixture.service.stopping();
    BOOST_TEST(teacher.sent.back() == R"({"closed":"server"})");
    BOOST_TEST(ada.sent.back() == R"({"closed":"server"})");
}

BOOST_AUTO_TEST_CASE(the_log_knows_who_guesses_and_nothing_of_a_class)
{
    Fixture fixture;
    auto& teacher = fixture.open_class(5);
    auto& ada = fixture.join("Ada Lovelace");
    fixture.say(teacher, R"({"tell":{"students":null,"do":"message","text":"Look here"}})");
    fixture.say(ada, R"({"leave":true})");
    for (int i = 0; i < 12; ++i)
        fixture.say(fixture.connect(), concat(R"({"teach":{"password":"guess","world":")", world_url,
                                              R"(","mode":"mjpeg","seats":1}})"));
    std::string all;
    for (auto const& line : fixture.log.lines)
        all += line + "\n";
    BOOST_TEST(all.find("Too many wrong passwords of teachers come from 203.0.113.7") != std::string::npos,
               all);
    for (auto const& secret : {std::string("Lovelace"), std::string("Look here"), std::string("guess\""),
                               fixture.code, fixture.key, fixture.seat, std::string("secret")})
        BOOST_TEST(all.find(secret) == std::string::npos, all);
}

// Protocol section 13.20.
BOOST_AUTO_TEST_CASE(machines_have_simulations_ready_for_the_seats_of_a_class)
{
    Fixture fixture(config_with_password(), hooks_with_random(), staging_machine);
    fixture.sockets.expect(machine_url).accept();
    auto& teacher = fixture.open_class(3);
    fixture.world.advance(1s);
    BOOST_REQUIRE(fixture.sockets.accepted() == 1u);
    auto& machine = fixture.sockets.peer(0);
    BOOST_TEST(machine.received() == std::vector<std::string>{stage_message(3)},
               boost::test_tools::per_element());
    machine.says(staged_message(2, 0));
    fixture.world.advance(1s);
    BOOST_TEST(teacher.was_told(R"({"staged":{"ready":2,"seats":3}})"));

    (void)fixture.join("Ada");
    (void)fixture.get("/session", concat("class=", fixture.seat));
    machine.says(staged_message(2, 1)); // it had three by then
    fixture.world.advance(1s);
    BOOST_TEST(machine.received().back() == stage_message(2));
    BOOST_TEST(teacher.was_told(R"({"staged":{"ready":2,"seats":2}})"));
    auto const said = machine.received().size();
    for (int i = 0; i < 20; ++i) { // both show that they live
        machine.says(staged_message(2, 1));
        fixture.world.advance(2s);
    }
    BOOST_TEST(machine.received().size() > said + 2);
    BOOST_TEST(machine.received().size() < said + 6);

    fixture.say(teacher, R"({"close":true})");
    fixture.world.advance(1s);
    BOOST_TEST(machine.close_code().has_value());
    fixture.world.advance(30s);
    BOOST_TEST(fixture.sockets.accepted() == 1u);
}

BOOST_AUTO_TEST_CASE(a_machine_that_does_not_answer_as_it_should_is_asked_again_later)
{
    Fixture fixture(config_with_password(), hooks_with_random(), staging_machine);
    fixture.sockets.expect(machine_url).fail(Failure(errc::unreachable, "no")).always();
    auto& teacher = fixture.open_class(3);
    fixture.world.advance(9s);
    BOOST_TEST(fixture.sockets.requests().size() == 1u);
    BOOST_TEST(teacher.was_told(R"({"staged":{"ready":0,"seats":3}})"));
    fixture.world.advance(3s);
    BOOST_TEST(fixture.sockets.requests().size() == 2u);
    BOOST_TEST(fixture.log.contains("a:2000 has nothing ready for classes at the moment"));
}

BOOST_AUTO_TEST_CASE(a_machine_that_falls_silent_or_says_nonsense_is_left)
{
    Fixture fixture(config_with_password(), hooks_with_random(), staging_machine);
    fixture.sockets.expect(machine_url).accept().always();
    (void)fixture.open_class(3);
    fixture.world.advance(1s);
    fixture.sockets.peer(0).says("loading: Error: nonsense");
    fixture.world.settle();
    BOOST_TEST(fixture.sockets.peer(0).dropped_at().has_value());
    BOOST_TEST(fixture.log.contains("loading: Error: nonsense"));
    fixture.world.advance(12s);
    BOOST_REQUIRE(fixture.sockets.accepted() == 2u);
    fixture.world.advance(31s);
    BOOST_TEST(fixture.sockets.peer(1).dropped_at().has_value());
}

BOOST_AUTO_TEST_CASE(machines_that_stage_nothing_are_not_asked)
{
    Fixture fixture;
    auto& teacher = fixture.open_class(3);
    fixture.world.advance(5s);
    BOOST_TEST(fixture.sockets.requests().empty());
    BOOST_TEST(!teacher.was_told(R"({"staged")"));
}

BOOST_AUTO_TEST_CASE(the_paths_of_the_page)
{
    Fixture fixture;
    auto const moved = fixture.get("/class");
    BOOST_TEST(moved.status == 301);
    BOOST_TEST(moved.headers.front().second == "class/");
    for (auto const* path : {"/class/base.css", "/class/favicon.svg", "/class/view/session.js",
                             "/class/view/texts/en.json", "/class/defaults.json"})
        BOOST_TEST(fixture.get(path).status == 200, path);
    BOOST_TEST((fixture.get("/class/view/session.js").text() == fixture.get("/view/session.js").text()));
    for (auto const* path : {"/class/nope.js", "/class/view/", "/class/../viewer/viewer.js", "/classroom"})
        BOOST_TEST(fixture.get(path).status == 404, path);
    BOOST_TEST(fixture.get("/class/K7M2Q").text() == fixture.get("/class/").text());
    BOOST_TEST(fixture.get("/class/", {}, "POST").status == 405);
}

BOOST_AUTO_TEST_SUITE_END()
