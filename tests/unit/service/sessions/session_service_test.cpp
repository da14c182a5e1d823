#include "service/run.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"
#include "core/gallery/world_list.hpp"
#include "core/text.hpp"

#include <webots_cloud/operator_mail.hpp>
#include <webots_cloud/session_service.hpp>
#include <webots_cloud/testing/loopback_channel.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/recording_notifier.hpp>
#include <webots_cloud/testing/scripted_http.hpp>
#include <webots_cloud/testing/world.hpp>

#include <algorithm>
#include <array>
#include <set>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol sections 2, 9.1 and 13.
BOOST_AUTO_TEST_SUITE(session_service)

namespace {

struct Fixture
{
    explicit Fixture(SessionConfig config = SessionConfig(),
                     SessionServiceHooks hooks = SessionServiceHooks(),
                     std::function<std::string(std::string_view)> machine_mac = {})
        : http(world.clock), fleet(std::move(machine_mac)), monitor(http, world.clock), initial(config),
          service(std::move(config), fleet, monitor, scheduler, world.clock, log.logger(), std::move(hooks)),
          tasks(world.executor())
    {}

    ~Fixture()
    {
        world.run(tasks.end());
        BOOST_TEST(world.clock.pending() == 0u);
    }

    void start(std::vector<std::string> const& servers)
    {
        std::vector<ServerSpec> specs(servers.size());
        for (std::size_t i = 0; i < servers.size(); ++i)
            specs[i].address = servers[i];
        reload(specs);
        tasks.spawn(run(service));
        tasks.spawn(run(monitor));
        world.settle();
    }

    /// As SIGHUP does.
    void reload(std::vector<ServerSpec> const& servers)
    {
        fleet.set(servers);
        service.apply(initial);
    }

    HttpResponse get(std::string_view path, std::string_view method = "GET", std::string_view accept = "*/*")
    {
        std::array<std::pair<std::string_view, std::string_view>, 1> const headers = {{{"Accept", accept}}};
        IncomingRequest request;
        request.quota_key = client;
        request.method = method;
        request.path = path.substr(0, path.find('?'));
        request.query = path.substr(std::min(path.size(), request.path.size() + 1));
        request.headers = headers;
        return std::get<HttpResponse>(service.respond(request));
    }

    bool upgrades(std::string_view path)
    {
        IncomingRequest request;
        request.method = "GET";
        request.path = path;
        request.upgrade = true;
        return std::holds_alternative<AcceptWebSocket>(service.respond(request));
    }

    void connect(testing::LoopbackChannel& browser, std::string path = "/", std::string query = "")
    {
        ChannelInfo info;
        info.path = std::move(path);
        info.query = std::move(query);
        info.asked.host = "localhost:1999";
        info.client = "203.0.113.7";
        info.quota_key = client;
        tasks.spawn(service.serve_websocket(std::move(info), browser));
        world.settle();
    }

    std::size_t polls_of(std::string_view url) const
    {
        return static_cast<std::size_t>(std::ranges::count(http.requests(), url, &HttpRequest::url));
    }

    std::string client; ///< Of the requests from now on.
    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedHttp http;
    Fleet fleet;
    LoadMonitor monitor;
    Scheduler scheduler;
    SessionConfig initial;
    SessionService service;
    async::TaskGroup tasks;
};

SessionConfig with_gateway(SessionConfig config)
{
    config.service.gateway = true;
    return config;
}

/// A session server with a gateway, and one machine behind it.
struct GatewayFixture : Fixture
{
    explicit GatewayFixture(SessionConfig config = SessionConfig()) : Fixture(with_gateway(std::move(config)))
    {
        http.expect("GET http://10.0.0.2:2000/load").reply(200, "1").always();
        start({});
        machine.internal_address = "10.0.0.2:2000";
        fleet.set({machine});
        world.settle();
    }

    ServerSpec machine{"sim.example.org/2000"};
};

std::string header(HttpResponse const& response, std::string_view name)
{
    for (auto const& [key, value] : response.headers)
        if (key == name)
            return value;
    for (auto const& line : webots_cloud::core::split(response.fixed_headers, '\n'))
        if (line.starts_with(name) && line.substr(name.size()).starts_with(": "))
            return std::string(webots_cloud::core::trim(line.substr(name.size() + 2)));
    return {};
}

std::string text_of(HttpResponse const& response)
{
    return response.shared ? response.shared->text : response.body;
}

std::string content_type(HttpResponse const& response)
{
    return response.content_type.empty() ? header(response, "Content-Type") : response.content_type;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_browser_that_would_not_be_accepted_is_closed)
{
    Fixture fixture;
    BOOST_TEST(!fixture.upgrades("/client"));
    testing::LoopbackChannel browser(fixture.world.executor());
    fixture.connect(browser, "/client"); // by a transport that has not asked
    BOOST_TEST(browser.close_code.value() == 1008);
}

BOOST_AUTO_TEST_CASE(session_answers_the_address_of_the_least_loaded_server_with_cors)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "60").always();
    fixture.http.expect("GET http://b/2000/load").reply(200, "10").always();
    fixture.start({"a:2000", "b/2000"});
    auto const answer = fixture.get("/session");
    BOOST_TEST(answer.status == 200);
    BOOST_TEST(answer.body == "wss://b/2000");
    BOOST_TEST(content_type(answer) == "text/html; charset=UTF-8");
    BOOST_TEST(header(answer, "Access-Control-Allow-Origin") == "*");
    BOOST_TEST(header(answer, "Access-Control-Allow-Headers") == "x-requested-with");
    BOOST_TEST(header(answer, "Access-Control-Allow-Methods") == "POST, GET, OPTIONS");
}

BOOST_AUTO_TEST_CASE(the_monitor_counts_the_sessions_of_a_server_that_left_the_list_when_it_is_back)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    fixture.http.expect("GET http://b:2000/load").reply(200, "10").always();
    auto const placed_on_a = [&fixture](std::string const& count) {
        testing::LoopbackChannel watcher(fixture.world.executor());
        fixture.connect(watcher, "/monitor");
        auto const told = watcher.sent.front();
        watcher.browser_leaves();
        fixture.world.settle();
        return told.find("\"placed\":" + count) != std::string::npos;
    };
    fixture.start({"a:2000"});
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000");
    fixture.fleet.set({ServerSpec("b:2000")});
    fixture.world.settle();
    BOOST_TEST(!placed_on_a("1"));
    fixture.fleet.set({ServerSpec("a:2000")});
    BOOST_TEST(placed_on_a("1"));
    fixture.world.settle();
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000");
    fixture.reload({ServerSpec("a:2000")});
    BOOST_TEST(placed_on_a("2"));
}

BOOST_AUTO_TEST_CASE(single_machines_come_and_go_without_a_word_about_the_others)
{
    Fixture fixture;
    for (auto const* name : {"a", "b", "c"})
        fixture.http.expect(std::string("GET http://") + name + ":2000/load").reply(200, "10").always();
    fixture.start({"a:2000", "c:2000"});
    testing::LoopbackChannel watcher(fixture.world.executor());
    fixture.connect(watcher, "/monitor");
    std::vector<ServerChange> changes(2);
    changes[0].server.address = "b:2000";
    changes[0].before = "c:2000";
    changes[1].kind = ServerChange::Kind::removed;
    changes[1].server.address = "a:2000";
    fixture.fleet.change(changes);
    fixture.world.settle();
    BOOST_TEST(fixture.polls_of("http://b:2000/load") == 1u);
    BOOST_TEST(fixture.polls_of("http://c:2000/load") == 1u, "what is known of it stays");
    std::set<std::string> places{fixture.get("/session").body, fixture.get("/session").body};
    BOOST_TEST((places == std::set<std::string>{"wss://b:2000", "wss://c:2000"}));
    fixture.world.advance(1s);
    auto const& told = watcher.sent.back();
    BOOST_TEST(told.find(R"("servers":[{"address":"b:2000","load":10,)") != std::string::npos);
    BOOST_TEST(told.find("a:2000") == std::string::npos);
    changes.resize(1);
    changes[0].kind = ServerChange::Kind::changed;
    changes[0].server.drain = true;
    fixture.fleet.change(changes);
    for (int i = 0; i < 4; ++i)
        BOOST_TEST(fixture.get("/session").body == "wss://c:2000");
    fixture.world.advance(1s);
    BOOST_TEST(watcher.sent.back().find(R"("drained":"configuration")") != std::string::npos);
    watcher.browser_leaves();
    fixture.world.settle();
}

BOOST_AUTO_TEST_CASE(without_a_server_session_says_so_with_status_200)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "95").always();
    fixture.start({"a:2000"});
    auto const answer = fixture.get("/session");
    BOOST_TEST(answer.status == 200);
    BOOST_TEST(answer.body == "Error: no simulation server available at the moment.");
    BOOST_TEST(header(answer, "Webots-Reason") == "no-machine");
}

BOOST_AUTO_TEST_CASE(methods_and_unknown_paths_are_answered_as_ever)
{
    Fixture fixture;
    BOOST_TEST(fixture.get("/session", "OPTIONS").status == 204);
    BOOST_TEST(header(fixture.get("/session", "OPTIONS"), "Access-Control-Allow-Origin") == "*");
    auto const refused = fixture.get("/session", "POST");
    BOOST_TEST(refused.status == 405);
    BOOST_TEST(refused.body ==
               "<html><title>405: Method Not Allowed</title><body>405: Method Not Allowed</body></html>");
    BOOST_TEST(header(refused, "Access-Control-Allow-Origin") == "*");
    BOOST_TEST(header(refused, "Allow") == "GET, HEAD, OPTIONS");
    BOOST_TEST(header(fixture.get("/load", "PUT"), "Allow") == "GET, HEAD");
    BOOST_TEST(fixture.get("/session/").status == 404);
    BOOST_TEST(fixture.get("/nope").body ==
               "<html><title>404: Not Found</title><body>404: Not Found</body></html>");
}

// Tornado answers 405; load balancers and `curl -I` ask so.
BOOST_AUTO_TEST_CASE(head_is_answered_as_get_but_takes_no_place)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    fixture.start({"a:2000"});
    for (auto const* path : {"/", "/load", "/livez", "/readyz", "/viewer/", "/viewer", "/nope"}) {
        auto const answer = fixture.get(path, "HEAD");
        BOOST_TEST((answer == fixture.get(path)), path);
    }
    BOOST_TEST(fixture.get("/monitor", "HEAD").status == 200);
    auto const session = fixture.get("/session", "HEAD");
    BOOST_TEST(session.status == 200);
    BOOST_TEST(content_type(session) == "text/html; charset=UTF-8");
    BOOST_TEST(header(session, "Access-Control-Allow-Origin") == "*");
    BOOST_TEST(session.body == ""); // HEAD places nobody, so there is no address
    BOOST_TEST(fixture.get("/metrics").body.find("webots_placements_total{result=\"placed\"} 0\n") !=
               std::string::npos);
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000");
}

BOOST_AUTO_TEST_CASE(every_text_is_html_and_only_session_is_for_other_origins)
{
    Fixture fixture;
    for (auto const* path :
         {"/", "/load", "/monitor", "/livez", "/readyz", "/session", "/session/", "/nope"}) {
        auto const answer = fixture.get(path);
        BOOST_TEST(content_type(answer) == "text/html; charset=UTF-8", path);
        BOOST_TEST((header(answer, "Access-Control-Allow-Origin") == "*") ==
                       (path == std::string_view("/session")),
                   path);
    }
}

BOOST_AUTO_TEST_CASE(whatever_follows_the_question_mark_is_ignored)
{
    Fixture fixture;
    IncomingRequest request;
    request.method = "GET";
    for (auto const* path : {"/", "/load", "/session", "/livez"}) {
        request.path = path;
        request.query = "url=https://github.com/o/r/blob/main/worlds/w.wbt";
        BOOST_TEST((std::get<HttpResponse>(fixture.service.respond(request)) == fixture.get(path)), path);
    }
}

BOOST_AUTO_TEST_CASE(load_is_the_mean_of_the_servers_that_are_up)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    fixture.http.expect("GET http://b:2000/load").reply(200, "5.75").always();
    fixture.http.expect("GET http://c:2000/load").fail(errc::unreachable).always();
    BOOST_TEST(fixture.get("/load").body == "-1");
    fixture.start({"a:2000", "b:2000", "c:2000"});
    BOOST_TEST(fixture.get("/load").body == "7.875");
}

BOOST_AUTO_TEST_CASE(a_browser_gets_the_current_availability_once_and_then_only_changes)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10");
    fixture.http.expect("GET http://a:2000/load").reply(200, "20");
    fixture.http.expect("GET http://a:2000/load").reply(200, "99");
    fixture.http.expect("GET http://a:2000/load").reply(200, "98");
    fixture.http.expect("GET http://a:2000/load").fail(errc::unreachable);
    fixture.http.expect("GET http://a:2000/load").reply(200, "1").always();
    testing::LoopbackChannel early(fixture.world.executor());
    fixture.connect(early);
    fixture.start({"a:2000"});
    fixture.world.advance(40s);
    BOOST_TEST(early.sent == (std::vector<std::string>{"0", "1", "0", "1"}),
               boost::test_tools::per_element());
    testing::LoopbackChannel late(fixture.world.executor());
    fixture.connect(late);
    BOOST_TEST(late.sent == (std::vector<std::string>{"1"}), boost::test_tools::per_element());
    early.browser_leaves();
    late.browser_leaves();
    fixture.world.settle();
}

BOOST_AUTO_TEST_CASE(who_asks_for_it_is_told_in_a_word_what_the_site_is)
{
    auto const report = [](std::string_view members) {
        return webots_cloud::core::concat(R"({"load":20,"sessions":3,"capacity":4)", members, "}");
    };
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, report(""));
    fixture.http.expect("GET http://a:2000/load").reply(200, R"({"load":96,"sessions":3,"capacity":4})");
    fixture.http.expect("GET http://a:2000/load").reply(200, R"({"load":20,"sessions":4,"capacity":4})");
    fixture.http.expect("GET http://a:2000/load").reply(200, report(R"(,"draining":true)"));
    fixture.http.expect("GET http://a:2000/load").fail(errc::unreachable);
    fixture.http.expect("GET http://a:2000/load").reply(200, report("")).always();
    testing::LoopbackChannel browser(fixture.world.executor());
    fixture.connect(browser, "/", "state");
    BOOST_TEST(browser.sent.back() == "unknown");
    fixture.start({"a:2000"});
    fixture.world.advance(40s);
    BOOST_TEST(browser.sent ==
                   (std::vector<std::string>{"unknown", "free", "busy", "full", "draining", "down", "free"}),
               boost::test_tools::per_element());
    auto const metrics = fixture.get("/metrics").body;
    BOOST_TEST(metrics.find("webots_site_state{state=\"free\"} 1\n") != std::string::npos);
    BOOST_TEST(metrics.find("webots_site_state{state=\"down\"} 0\n") != std::string::npos);
    browser.browser_leaves();
    fixture.world.settle();
}

BOOST_AUTO_TEST_CASE(a_site_without_machines_is_down)
{
    Fixture fixture;
    fixture.start({});
    testing::LoopbackChannel browser(fixture.world.executor());
    fixture.connect(browser, "/", "state");
    BOOST_TEST(browser.sent.back() == "down");
    browser.browser_leaves();
    fixture.world.settle();
}

BOOST_AUTO_TEST_CASE(who_watches_the_monitor_gets_everything_once_and_then_what_changes)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10");
    fixture.http.expect("GET http://a:2000/load").reply(200, "96").always();
    fixture.start({"a:2000"});
    fixture.world.advance(1s);
    BOOST_TEST(fixture.upgrades("/monitor"));
    testing::LoopbackChannel watcher(fixture.world.executor());
    fixture.connect(watcher, "/monitor");
    BOOST_TEST(watcher.sent.size() == 1u);
    BOOST_TEST(watcher.sent[0].find("\"servers\":[{\"address\":\"a:2000\",\"load\":10,") != std::string::npos,
               watcher.sent[0]);
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000");
    fixture.world.advance(1s);
    BOOST_TEST(watcher.sent.back().find("\"rows\":[{\"row\":0,\"load\":10,\"placed\":1,") !=
                   std::string::npos,
               watcher.sent.back());
    fixture.world.advance(8s);
    BOOST_TEST(watcher.sent.size() <= 11u); // at most one a second
    auto const told = std::count_if(watcher.sent.begin(), watcher.sent.end(), [](std::string const& text) {
        return text.find("\"load\":96,") != std::string::npos;
    });
    BOOST_TEST(told >= 1);
    watcher.browser_leaves();
    fixture.world.settle();
    auto const before = watcher.sent.size();
    fixture.world.advance(20s);
    BOOST_TEST(watcher.sent.size() == before);
}

BOOST_AUTO_TEST_CASE(a_list_that_is_read_again_costs_what_is_different_in_it)
{
    Fixture fixture;
    for (auto const* const address : {"a:2000", "b:2000", "c:2000"})
        fixture.http.expect("GET http://" + std::string(address) + "/load").reply(200, "10").always();
    fixture.start({"a:2000", "b:2000", "c:2000"});
    fixture.world.advance(1s);
    testing::LoopbackChannel watcher(fixture.world.executor());
    fixture.connect(watcher, "/monitor");
    fixture.world.advance(1500ms); // between two polls
    std::vector<ServerSpec> servers = {ServerSpec("a:2000"), ServerSpec("b:2000"), ServerSpec("c:2000")};
    auto const rows_told = [&] {
        auto const before = watcher.sent.size();
        fixture.reload(servers);
        std::string told;
        for (auto i = before; i < watcher.sent.size(); ++i)
            told += watcher.sent[i];
        return std::array{told.find("\"row\":0,") != std::string::npos,
                          told.find("\"row\":1,") != std::string::npos,
                          told.find("\"row\":2,") != std::string::npos};
    };
    (void)rows_told();
    BOOST_TEST((rows_told() == std::array{false, false, false}));
    servers[1].drain = true;
    BOOST_TEST((rows_told() == std::array{false, true, false}));
    BOOST_TEST((rows_told() == std::array{false, false, false}));
    servers[1].drain = false;
    BOOST_TEST((rows_told() == std::array{false, true, false}));
    for (int i = 0; i < 20; ++i)
        BOOST_TEST(fixture.get("/session").body.starts_with("wss://"));
    watcher.browser_leaves();
    fixture.world.settle();
}

BOOST_AUTO_TEST_CASE(who_watches_hears_once_that_a_server_is_down_for_the_same_reason)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10");
    for (int i = 0; i < 4; ++i)
        fixture.http.expect("GET http://a:2000/load").fail(errc::unreachable);
    fixture.http.expect("GET http://a:2000/load").hang().always();
    fixture.start({"a:2000"});
    fixture.world.advance(1s);
    testing::LoopbackChannel watcher(fixture.world.executor());
    fixture.connect(watcher, "/monitor");
    auto const rows_told = [&watcher] {
        return std::count_if(watcher.sent.begin() + 1, watcher.sent.end(), [](std::string const& text) {
            return text.find("{\"row\":0,\"load\":null,") != std::string::npos;
        });
    };
    fixture.world.advance(15s); // two or three failures
    BOOST_TEST(rows_told() == 1);
    fixture.world.advance(30s); // and then it is too slow
    BOOST_TEST(rows_told() == 2);
    watcher.browser_leaves();
    fixture.world.settle();
}

// One client must not keep the event loop from the others.
BOOST_AUTO_TEST_CASE(all_who_come_to_watch_between_two_updates_get_one_text_and_miss_nothing)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    fixture.start({"a:2000"});
    fixture.world.advance(1s);
    testing::LoopbackChannel first(fixture.world.executor());
    fixture.connect(first, "/monitor");
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000"); // a snapshot made anew would count it
    testing::LoopbackChannel second(fixture.world.executor());
    fixture.connect(second, "/monitor");
    BOOST_TEST_REQUIRE(second.sent.size() == 1u);
    BOOST_TEST(second.sent[0] == first.sent.at(0));
    fixture.world.advance(1s);
    BOOST_TEST(second.sent.back().find("\"rows\":[{\"row\":0,\"load\":10,\"placed\":1,") != std::string::npos,
               second.sent.back());
    testing::LoopbackChannel third(fixture.world.executor());
    fixture.connect(third, "/monitor");
    BOOST_TEST(third.sent.at(0).find("\"placed\":1,") != std::string::npos, third.sent.at(0));
    for (auto* const watcher : {&first, &second, &third})
        watcher->browser_leaves();
    fixture.world.settle();
}

// One client must not keep the event loop from the others.
BOOST_AUTO_TEST_CASE(the_monitor_page_is_made_once_a_second_for_all_who_ask)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    fixture.start({"a:2000"});
    auto const page = fixture.get("/monitor");
    BOOST_TEST_REQUIRE((page.shared != nullptr));
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000"); // which the page counts
    BOOST_TEST((fixture.get("/monitor").shared == page.shared));
    fixture.world.advance(1s);
    BOOST_TEST((fixture.get("/monitor").shared != page.shared));
}

// One page must not keep the event loop from others.
BOOST_AUTO_TEST_CASE(the_page_of_very_many_machines_asks_for_them_by_itself)
{
    Fixture fixture;
    std::vector<ServerSpec> machines;
    for (int i = 0; i < 500; ++i)
        machines.emplace_back("m" + std::to_string(i) + ":2000");
    fixture.fleet.set(machines);
    BOOST_TEST(fixture.get("/monitor").text().find("\"address\":\"m499:2000\"") != std::string::npos);
    machines.emplace_back("m500:2000");
    fixture.fleet.set(machines);
    auto const page = fixture.get("/monitor").text();
    BOOST_TEST(page.find("\"address\"") == std::string::npos);
    BOOST_TEST(page.find("Managing 501 simulation servers:") != std::string::npos);
    BOOST_TEST(fixture.get("/monitor", "GET", "application/json").text().find("m500:2000") !=
               std::string::npos);
}

BOOST_AUTO_TEST_CASE(get_on_the_root_tells_availability_too)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    BOOST_TEST(fixture.get("/").body == "0");
    fixture.start({"a:2000"});
    BOOST_TEST(fixture.get("/").body == "1");
}

BOOST_AUTO_TEST_CASE(people_who_open_the_root_are_led_to_the_viewer_where_there_is_no_gallery)
{
    SessionConfig config;
    config.service.worlds.emplace();
    Fixture fixture(config);
    auto const opened = fixture.get("/", "GET", "text/html,application/xhtml+xml,*/*;q=0.8");
    BOOST_TEST(opened.status == 302);
    BOOST_TEST(header(opened, "Location") == "viewer/");
    for (auto const& answer : {opened, fixture.get("/")})
        BOOST_TEST(header(answer, "Vary") == "Accept");
}

BOOST_AUTO_TEST_CASE(people_who_open_the_root_are_led_to_the_gallery_and_scripts_get_a_number)
{
    SessionConfig config;
    config.service.viewer_url = "local:/o/r/blob/main/worlds/a.wbt";
    Fixture fixture(config);
    auto const opened = fixture.get("/", "GET", "text/html,application/xhtml+xml,*/*;q=0.8");
    BOOST_TEST(opened.status == 302);
    BOOST_TEST(header(opened, "Location") == "viewer/worlds/");
    BOOST_TEST(fixture.get("/").body == "0");
    BOOST_TEST(text_of(fixture.get("/viewer/worlds/")).find("<html") != std::string::npos);
    BOOST_TEST(header(fixture.get("/viewer/worlds"), "Location") == "worlds/");
    BOOST_TEST(text_of(fixture.get("/viewer/worlds/list.json")) ==
               R"({"worlds":[{"url":"local:/o/r/blob/main/worlds/a.wbt","title":"A"}],)"
               R"("site":{"url":"local:/o/r/blob/main/worlds/a.wbt"}})");
    config.service.worlds.emplace();
    fixture.service.apply(config);
    BOOST_TEST(text_of(fixture.get("/viewer/worlds/list.json")) ==
               R"({"worlds":[],"site":{"url":"local:/o/r/blob/main/worlds/a.wbt"}})");
    BOOST_TEST(header(fixture.get("/", "GET", "text/html"), "Location") == "viewer/");
}

namespace {

/// Asks somebody who comes later.
struct LaterHttp final : HttpClient
{
    boost::asio::awaitable<result<HttpResponse>> send(HttpRequest request) override
    {
        return to->send(std::move(request));
    }

    HttpClient* to = nullptr;
};

/// Whose gallery asks machines, by the same script as polls.
struct GalleryFixture
{
    explicit GalleryFixture(SessionServiceHooks others = SessionServiceHooks())
        : fixture(plain(), hooks(std::move(others)))
    {
        later.to = &fixture.http;
        fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
        fixture.http.expect("GET http://b:2000/load").reply(200, "10").always();
    }

    static SessionConfig plain()
    {
        SessionConfig config;
        config.address.ssl = false;
        return config;
    }

    SessionServiceHooks hooks(SessionServiceHooks hooks)
    {
        hooks.http = &later;
        return hooks;
    }

    static SessionServiceHooks with_tickets()
    {
        SessionServiceHooks hooks;
        hooks.make_ticket = [](std::string_view server) { return "for-" + std::string(server); };
        return hooks;
    }

    /// What a page is answered that asks for the worlds of this address.
    std::string list(std::string_view address)
    {
        IncomingRequest request;
        request.method = "POST";
        request.path = "/viewer/worlds/list";
        request.client = "203.0.113.7";
        request.quota_key = fixture.client;
        request.body = address;
        BOOST_TEST(fixture.service.max_body(request) == 4096u);
        return fixture.world.run(fixture.service.respond_to_body(request)).body;
    }

    /// As the list says them.
    std::string titles()
    {
        std::string found;
        auto const list = text_of(fixture.get("/viewer/worlds/list.json"));
        constexpr std::string_view key = R"("title":")";
        for (auto at = list.find(key); at != std::string::npos; at = list.find(key, at + 1))
            found += list.substr(at + key.size(), list.find('"', at + key.size()) - at - key.size()) + ";";
        return found;
    }

    LaterHttp later;
    Fixture fixture;
};

std::string list_of(std::string_view name)
{
    return webots_cloud::core::concat(R"({"worlds":[{"url":"local:/o/r/blob/main/worlds/)", name,
                                      R"(.wbt","title":")", name, R"("}]})");
}

} // namespace

BOOST_AUTO_TEST_CASE(worlds_in_folders_of_machines_are_found_without_any_configuration)
{
    GalleryFixture gallery;
    auto& fixture = gallery.fixture;
    fixture.http.expect("GET http://a:2000/worlds").reply(200, list_of("one"));
    fixture.http.expect("GET http://a:2000/worlds").fail(Failure(errc::timed_out));
    fixture.http.expect("GET http://a:2000/worlds").reply(200, list_of("three"));
    fixture.http.expect("GET http://b:2000/worlds").reply(404, "not found").always();
    fixture.start({"a:2000", "b:2000"});
    BOOST_TEST(gallery.titles() == "");
    fixture.world.advance(10s);
    BOOST_TEST(gallery.titles() == "one;");
    fixture.world.advance(31s); // the second answer is none, and changes nothing
    BOOST_TEST(fixture.polls_of("http://a:2000/worlds") == 2u);
    BOOST_TEST(gallery.titles() == "one;");
    fixture.world.advance(31s);
    BOOST_TEST(gallery.titles() == "three;");
    fixture.reload({});
    fixture.world.advance(2s);
    BOOST_TEST(gallery.titles() == "");
}

BOOST_AUTO_TEST_CASE(pictures_of_its_worlds_are_fetched_once_and_no_others)
{
    GalleryFixture gallery;
    auto& fixture = gallery.fixture;
    auto const key = webots_cloud::core::picture_key("local:/o/r/blob/main/worlds/one.wbt");
    auto const jpeg = "\xff\xd8\xff" + std::string(3000, 'x');
    auto const with = [](std::string list, std::string const& keys) {
        list.pop_back();
        return list + R"(,"pictures":[)" + keys + "]}";
    };
    auto const offered = with(list_of("one"), R"("0123456789abcdef",")" + key + R"(")");
    fixture.http.expect("GET http://a:2000/worlds").reply(200, offered).always();
    fixture.http.expect("GET http://a:2000/worlds/picture/" + key).reply(200, "<html>");
    fixture.http.expect("GET http://a:2000/worlds/picture/" + key).reply(200, jpeg);
    fixture.start({"a:2000"});
    fixture.world.advance(20s);
    BOOST_TEST(fixture.get("/viewer/worlds/picture/" + key).status == 404); // no picture was answered
    fixture.world.advance(31s);
    auto const picture = fixture.get("/viewer/worlds/picture/" + key);
    BOOST_TEST(picture.status == 200);
    BOOST_TEST(content_type(picture) == "image/jpeg");
    BOOST_TEST(text_of(fixture.get("/viewer/worlds/list.json")).find("picture/" + key) != std::string::npos);
    BOOST_TEST(fixture.get("/viewer/worlds/picture/0123456789abcdef").status == 404);
    fixture.world.advance(100s);
    BOOST_TEST(fixture.polls_of("http://a:2000/worlds/picture/" + key) == 2u);
}

BOOST_AUTO_TEST_CASE(the_worlds_of_a_pasted_address_are_those_that_a_machine_finds)
{
    GalleryFixture gallery;
    auto& fixture = gallery.fixture;
    fixture.client = "203.0.113.7";
    for (auto const* machine : {"a", "b"})
        fixture.http.expect(std::string("GET http://") + machine + ":2000/worlds").reply(404, "").always();
    fixture.http.expect("POST http://b:2000/worlds/list").reply(404, "<html>"); // an old server
    fixture.http.expect("POST http://a:2000/worlds/list").reply(200, list_of("one"));
    BOOST_TEST(gallery.list("https://github.com/o/r").find(R"("code":"no-machine")") != std::string::npos);
    fixture.start({"a:2000", "b:2000"});
    fixture.world.advance(10s);
    BOOST_TEST(gallery.list(" https://github.com/o/r\n") == list_of("one"));
    auto const& asked = fixture.http.requests().back();
    BOOST_TEST(asked.body == "https://github.com/o/r");
    bool const names_client =
        std::ranges::find(asked.headers, std::pair<std::string, std::string>(
                                             "X-Forwarded-For", "203.0.113.7")) != asked.headers.end();
    BOOST_TEST(names_client);

    std::string const not_there = R"({"error":"Repository o/x does not exist.","code":"no-repository"})";
    fixture.http.expect("POST http://a:2000/worlds/list").reply(200, not_there);
    BOOST_TEST(gallery.list("https://github.com/o/x") == not_there, "no other machine is asked");
    std::string const busy = R"({"error":"Too many.","code":"busy-lists"})";
    fixture.http.expect("POST http://b:2000/worlds/list").reply(503, busy);
    fixture.http.expect("POST http://a:2000/worlds/list").fail(Failure(errc::timed_out));
    BOOST_TEST(gallery.list("https://github.com/o/y") == busy);
}

BOOST_AUTO_TEST_CASE(machines_that_want_tickets_are_asked_with_one)
{
    auto hooks = GalleryFixture::with_tickets();
    GalleryFixture gallery(hooks);
    auto& fixture = gallery.fixture;
    fixture.http.expect("GET http://a:2000/worlds").reply(404, "").always();
    fixture.http.expect("POST http://a:2000/ticket/for-a:2000/worlds/list").reply(200, list_of("one"));
    fixture.start({"a:2000"});
    fixture.world.advance(10s);
    BOOST_TEST(gallery.list("https://github.com/o/r") == list_of("one"));
}

BOOST_AUTO_TEST_CASE(a_list_is_not_waited_for_by_a_server_that_stops_nor_asked_for_too_often)
{
    GalleryFixture gallery;
    auto& fixture = gallery.fixture;
    fixture.client = "203.0.113.7";
    fixture.http.expect("GET http://a:2000/worlds").reply(404, "").always();
    fixture.http.expect("POST http://a:2000/worlds/list").hang().always();
    fixture.start({"a:2000"});
    fixture.world.advance(10s);
    for (int i = 0; i < 200; ++i)
        fixture.get("/session");
    BOOST_TEST(gallery.list("https://github.com/o/r").find(R"("code":"too-fast")") != std::string::npos);
    fixture.world.advance(10s);
    auto const began = fixture.world.clock.now();
    BOOST_TEST(gallery.list("https://github.com/o/r").find(R"("code":"no-machine")") != std::string::npos);
    BOOST_TEST((fixture.world.clock.now() - began == 25s));
    fixture.service.stopping();
    BOOST_TEST(gallery.list("https://github.com/o/r").find(R"("code":"server-stops")") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(not_all_machines_of_a_large_site_are_asked_for_worlds)
{
    GalleryFixture gallery;
    auto& fixture = gallery.fixture;
    std::vector<std::string> machines;
    for (int i = 0; i < 30; ++i) {
        machines.push_back("m" + std::to_string(i) + ":2000");
        fixture.http.expect("GET http://" + machines.back() + "/load").reply(200, "10").always();
        fixture.http.expect("GET http://" + machines.back() + "/worlds").reply(200, list_of("one")).always();
    }
    fixture.start(machines);
    fixture.world.advance(29s);
    auto const asks_for_worlds = [](HttpRequest const& request) { return request.url.ends_with("/worlds"); };
    BOOST_TEST(std::ranges::count_if(fixture.http.requests(), asks_for_worlds) == 8);
    BOOST_TEST(gallery.titles() == "one;");
}

BOOST_AUTO_TEST_CASE(what_a_browser_says_is_logged_safely_and_ignored)
{
    Fixture fixture;
    testing::LoopbackChannel browser(fixture.world.executor());
    fixture.connect(browser);
    browser.browser_says("hello\nfaked line");
    fixture.world.settle();
    BOOST_TEST(fixture.log.contains("[localhost:1999] New client (203.0.113.7)"));
    BOOST_TEST(fixture.log.contains("[localhost:1999] Ignored client message: hello\\x0afaked line"));
    browser.browser_leaves();
    fixture.world.settle();
    BOOST_TEST(fixture.log.contains("[localhost:1999] Client disconnected"));
    BOOST_TEST(browser.sent.size() == 1u);
}

BOOST_AUTO_TEST_CASE(session_over_a_websocket_is_one_frame_and_a_normal_close)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    fixture.start({"a:2000"});
    BOOST_TEST(fixture.upgrades("/session"));
    BOOST_TEST(fixture.upgrades("/"));
    testing::LoopbackChannel browser(fixture.world.executor());
    fixture.connect(browser, "/session");
    BOOST_TEST(browser.sent == (std::vector<std::string>{"wss://a:2000"}), boost::test_tools::per_element());
    BOOST_TEST(browser.close_code.value() == 1000);
}

SessionConfig with_budget(std::size_t burst, double rate)
{
    SessionConfig config;
    config.service.session_burst = burst;
    config.service.session_rate = rate;
    return config;
}

// Protocol 2.1: status 200 in every case, and a text that starts with "Error:" is shown.
BOOST_AUTO_TEST_CASE(who_asks_for_sessions_too_often_is_told_so_and_others_are_served)
{
    Fixture fixture(with_budget(5, 0.5));
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    fixture.start({"a:2000"});
    fixture.client = "203.0.113.7";
    for (int i = 0; i < 5; ++i)
        BOOST_TEST(fixture.get("/session").body == "wss://a:2000");
    auto const refused = fixture.get("/session");
    BOOST_TEST(refused.status == 200);
    BOOST_TEST(refused.body ==
               "Error: too many sessions are asked for from your network. Please try again in a moment.");
    BOOST_TEST(header(refused, "Retry-After") == "2");
    BOOST_TEST(header(refused, "Webots-Reason") == "too-fast");
    BOOST_TEST(header(refused, "Access-Control-Expose-Headers") == "Webots-Reason");
    BOOST_TEST(header(refused, "Access-Control-Allow-Origin") == "*");
    BOOST_TEST(content_type(refused) == "text/html; charset=UTF-8");
    BOOST_TEST(fixture.get("/session", "OPTIONS").status == 204);
    BOOST_TEST(fixture.get("/").body == "1");
    for (int i = 0; i < 20; ++i)
        fixture.get("/session");
    BOOST_TEST(std::count_if(fixture.log.lines.begin(), fixture.log.lines.end(), [](std::string const& line) {
                   return line.find("from 203.0.113.7: see \"sessionBurst\" and \"sessionRate\"") !=
                          std::string::npos;
               }) == 1);
    BOOST_TEST(fixture.get("/metrics").body.find("webots_placements_total{result=\"limited\"} 21\n") !=
               std::string::npos);
    fixture.client = "203.0.113.8";
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000");
    fixture.client = "203.0.113.7";
    fixture.world.advance(2s);
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000");
    BOOST_TEST(fixture.get("/session").body.starts_with("Error: too many"));
    fixture.service.apply(with_budget(7, 0.5));
    for (int i = 0; i < 7; ++i)
        BOOST_TEST(fixture.get("/session").body == "wss://a:2000");
    fixture.service.apply(with_budget(7, 0.5));
    BOOST_TEST(fixture.get("/session").body.starts_with("Error: too many"),
               "what did not change is not forgiven");
}

BOOST_AUTO_TEST_CASE(sessions_over_websockets_are_counted_with_the_others)
{
    Fixture fixture(with_budget(2, 1));
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    fixture.start({"a:2000"});
    fixture.client = "2001:db8::/64";
    auto const ask = [&fixture] {
        testing::LoopbackChannel browser(fixture.world.executor());
        fixture.connect(browser, "/session");
        BOOST_TEST(browser.close_code.value() == 1000);
        return browser.sent.front();
    };
    BOOST_TEST(ask() == "wss://a:2000");
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000");
    BOOST_TEST(ask() ==
               "Error: too many sessions are asked for from your network. Please try again in a moment.");
    fixture.client.clear(); // a trusted proxy itself
    for (int i = 0; i < 10; ++i)
        BOOST_TEST(ask() == "wss://a:2000");
}

BOOST_AUTO_TEST_CASE(transitions_are_logged_in_the_words_that_operators_know)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "99.5");
    fixture.http.expect("GET http://a:2000/load").reply(200, "7");
    fixture.http.expect("GET http://a:2000/load").fail(errc::unreachable);
    fixture.http.expect("GET http://a:2000/load").reply(200, "8");
    fixture.http.expect("GET http://a:2000/load").hang();
    fixture.http.expect("GET http://a:2000/load").reply(200, "9").always();
    fixture.start({"a:2000"});
    fixture.world.advance(40s);
    for (auto const* line : {"a:2000 simulation server has reached maximum load (99.5%)",
                             "a:2000 simulation server is available again (load = 7.0%)",
                             "a:2000 simulation server is not responding (assuming 100% load)",
                             "a:2000 simulation server is up and running again (load = 8.0%)",
                             "a:2000 simulation server is taking too long to respond (assuming 100% load)",
                             "a:2000 simulation server is up and running again (load = 9.0%)"})
        BOOST_TEST(fixture.log.contains(line), line);
}

BOOST_AUTO_TEST_CASE(an_operator_who_hears_of_changes_is_told_instead_of_the_log)
{
    std::vector<LoadTransition> told;
    SessionServiceHooks hooks;
    hooks.tell_operator = [&](LoadEvent const& event) {
        if (event.transition == LoadTransition::too_slow)
            return false;
        told.push_back(event.transition);
        return true;
    };
    Fixture fixture(SessionConfig(), std::move(hooks));
    fixture.http.expect("GET http://a:2000/load").reply(200, "99.5");
    fixture.http.expect("GET http://a:2000/load").reply(200, "7");
    fixture.http.expect("GET http://a:2000/load").fail(errc::unreachable);
    fixture.http.expect("GET http://a:2000/load").reply(200, "8");
    fixture.http.expect("GET http://a:2000/load").hang();
    fixture.http.expect("GET http://a:2000/load").reply(200, "9").always();
    fixture.start({"a:2000"});
    fixture.world.advance(40s);
    BOOST_TEST((told == std::vector{LoadTransition::reached_maximum, LoadTransition::available_again,
                                    LoadTransition::not_responding, LoadTransition::working_again,
                                    LoadTransition::working_again}));
    BOOST_TEST(fixture.log.lines ==
                   (std::vector<std::string>{
                       "a:2000 simulation server is taking too long to respond (assuming 100% load)"}),
               boost::test_tools::per_element());
}

// Quirk Q3 of the reference: there, the dead server stays available.
BOOST_AUTO_TEST_CASE(a_mail_server_that_is_down_does_not_keep_a_dead_server_available)
{
    testing::World world;
    testing::RecordingLog log;
    testing::RecordingNotifier notifier(world.clock);
    notifier.failure = Failure(errc::unreachable, "no mail server");
    OperatorMail mail("admin@b.org", PublicAddress(), notifier, world.clock, log.logger());
    async::TaskGroup tasks(world.executor());
    tasks.spawn(run(mail));
    {
        SessionServiceHooks hooks;
        hooks.tell_operator = [&](LoadEvent const& event) { return mail.note(event); };
        Fixture fixture(SessionConfig(), std::move(hooks));
        fixture.http.expect("GET http://a:2000/load").reply(200, "10");
        fixture.http.expect("GET http://a:2000/load").fail(errc::unreachable).always();
        fixture.start({"a:2000"});
        BOOST_TEST(fixture.get("/").body == "1");
        fixture.world.advance(10s);
        BOOST_TEST(fixture.get("/").body == "0");
        world.settle();
        BOOST_TEST(log.contains("Error: unable to send email to"));
        BOOST_TEST(fixture.get("/session").body.starts_with("Error:"));
    }
    world.run(tasks.end());
}

BOOST_AUTO_TEST_CASE(probes_and_figures_tell_the_operator_how_it_is)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    BOOST_TEST(fixture.get("/livez").status == 200);
    BOOST_TEST(fixture.get("/readyz").status == 503);
    BOOST_TEST(fixture.get("/session").body.starts_with("Error:"));
    fixture.start({"a:2000"});
    BOOST_TEST(fixture.get("/readyz").status == 200);
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000");
    auto const figures = fixture.get("/metrics");
    BOOST_TEST(figures.content_type == "text/plain; version=0.0.4; charset=utf-8");
    for (auto const* line :
         {"webots_servers{state=\"up\"} 1\n", "webots_available 1\n",
          "webots_placements_total{result=\"placed\"} 1\n", "webots_placements_total{result=\"refused\"} 1\n",
          "webots_polls_total{result=\"good\"} 1\n"})
        BOOST_TEST(figures.body.find(line) != std::string::npos, line);
}

BOOST_AUTO_TEST_CASE(a_server_whose_machines_are_full_is_ready_and_one_whose_machines_are_gone_is_not)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load")
        .reply(200, R"({"load":25,"sessions":8,"capacity":8,"version":"1"})");
    fixture.http.expect("GET http://a:2000/load").fail(errc::unreachable).always();
    fixture.start({"a:2000"});
    BOOST_TEST(fixture.get("/").body == "0");
    BOOST_TEST(fixture.get("/readyz").status == 200);
    fixture.world.advance(60s);
    BOOST_TEST(fixture.get("/readyz").status == 503);
}

BOOST_AUTO_TEST_CASE(metrics_tell_of_each_machine_what_it_reports_and_whether_it_does)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load")
        .reply(200, R"({"load":25,"sessions":3,"capacity":8,"draining":true,"version":"1"})")
        .always();
    fixture.http.expect("GET http://b/2000/load").reply(200, "50");
    fixture.http.expect("GET http://b/2000/load").fail(errc::unreachable).always();
    fixture.start({"a:2000", "b/2000"});
    auto const says = [&fixture](std::string_view line) {
        return fixture.get("/metrics").text().find(line) != std::string_view::npos;
    };
    BOOST_TEST(fixture.get("/session").body == "wss://b/2000"); // a drains
    for (auto const* line :
         {"webots_machine_up{machine=\"a:2000\"} 1\n", "webots_machine_load_ratio{machine=\"a:2000\"} 0.25\n",
          "webots_machine_simulations{machine=\"a:2000\"} 3\n",
          "webots_machine_simulations_max{machine=\"a:2000\"} 8\n",
          "webots_machine_drained{machine=\"a:2000\"} 1\n", "webots_machine_drained{machine=\"b/2000\"} 0\n",
          "webots_machine_load_ratio{machine=\"b/2000\"} 0.5\n",
          "webots_machine_placements_total{machine=\"b/2000\"} 1\n"})
        BOOST_TEST(says(line), line);
    BOOST_TEST(!says("webots_machine_simulations{machine=\"b/2000\"}"), "it has reported its load alone");
    fixture.world.advance(10s);
    BOOST_TEST(says("webots_machine_up{machine=\"b/2000\"} 0\n"));
    BOOST_TEST(!says("webots_machine_load_ratio{machine=\"b/2000\"}"), "nobody knows what it is now");
    fixture.reload({ServerSpec("a:2000")});
    BOOST_TEST(!says("b/2000"));
}

// Whoever asks often makes the server write a megabyte once a second, not each time.
BOOST_AUTO_TEST_CASE(metrics_of_thousands_of_machines_are_written_once_a_second)
{
    Fixture fixture;
    std::vector<std::string> names;
    for (int i = 0; i < 5000; ++i) {
        names.push_back("m" + std::to_string(i) + ":2000");
        fixture.http.expect("GET http://" + names.back() + "/load").reply(200, "10").always();
    }
    fixture.start(names);
    // Whether the site and the one machine that got it count a placement.
    auto const counted = [&fixture] {
        auto const page = fixture.get("/metrics").body;
        BOOST_TEST(page.size() < 2u << 20);
        auto const machines = page.substr(page.find("# TYPE webots_machine_placements_total"));
        return std::pair(page.find("webots_placements_total{result=\"placed\"} 1\n") != std::string::npos,
                         machines.find("\"} 1\n") != std::string::npos);
    };
    BOOST_TEST((counted() == std::pair(false, false)));
    BOOST_TEST(fixture.get("/session").body.starts_with("wss://m"));
    BOOST_TEST((counted() == std::pair(true, false)));
    fixture.world.advance(1100ms); // it is written in pieces, with pauses
    BOOST_TEST((counted() == std::pair(true, true)));
}

// Nobody waits while a megabyte is written.
BOOST_AUTO_TEST_CASE(metrics_of_thousands_of_machines_are_written_ahead_of_time_in_pieces)
{
    Fixture fixture;
    std::vector<std::string> names;
    for (int i = 0; i < 1000; ++i) {
        names.push_back("m" + std::to_string(i) + ":2000");
        fixture.http.expect("GET http://" + names.back() + "/load").reply(200, "10").always();
    }
    fixture.start(names);
    auto const placed = [&fixture] { // on how many machines
        auto const page = fixture.get("/metrics").body;
        int count = 0;
        for (auto at = page.find("# TYPE webots_machine_placements_total"); at != std::string::npos;
             at = page.find("\"} 1\n", at + 1))
            ++count;
        return count - 1;
    };
    BOOST_TEST(placed() == 0);
    (void)fixture.get("/session");
    fixture.world.advance(1002ms); // in the middle of writing
    BOOST_TEST(placed() == 0);
    fixture.world.advance(10ms);
    BOOST_TEST(placed() == 1);
    (void)fixture.get("/session");
    BOOST_TEST(placed() == 1);
    fixture.world.advance(1020ms);
    BOOST_TEST(placed() == 2);
    // While it is written the operator changes the machines.
    fixture.world.advance(1001ms);
    fixture.reload({ServerSpec("a:2000")});
    fixture.world.advance(10ms);
    auto const page = fixture.get("/metrics").body;
    BOOST_TEST(page.find("machine=\"a:2000\"") != std::string::npos);
    BOOST_TEST(page.find("machine=\"m1:2000\"") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(figures_of_others_follow_its_own)
{
    SessionServiceHooks hooks;
    hooks.more_metrics = [] { return std::string("more_figures 1\n"); };
    Fixture fixture(SessionConfig(), std::move(hooks));
    BOOST_TEST(fixture.get("/metrics").body.ends_with("\nmore_figures 1\n"));
}

BOOST_AUTO_TEST_CASE(new_parameters_hold_at_once_and_browsers_stay)
{
    std::vector<LoadTransition> told;
    SessionServiceHooks hooks;
    hooks.tell_operator = [&told](LoadEvent const& event) {
        told.push_back(event.transition);
        return true;
    };
    Fixture fixture(SessionConfig(), std::move(hooks));
    fixture.http.expect("GET http://a:2000/load").reply(200, "10");
    fixture.http.expect("GET http://a:2000/load").fail(errc::unreachable).always();
    fixture.start({"a:2000"});
    testing::LoopbackChannel browser(fixture.world.executor());
    fixture.connect(browser);
    SessionConfig next;
    next.address.ssl = false;
    next.service.decisions_for_all = true;
    next.service.viewer_url = "https://a.org/w.wbt";
    LoadMonitorParams polls;
    polls.threshold = 5;
    BOOST_TEST(fixture.monitor.apply(polls).has_value());
    fixture.service.apply(std::move(next));
    BOOST_TEST(fixture.get("/session").body == "ws://a:2000");
    BOOST_TEST(fixture.get("/api/decisions").status == 200);
    BOOST_TEST(fixture.get("/viewer/defaults.json").body == R"({"url":"https://a.org/w.wbt"})");
    BOOST_TEST(fixture.get("/monitor").text().find("\"threshold\":5,") != std::string::npos,
               fixture.get("/monitor").text());
    fixture.world.advance(10s);
    BOOST_TEST((told == std::vector{LoadTransition::not_responding}));
    BOOST_TEST(browser.sent == (std::vector<std::string>{"1", "0"}), boost::test_tools::per_element());
    browser.browser_leaves();
    fixture.world.settle();
}

// The hooks of a service are fixed: an operator who is named later is told by what stands behind them.
BOOST_AUTO_TEST_CASE(an_operator_who_is_named_while_it_runs_hears_of_the_next_change)
{
    testing::World world;
    testing::RecordingLog log;
    testing::RecordingNotifier notifier(world.clock);
    OperatorMail mail("", PublicAddress(), notifier, world.clock, log.logger());
    async::TaskGroup tasks(world.executor());
    tasks.spawn(run(mail));
    {
        SessionServiceHooks hooks;
        hooks.tell_operator = [&](LoadEvent const& event) { return mail.note(event); };
        Fixture fixture(SessionConfig(), std::move(hooks));
        fixture.http.expect("GET http://a:2000/load").fail(errc::unreachable);
        fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
        fixture.start({"a:2000"});
        world.advance(1h);
        BOOST_TEST(notifier.delivered.empty());
        BOOST_TEST(fixture.log.contains("a:2000 simulation server is not responding"));
        mail.apply("admin@b.org", PublicAddress());
        fixture.world.advance(10s);
        world.advance(1h);
        BOOST_TEST_REQUIRE(!notifier.delivered.empty());
        BOOST_TEST(!fixture.log.contains("a:2000 simulation server is up and running again"));
    }
    world.run(tasks.end());
}

BOOST_AUTO_TEST_CASE(decisions_are_shown_to_the_operator_only)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    fixture.start({"a:2000"});
    fixture.get("/session");
    BOOST_TEST(fixture.get("/api/decisions").status == 404);
    BOOST_TEST(fixture.get("/api/decisions", "POST").status == 404, "hidden, whatever the method");
    IncomingRequest request;
    request.method = "GET";
    request.path = "/api/decisions";
    request.is_operator = true;
    auto const shown = std::get<HttpResponse>(fixture.service.respond(request));
    BOOST_TEST(shown.status == 200);
    BOOST_TEST(shown.body.find("\"a:2000\"") != std::string::npos);
    request.method = "POST";
    BOOST_TEST(std::get<HttpResponse>(fixture.service.respond(request)).status == 405);
}

// Protocol section 13.4.
BOOST_AUTO_TEST_CASE(a_machine_that_the_operator_drains_gets_nobody_until_that_is_taken_back)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    fixture.http.expect("GET http://b/2000/load").reply(200, "50").always();
    fixture.start({"a:2000", "b/2000"});
    auto const ask = [&fixture](std::string_view query, bool is_operator = true,
                                std::string_view path = "/api/drain", std::string_view method = "POST") {
        IncomingRequest request;
        request.method = method;
        request.path = path;
        request.query = query;
        request.is_operator = is_operator;
        return std::get<HttpResponse>(fixture.service.respond(request));
    };
    testing::LoopbackChannel browser(fixture.world.executor());
    testing::LoopbackChannel watcher(fixture.world.executor());
    fixture.connect(browser);
    fixture.connect(watcher, "/monitor");
    for (auto const* method : {"GET", "POST"}) {
        BOOST_TEST(ask("machine=a:2000", false, "/api/drain", method).status == 404);
        BOOST_TEST(ask("", false, "/api/operator", method).status == 404);
    }
    BOOST_TEST(ask("", true, "/api/operator", "GET").text() == "operator");
    BOOST_TEST(ask("machine=a:2000", true, "/api/drain", "GET").status == 405);
    BOOST_TEST(ask("").status == 400);
    auto const unknown = ask("machine=<x>");
    BOOST_TEST(unknown.status == 400);
    BOOST_TEST(unknown.text() == "There is no machine &lt;x&gt; in \"simulationServers\".");
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000");

    BOOST_TEST(ask("machine=a%3A2000").text() == "draining");
    BOOST_TEST(fixture.log.contains("a:2000 is drained: it gets no new sessions"));
    for (int i = 0; i < 5; ++i)
        BOOST_TEST(fixture.get("/session").body == "wss://b/2000");
    BOOST_TEST(fixture.get("/monitor").text().find("\"drained\":\"operator\"") != std::string::npos);
    BOOST_TEST(fixture.get("/metrics").text().find("\nwebots_servers_drained 1\n") != std::string::npos);
    fixture.world.advance(1s);
    BOOST_TEST(watcher.sent.back().find("\"drained\":\"operator\"") != std::string::npos);

    BOOST_TEST(ask("machine=b/2000").text() == "draining");
    BOOST_TEST(browser.sent.back() == "0"); // at once
    BOOST_TEST(fixture.get("/session").body == "Error: no simulation server available at the moment.");
    fixture.reload({ServerSpec("a:2000"), ServerSpec("b/2000")});
    BOOST_TEST(fixture.get("/session").body == "Error: no simulation server available at the moment.");

    BOOST_TEST(ask("machine=a:2000&off").text() == "serving");
    BOOST_TEST(browser.sent.back() == "1");
    BOOST_TEST(fixture.log.contains("a:2000 gets new sessions again"));
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000");
    fixture.world.advance(1s);
    BOOST_TEST(watcher.sent.back().find("{\"row\":0,") != std::string::npos);
    browser.browser_leaves();
    watcher.browser_leaves();
    fixture.world.settle();
}

BOOST_AUTO_TEST_CASE(the_operator_is_told_that_the_configuration_drains_a_machine)
{
    Fixture fixture;
    fixture.http.expect("GET http://a:2000/load").reply(200, "10").always();
    fixture.start({"a:2000"});
    ServerSpec spec("a:2000");
    spec.drain = true;
    fixture.fleet.set({spec});
    BOOST_TEST(fixture.get("/monitor").text().find("\"drained\":\"configuration\"") != std::string::npos);
    IncomingRequest request;
    request.method = "POST";
    request.path = "/api/drain";
    request.query = "machine=a:2000&off";
    request.is_operator = true;
    auto const answer = std::get<HttpResponse>(fixture.service.respond(request));
    BOOST_TEST(answer.status == 409);
    BOOST_TEST(answer.text() ==
               "The configuration drains this machine, with \"drain\" in \"simulationServers\".");
}

BOOST_AUTO_TEST_CASE(decisions_are_shown_to_everybody_where_the_operator_says_so)
{
    SessionConfig config;
    config.service.decisions_for_all = true;
    Fixture fixture(std::move(config));
    BOOST_TEST(fixture.get("/api/decisions").status == 200);
    BOOST_TEST(fixture.get("/api/decisions").body == R"({"decisions":[]})");
}

BOOST_AUTO_TEST_CASE(a_browser_is_given_a_ticket_for_the_server_that_it_is_sent_to)
{
    SessionServiceHooks hooks;
    hooks.make_ticket = [n = 0](std::string_view server) mutable {
        return "ticket" + std::to_string(++n) + "-for-" + std::string(server);
    };
    Fixture fixture(SessionConfig(), hooks);
    fixture.http.expect("GET http://a:2000/load").reply(200, "1").always();
    BOOST_TEST(fixture.get("/session").body.starts_with("Error: "), "and no ticket where there is no server");
    fixture.start({"a:2000"});
    BOOST_TEST(fixture.get("/session").body == "wss://a:2000/ticket/ticket1-for-a:2000");
    testing::LoopbackChannel browser(fixture.world.executor());
    fixture.connect(browser, "/session");
    BOOST_TEST(browser.sent.front() == "wss://a:2000/ticket/ticket2-for-a:2000");
}

BOOST_AUTO_TEST_CASE(the_gateway_passes_requests_of_machines_on_and_no_others)
{
    GatewayFixture fixture;
    auto& server = fixture.machine;
    BOOST_TEST(fixture.get("/session").body == "wss://sim.example.org/2000");

    HttpHeaders const sandbox{
        {"Content-Security-Policy", "sandbox allow-scripts allow-forms allow-popups allow-downloads"}};
    HttpHeaders const untrusted{{"Webots-Cloud-Untrusted", "1"}};
    IncomingRequest request;
    request.method = "GET";
    request.path = "/2000/client";
    request.query = "a=b";
    for (bool const upgrade : {true, false}) {
        request.upgrade = upgrade;
        auto const answer = fixture.service.respond(request);
        auto const* const forward = std::get_if<Forward>(&answer);
        BOOST_TEST_REQUIRE(forward);
        BOOST_TEST(forward->upstream.host == "10.0.0.2");
        BOOST_TEST(forward->upstream.port == 2000);
        BOOST_TEST(!forward->upstream.tls);
        BOOST_TEST(forward->target == "/client?a=b");
        BOOST_TEST((forward->added_answer_headers == sandbox));
        BOOST_TEST((forward->headers == untrusted));
        BOOST_TEST((forward->kind == UpstreamKind::machine));
    }
    std::array<std::pair<std::string_view, std::string_view>, 1> const worker{{{"Service-Worker", "script"}}};
    request.headers = worker;
    BOOST_TEST(std::get<HttpResponse>(fixture.service.respond(request)).status == 403);
    request.headers = {};
    server.elsewhere = true;
    fixture.fleet.put(server);
    BOOST_TEST(std::get<Forward>(fixture.service.respond(request)).upstream.elsewhere);
    server.first_port = 2001;
    server.last_port = 2002;
    fixture.fleet.set({server});
    request.path = "/2001/robot_windows/x.html";
    auto const page = std::get<Forward>(fixture.service.respond(request));
    BOOST_TEST((page.answer_headers == HttpHeaders{{"Access-Control-Allow-Origin", "*"}}));
    BOOST_TEST((page.added_answer_headers == sandbox));
    BOOST_TEST(page.headers.empty());
    server.first_port = server.last_port = 0;
    request.path = "/2000/client";
    fixture.http.expect("GET https://sim2:2000/load").reply(200, "1").always();
    server.internal_address = "https://sim2:2000";
    fixture.fleet.set({server});
    auto const encrypted = fixture.service.respond(request);
    BOOST_TEST(std::get<Forward>(encrypted).upstream.tls);
    BOOST_TEST(std::get<Forward>(encrypted).upstream.host == "sim2");
    fixture.world.advance(std::chrono::seconds(10));
    for (auto const* path : {"/2001/client", "/2000/metrics", "/2000/api/drain", "/22/", "/2000:80/"})
        BOOST_TEST(fixture.get(path).status == 404, path);
    BOOST_TEST(fixture.get("/load").body == "1.0");

    fixture.initial.service.gateway = false; // by a reload
    fixture.service.apply(fixture.initial);
    BOOST_TEST(fixture.get("/2000/client").status == 404);
}

BOOST_AUTO_TEST_CASE(visitors_of_an_unusual_port_are_sent_to_machines_at_that_port)
{
    SessionConfig config;
    config.address.host = "sim.example.org";
    config.address.port = 8443;
    config.address.port_rewrite = false;
    GatewayFixture fixture(config);
    std::array<std::pair<std::string_view, std::string_view>, 1> const host{
        {{"Host", "sim.example.org:8443"}}};
    IncomingRequest request;
    request.method = "GET";
    request.path = "/session";
    request.headers = host;
    BOOST_TEST(std::get<HttpResponse>(fixture.service.respond(request)).body ==
               "wss://sim.example.org:8443/2000");
    // The machine itself does not know that port.
    request.path = "/2000/client";
    auto const forward = std::get<Forward>(fixture.service.respond(request));
    HttpHeaders const told{{"Webots-Cloud-Untrusted", "1"},
                           {"Webots-Cloud-Address", "wss://sim.example.org:8443/2000"}};
    BOOST_TEST((forward.headers == told));
}

namespace {

using Fields = std::vector<std::pair<std::string_view, std::string_view>>;

/// Of a request that has passed a trusted proxy.
struct ProxiedRequest : IncomingRequest
{
    ProxiedRequest(std::string_view of, Fields const& fields)
    {
        method = "GET";
        path = of;
        headers = fields;
        is_from_proxy = true;
    }
};

} // namespace

BOOST_AUTO_TEST_CASE(behind_a_proxy_that_has_the_site_below_a_path_everything_is_below_it)
{
    SessionConfig config;
    config.address.host = "sim.example.org";
    config.address.port = 1999;
    config.address.ssl = false;
    GatewayFixture fixture(config);
    auto& server = fixture.machine;
    Fields const said{
        {"Host", "sim.example.org"}, {"X-Forwarded-Prefix", "/webots"}, {"X-Forwarded-Proto", "https"}};
    ProxiedRequest request("/session", said);
    BOOST_TEST(std::get<HttpResponse>(fixture.service.respond(request)).body ==
               "wss://sim.example.org/webots/2000");
    request.is_from_proxy = false;
    BOOST_TEST(std::get<HttpResponse>(fixture.service.respond(request)).body == "ws://sim.example.org/2000");
    // The machine can't know the path.
    ProxiedRequest to_machine("/2000/client", said);
    HttpHeaders const told{{"Webots-Cloud-Untrusted", "1"},
                           {"Webots-Cloud-Address", "wss://sim.example.org/webots/2000"}};
    BOOST_TEST((std::get<Forward>(fixture.service.respond(to_machine)).headers == told));
    to_machine.is_from_proxy = false;
    BOOST_TEST(std::get<Forward>(fixture.service.respond(to_machine)).headers.size() == 1u);

    fixture.initial.address.path = "/named"; // by a reload
    fixture.initial.address.ssl = true;
    fixture.service.apply(fixture.initial);
    server.address = "sim.example.org/named/2000";
    fixture.fleet.set({server});
    fixture.world.settle();
    Fields const silent{{"Host", "127.0.0.1:1999"}};
    ProxiedRequest named("/session", silent);
    BOOST_TEST(std::get<HttpResponse>(fixture.service.respond(named)).body ==
               "wss://sim.example.org/named/2000");
}

BOOST_AUTO_TEST_CASE(the_gateway_knows_machines_that_come_and_go_one_by_one)
{
    SessionConfig config;
    config.service.gateway = true;
    Fixture fixture(config);
    for (auto const* port : {"2000", "3000"})
        fixture.http.expect(std::string("GET http://10.0.0.2:") + port + "/load").reply(200, "1").always();
    fixture.start({});
    std::vector<ServerChange> changes(1);
    auto& server = changes[0].server;
    server.address = "sim.example.org/2000";
    server.internal_address = "10.0.0.2:2000";
    IncomingRequest request;
    request.method = "GET";
    request.path = "/2000/client";
    auto const port = [&]() -> std::uint16_t {
        fixture.fleet.change(changes);
        auto const answer = fixture.service.respond(request);
        auto const* const forward = std::get_if<Forward>(&answer);
        return forward ? forward->upstream.port : std::uint16_t{0};
    };
    BOOST_TEST(port() == 2000u);
    changes[0].kind = ServerChange::Kind::changed;
    server.internal_address = "10.0.0.2:3000";
    BOOST_TEST(port() == 3000u);
    changes[0].kind = ServerChange::Kind::removed;
    BOOST_TEST(port() == 0u);
}

// Protocol section 13.18.
BOOST_AUTO_TEST_CASE(controllers_are_passed_on_to_the_machine_whose_port_they_name)
{
    Fixture fixture;
    ServerSpec with("sim.example.org/2000");
    with.controllers = "10.0.0.2:2900";
    ServerSpec other("sim.example.org/2001");
    other.controllers = "10.0.0.3:2900";
    fixture.fleet.set({with, other, ServerSpec("sim.example.org/2002")});
    auto const way = fixture.service.way_of_controller(2001, "key", "my%20robot").value();
    BOOST_TEST(way.upstream.host == "10.0.0.3");
    BOOST_TEST(way.upstream.port == 2900);
    BOOST_TEST(!way.upstream.tls);
    BOOST_TEST(way.asks_for == "key/my%20robot");
    BOOST_TEST(fixture.service.way_of_controller(2000, "key", "").value().asks_for == "key");
    for (std::uint16_t const nobody : {0, 2002, 2900})
        BOOST_TEST((fixture.service.way_of_controller(nobody, "key", "x").error() == errc::refused), nobody);
}

BOOST_AUTO_TEST_CASE(only_what_is_below_the_gateway_of_a_trusted_machine_keeps_the_origin_of_the_site)
{
    GatewayFixture fixture;
    auto& server = fixture.machine;
    auto const keeps_origin = [&](std::string_view path) {
        fixture.fleet.set({server});
        IncomingRequest request;
        request.method = "GET";
        request.path = path;
        auto const forward = std::get<Forward>(fixture.service.respond(request));
        BOOST_TEST(forward.headers.empty() == server.trusted);
        return forward.added_answer_headers.empty();
    };
    for (auto const* path : {"/2000/simulation/abc/2001/", "/2000/simulation/abc/2501/", "/2000/monitor"})
        BOOST_TEST(!keeps_origin(path), path);
    server.trusted = true;
    BOOST_TEST(keeps_origin("/2000/simulation/abc/2501/"), "its gateway knows what is an editor");
    for (auto const* path : {"/2000/monitor", "/2000/", "/2000/simulation", "/2000/x/simulation/"})
        BOOST_TEST(!keeps_origin(path), path);
}

BOOST_AUTO_TEST_CASE(a_found_machine_has_a_path_of_its_own_below_this_server)
{
    SessionConfig config;
    config.service.gateway = true;
    config.address.host = "sim.example.org";
    SessionServiceHooks hooks;
    hooks.make_ticket = [](std::string_view server) { return "for-" + std::string(server); };
    Fixture fixture(config, hooks, [](std::string_view message) {
        return std::string(message.substr(message.size() - 12)) + "...";
    });
    constexpr auto ours =
        R"({"load":1,"sessions":0,"starting":0,"capacity":9,"arrivals":0,"failed":0,"departures":0})";
    fixture.http.expect("GET https://machines.test:2000/load").reply(200, "1");
    fixture.http.expect("GET https://machines.test:2000/load").reply(200, ours);
    fixture.http.expect("GET https://machines.test:2000/load").fail(errc::timed_out);
    fixture.http.expect("GET https://machines.test:2000/load").fail(errc::unreachable).always();
    fixture.start({});
    ServerSpec server("10.0.0.2:2000");
    server.internal_address = "https://10.0.0.2:2000";
    server.internal_name = "machines.test";
    server.has_own_path = true;
    fixture.fleet.set({server});
    fixture.world.settle();

    std::array<std::pair<std::string_view, std::string_view>, 3> const headers{
        {{"Host", "Sim.example.org"},
         {"Origin", "https://sim.example.org"},
         {"Webots-Cloud-Address", "ws://evil"}}};
    IncomingRequest request;
    request.method = "GET";
    request.headers = headers;
    auto const get = [&](std::string_view path) {
        request.path = path;
        return fixture.service.respond(request);
    };
    auto const status = [&](std::string_view path) { return std::get<HttpResponse>(get(path)).status; };
    BOOST_TEST(std::get<HttpResponse>(get("/session")).body.starts_with("Error:"),
               "it may be another service");
    auto const shown = fixture.get("/monitor", "GET", "application/json").text();
    auto const begin = shown.find("/machine/");
    BOOST_TEST_REQUIRE(begin != std::string::npos);
    auto const below = shown.substr(begin, shown.find('"', begin) - begin);
    BOOST_TEST(status(below + "/client") == 502);

    fixture.world.advance(6s); // it has answered as ours
    BOOST_TEST(std::get<HttpResponse>(get("/session")).body ==
               "wss://Sim.example.org" + below + "/ticket/for-10.0.0.2:2000");
    request.query = "a=b";
    auto const forward = std::get<Forward>(get(below + "/client"));
    BOOST_TEST(forward.upstream.host == "10.0.0.2");
    BOOST_TEST(forward.upstream.port == 2000);
    BOOST_TEST(forward.upstream.tls);
    BOOST_TEST(forward.upstream.name == "machines.test");
    BOOST_TEST(forward.target == "/client?a=b");
    BOOST_TEST((forward.added_answer_headers.size() == 1u));
    BOOST_TEST((forward.headers == HttpHeaders{{"Webots-Cloud-Untrusted", "1"},
                                               {"Host", "machines.test:2000"},
                                               {"Origin", ""},
                                               {"Webots-Cloud-Address", "wss://Sim.example.org" + below}}));
    for (auto const& wrong : {below + "/metrics", below + "/api/drain", std::string("/machine/x/client"),
                              std::string("/machine/10.0.0.2:2000/"), std::string("/2000/client")})
        BOOST_TEST(status(wrong) == 404, wrong);

    fixture.world.advance(5s); // a poll is late: it may be busy
    BOOST_TEST(std::holds_alternative<Forward>(get(below + "/client")));
    fixture.world.advance(6s); // nobody is there: whoever comes next may be somebody else
    BOOST_TEST(status(below + "/client") == 502);
    fixture.fleet.set({});
    BOOST_TEST(status(below + "/client") == 404);
    fixture.fleet.set({server});
    BOOST_TEST(status(below + "/client") == 502, "it has come back to its old path");
    config.service.gateway = false;
    fixture.service.apply(config);
    BOOST_TEST(status(below + "/client") == 404);
}

BOOST_AUTO_TEST_CASE(the_viewer_is_served_with_the_types_that_browsers_insist_on)
{
    Fixture fixture;
    BOOST_TEST(fixture.get("/viewer").status == 301);
    BOOST_TEST(header(fixture.get("/viewer"), "Location") == "viewer/");
    BOOST_TEST(fixture.get("/viewer/").content_type == "text/html; charset=UTF-8");
    BOOST_TEST(fixture.get("/viewer/viewer.js").content_type == "text/javascript");
    BOOST_TEST(fixture.get("/viewer/view/session.js").content_type == "text/javascript");
    // In a sandboxed frame the page has no origin, and reads what it is made of like a page of another site.
    for (auto const* path : {"/viewer/viewer.js", "/viewer/view/session.js", "/viewer/defaults.json",
                             "/class/", "/class/class.js", "/class/defaults.json"})
        BOOST_TEST(header(fixture.get(path), "Access-Control-Allow-Origin") == "*", path);
    BOOST_TEST(header(fixture.get("/view/session.js"), "Access-Control-Allow-Origin") == "*");
    BOOST_TEST(fixture.get("/view/nope.js").status == 404);
    BOOST_TEST(header(fixture.get("/view/nope.js"), "Access-Control-Allow-Origin") == "*");
    BOOST_TEST(fixture.get("/viewer/view/../viewer.js").status == 404);
    BOOST_TEST(
        (fixture.get("/viewer/viewer.js").shared == fixture.get("/viewer/viewer.js").shared)); // made once
    BOOST_TEST(header(fixture.get("/viewer/viewer.js"), "ETag") != header(fixture.get("/viewer/"), "ETag"));
    BOOST_TEST(header(fixture.get("/viewer/viewer.js"), "Cache-Control") == "no-cache");
    auto const page = text_of(fixture.get("/viewer/"));
    constexpr std::string_view script = "viewer.js?v=";
    constexpr std::size_t digits = 16;
    auto const found = page.find(script);
    BOOST_TEST_REQUIRE(found != std::string::npos);
    auto const named = core::concat("/viewer/", page.substr(found, script.size() + digits));
    BOOST_TEST(header(fixture.get(named), "Cache-Control") == "public, max-age=31536000, immutable");
    BOOST_TEST(header(fixture.get(named + "0"), "Cache-Control") == "no-cache"); // an older page's
    BOOST_TEST(fixture.get("/viewer/../session").status == 404);
    BOOST_TEST(fixture.get("/viewer/nope.js").status == 404);
}

BOOST_AUTO_TEST_SUITE_END()
