#include "refusal_sentences.hpp"
#include "simulation_fixture.hpp"

#include "core/simulation/gateway_address.hpp"

#include <webots_cloud/simulation_launcher.hpp>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol section 13.12.
BOOST_AUTO_TEST_SUITE(simulation_gateway)

namespace {

using Texts = std::vector<std::string>;
using Headers = std::vector<std::pair<std::string_view, std::string_view>>;

constexpr std::string_view begin = R"({"start":{"url":"https://github.com/o/r/blob/m/worlds/a.wbt"}})";

struct OpenTunnel final : TunnelGroup::Tunnel
{
    void end() override { is_ended = true; }

    bool is_ended = false;
};

/// A server whose simulations are reached through itself.
struct Fixture : SimulationFixture
{
    explicit Fixture(ServiceSetup setup = simulation_service_setup())
        : SimulationFixture(std::move(setup), simulation_service_hooks(), 2, ProcessLimits(), true)
    {}

    /// A browser whose simulation is ready at once.
    testing::LoopbackChannel& start()
    {
        processes.expect().prints(".\n");
        return say("", std::string(begin));
    }

    Answer ask(std::string_view path, bool upgrade = false, std::string_view query = {},
               std::string_view method = "GET")
    {
        IncomingRequest request;
        request.method = method;
        request.path = path;
        request.query = query;
        request.upgrade = upgrade;
        return service.respond(request);
    }

    Forward forwarded(std::string_view path, bool upgrade = false, std::string_view query = {})
    {
        return std::get<Forward>(ask(path, upgrade, query));
    }

    /// What is answered is what an unknown path gets.
    bool is_unknown(std::string_view path, bool upgrade = false, std::string_view method = "GET")
    {
        auto const answer = ask(path, upgrade, {}, method);
        auto const* found = std::get_if<HttpResponse>(&answer);
        auto const unknown = std::get<HttpResponse>(ask("/no/such/path", upgrade, {}, method));
        return found && found->status == unknown.status && found->status == 404 &&
               found->content_type == unknown.content_type && found->body == unknown.body &&
               found->headers == unknown.headers && found->fixed_headers == unknown.fixed_headers;
    }
};

} // namespace

BOOST_AUTO_TEST_CASE(a_simulation_is_announced_with_its_token_and_reached_through_the_server)
{
    Fixture fixture;
    auto& browser = fixture.start();
    BOOST_TEST(browser.sent ==
                   (Texts{"shutdownTimeout: 600", "webots:ws://host.org:2000/simulation/secreta/2001"}),
               boost::test_tools::per_element());
    auto const socket = fixture.forwarded("/simulation/secreta/2001/", true);
    BOOST_TEST(socket.upstream.host == "127.0.0.1");
    BOOST_TEST(socket.upstream.port == 2001);
    BOOST_TEST(socket.upstream.broker == "");
    BOOST_TEST(socket.target == "/");
    BOOST_TEST(socket.headers.empty());
    BOOST_TEST(socket.answer_headers.empty());
    auto const file = fixture.forwarded("/simulation/secreta/2001/a/b.png", false, "x=1&y");
    BOOST_TEST(file.target == "/a/b.png?x=1&y");
    BOOST_TEST((file.headers == HttpHeaders{{"Host", "host.org:2000/simulation/secreta/2001"}}));
    BOOST_TEST((file.answer_headers == HttpHeaders{{"Access-Control-Allow-Origin", "*"}}));
    HttpHeaders const sandbox{{"Content-Security-Policy", std::string(core::sandbox_policy)}};
    BOOST_TEST((file.added_answer_headers == sandbox));
    BOOST_TEST((socket.added_answer_headers == sandbox));
    BOOST_TEST((file.group == socket.group && file.group));
    fixture.leave(browser);
}

// A machine that was found knows from the session server how browsers reach it.
BOOST_AUTO_TEST_CASE(
    a_simulation_is_announced_below_the_session_server_whose_gateway_its_browser_came_through)
{
    Fixture fixture;
    ChannelInfo info;
    info.path = "/client";
    info.public_address = "wss://sim.example.org/machine/abc";
    info.is_from_proxy = true;
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.connect_as(info);
    browser.browser_says(std::string(begin));
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == "webots:wss://sim.example.org/machine/abc/simulation/secreta/2001");
    Headers const headers{{"Host", "10.0.0.2:2000"}, {"Webots-Cloud-Address", info.public_address}};
    IncomingRequest request;
    request.method = "GET";
    request.path = "/simulation/secreta/2001/a.png";
    request.headers = headers;
    request.is_from_proxy = true;
    auto const host_for_webots = [&] {
        return std::get<Forward>(fixture.service.respond(request)).headers.front().second;
    };
    BOOST_TEST(host_for_webots() == "sim.example.org/machine/abc/simulation/secreta/2001");
    request.is_from_proxy = false; // anybody could say so
    BOOST_TEST(host_for_webots() == "host.org:2000/simulation/secreta/2001");
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_simulation_is_announced_below_the_path_of_a_trusted_proxy)
{
    Fixture fixture;
    ChannelInfo info;
    info.path = "/client";
    info.asked.host = "host.org";
    info.asked.path = "/webots";
    info.asked.tls = true;
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.connect_as(info);
    browser.browser_says(std::string(begin));
    fixture.world.settle();
    BOOST_TEST(browser.sent.back() == "webots:wss://host.org/webots/simulation/secreta/2001");
    Headers const headers{{"Host", "host.org"}, {"X-Forwarded-Prefix", "/webots"}};
    IncomingRequest request;
    request.method = "GET";
    request.path = "/simulation/secreta/2001/a.png";
    request.headers = headers;
    auto const host_for_webots = [&] {
        return std::get<Forward>(fixture.service.respond(request)).headers.front().second;
    };
    BOOST_TEST(host_for_webots() == "host.org:2000/simulation/secreta/2001");
    request.is_from_proxy = true;
    BOOST_TEST(host_for_webots() == "host.org/webots/simulation/secreta/2001");
    fixture.leave(browser);
}

// A ticket that was not used is as good as a new one.
BOOST_AUTO_TEST_CASE(a_proxy_that_leaves_upgrade_out_is_named_in_the_log_and_a_ticket_is_not)
{
    Fixture fixture;
    Headers const handshake{{"Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="}};
    std::string const ticket(75, 'a');
    IncomingRequest request;
    request.method = "GET";
    auto const path = "/ticket/" + ticket + "/client";
    request.path = path;
    request.headers = handshake;
    BOOST_TEST(std::get<HttpResponse>(fixture.service.respond(request)).status == 400);
    BOOST_TEST(fixture.lines("A WebSocket for /ticket/ came without \"Upgrade\"") == 1);
    BOOST_TEST(fixture.lines(ticket) == 0);
    request.headers = {}; // somebody who looks
    BOOST_TEST(std::get<HttpResponse>(fixture.service.respond(request)).status == 400);
    BOOST_TEST(fixture.lines("A WebSocket for") == 1);
}

BOOST_AUTO_TEST_CASE(a_browser_that_would_not_reach_its_simulation_is_told_so)
{
    ChannelInfo info;
    info.path = "/client";
    info.peer = "10.0.0.1";
    info.public_address = "wss://sim.example.org/machine/abc";
    auto const is_refused = [&info](SimulationFixture& fixture, std::string_view problem) {
        auto& browser = fixture.connect_as(info);
        browser.browser_says(std::string(begin));
        fixture.world.settle();
        BOOST_TEST(browser.sent.front() ==
                   "loading: Error: This machine is not set up for the gateway of its "
                   "session server: its operator finds the reason in the log.");
        return fixture.log.contains(problem);
    };
    Fixture fixture;
    BOOST_TEST(
        is_refused(fixture, "at 10.0.0.1 would not reach its simulation: add it to \"trustedProxies\""));
    info.is_from_proxy = true;
    SimulationFixture without_gateway(simulation_service_setup());
    BOOST_TEST(is_refused(without_gateway, "set \"gateway\" to true"));
    info.public_address = "wss://sim.example.org/machine/abc?x";
    BOOST_TEST(is_refused(fixture, "makes no sense"));
}

// Protocol section 13.18.
BOOST_AUTO_TEST_CASE(an_author_is_told_where_controllers_connect_and_the_key_leads_there)
{
    auto hooks = simulation_service_hooks();
    hooks.new_address_token = [n = 0]() mutable { return std::string(28, static_cast<char>('a' + n++)); };
    auto setup = simulation_service_setup();
    setup.config.controller_port = 2900;
    setup.config.controller_repositories = {"https://github.com/o"};
    SimulationFixture fixture(setup, std::move(hooks), 2, ProcessLimits(), true);
    fixture.processes.expect().prints("ipc://2001/e-puck\ntcp://<ip_address>:2001/e-puck\n.\n");
    auto& browser = fixture.say("", std::string(begin));
    std::string const key(20, 'b');
    std::string const told =
        "stdout:Robot \"e-puck\" waits for its controller, which may run on any machine with "
        "WEBOTS_CONTROLLER_URL=tcp://host.org:2900/" +
        key + "/e-puck";
    BOOST_TEST(browser.sent ==
                   (Texts{"shutdownTimeout: 600",
                          "webots:ws://host.org:2000/simulation/" + std::string(28, 'a') + "/2001", told}),
               boost::test_tools::per_element());
    auto const& argv = fixture.processes.started().back().argv;
    BOOST_TEST((std::ranges::find(argv, "--extern-urls") != argv.end()));
    auto const way = fixture.service.way_of_controller(0, key, "e-puck").value();
    BOOST_TEST(way.upstream.host == "127.0.0.1");
    BOOST_TEST(way.upstream.port == 2001);
    BOOST_TEST(way.asks_for == "e-puck");
    BOOST_TEST(fixture.service.way_of_controller(0, key, "~1").value().asks_for == "e-puck");
    BOOST_TEST((way.group && way.group == fixture.service.way_of_controller(0, key, "").value().group));
    for (std::string const& wrong :
         {std::string(28, 'a'), std::string(20, 'a'), std::string(28, 'b'), std::string()})
        BOOST_TEST((fixture.service.way_of_controller(0, wrong, "e-puck").error() == errc::refused), wrong);
    fixture.leave(browser);
    BOOST_TEST((fixture.service.way_of_controller(0, key, "e-puck").error() == errc::refused));
    BOOST_TEST(way.group->is_closed());
}

BOOST_AUTO_TEST_CASE(projects_that_are_not_listed_get_no_controllers_and_their_authors_are_told)
{
    auto setup = simulation_service_setup();
    setup.config.controller_port = 2900;
    setup.config.controller_repositories = {"https://github.com/o/other"};
    Fixture fixture(setup);
    fixture.processes.expect().prints(".\ntcp://<ip_address>:2001/e-puck\n");
    auto& browser = fixture.say("", std::string(begin));
    BOOST_TEST(browser.sent.back() ==
               "stdout:Robot \"e-puck\" waits for its controller, but this site takes none of other machines "
               "for this "
               "project. Its operator can add the project to \"controllerRepositories\".");
    BOOST_TEST((fixture.service.way_of_controller(0, "secretb", "e-puck").error() == errc::refused));
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(
    without_a_port_for_controllers_simulators_are_not_asked_and_what_they_print_means_nothing)
{
    Fixture fixture;
    fixture.processes.expect().prints("tcp://<ip_address>:2001/e-puck\n.\n");
    auto& browser = fixture.say("", std::string(begin));
    BOOST_TEST(browser.sent.back().starts_with("webots:"));
    auto const& argv = fixture.processes.started().back().argv;
    BOOST_TEST((std::ranges::find(argv, "--extern-urls") == argv.end()));
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(without_the_token_there_is_nothing)
{
    Fixture fixture;
    auto& browser = fixture.start();
    for (auto const* path :
         {"/simulation/secretb/2001/", "/simulation/secreta/2002/", "/simulation/secreta/2501/",
          "/simulation/secreta/", "/simulation/secret/2001/", "/simulation//2001/", "/simulation/"})
        for (bool const upgrade : {false, true}) {
            BOOST_TEST(fixture.is_unknown(path, upgrade), path);
            BOOST_TEST(fixture.is_unknown(path, upgrade, "POST"), path);
        }
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(each_simulation_has_a_token_of_its_own)
{
    Fixture fixture;
    auto& first = fixture.start();
    auto& second = fixture.start();
    BOOST_TEST(second.sent.back() == "webots:ws://host.org:2000/simulation/secretb/2002");
    BOOST_TEST(fixture.forwarded("/simulation/secretb/2002/").upstream.port == 2002);
    BOOST_TEST(fixture.is_unknown("/simulation/secreta/2002/"));
    BOOST_TEST(fixture.is_unknown("/simulation/secretb/2001/"));
    fixture.leave(first);
    fixture.leave(second);
}

BOOST_AUTO_TEST_CASE(a_simulation_that_is_not_ready_has_no_address_and_one_that_has_ended_none_any_more)
{
    Fixture fixture;
    fixture.processes.expect().after(2s).prints(".\n").after(5s).exits(0);
    auto& browser = fixture.say("", std::string(begin));
    BOOST_TEST(fixture.is_unknown("/simulation/secreta/2001/"));
    fixture.world.advance(2s);
    auto const group = fixture.forwarded("/simulation/secreta/2001/").group;
    BOOST_TEST(!group->is_closed());
    fixture.world.advance(5s);
    BOOST_TEST(browser.sent.back() == error_line(core::Refused::quit));
    BOOST_TEST(group->is_closed());
    BOOST_TEST(fixture.is_unknown("/simulation/secreta/2001/"));
}

BOOST_AUTO_TEST_CASE(when_the_browser_leaves_the_tunnels_end_before_the_simulator_has)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").stubborn();
    auto& browser = fixture.say("", std::string(begin));
    auto const group = fixture.forwarded("/simulation/secreta/2001/").group;
    fixture.leave(browser);
    BOOST_TEST(fixture.processes.alive() == 1);
    BOOST_TEST(group->is_closed());
    BOOST_TEST(fixture.is_unknown("/simulation/secreta/2001/"));
    fixture.world.advance(2s);
}

BOOST_AUTO_TEST_CASE(a_browser_that_quits_hears_the_goodbye_of_its_simulator_before_that_is_ended)
{
    Fixture fixture;
    auto& browser = fixture.start();
    auto const group = fixture.forwarded("/simulation/secreta/2001/").group;
    OpenTunnel tunnel;
    BOOST_TEST(group->join(tunnel));
    fixture.leave(browser);
    BOOST_TEST(fixture.is_unknown("/simulation/secreta/2001/"));
    BOOST_TEST(fixture.processes.alive() == 1);
    BOOST_TEST(!tunnel.is_ended);
    group->leave(tunnel); // both have said goodbye
    fixture.world.settle();
    BOOST_TEST(fixture.processes.alive() == 0);
    BOOST_TEST(!tunnel.is_ended);
}

BOOST_AUTO_TEST_CASE(others_who_watch_a_simulation_do_not_keep_it_from_ending)
{
    Fixture fixture;
    auto& browser = fixture.start();
    OpenTunnel tunnel;
    BOOST_TEST(fixture.forwarded("/simulation/secreta/2001/").group->join(tunnel));
    fixture.leave(browser);
    fixture.world.advance(499ms);
    BOOST_TEST(!tunnel.is_ended);
    fixture.world.advance(1ms);
    BOOST_TEST(tunnel.is_ended);
    BOOST_TEST(fixture.processes.alive() == 0);
}

// Section 13.10.
BOOST_AUTO_TEST_CASE(a_browser_that_returns_is_told_the_same_address_and_its_tunnels_live)
{
    Fixture fixture(simulation_service_setup(30s));
    auto& browser = fixture.start();
    auto const group = fixture.forwarded("/simulation/secreta/2001/").group;
    fixture.lose(browser);
    BOOST_TEST(!group->is_closed());
    BOOST_TEST(fixture.forwarded("/simulation/secreta/2001/").group == group);
    auto& back = fixture.say("", R"({"reconnect":"token1"})");
    BOOST_TEST(back.was_told("webots:ws://host.org:2000/simulation/secreta/2001"));
    BOOST_TEST(!group->is_closed());
    fixture.leave(back);
    BOOST_TEST(group->is_closed());
}

BOOST_AUTO_TEST_CASE(files_are_read_only)
{
    Fixture fixture;
    auto& browser = fixture.start();
    BOOST_TEST(std::holds_alternative<Forward>(fixture.ask("/simulation/secreta/2001/x", false, {}, "HEAD")));
    auto const refusal = std::get<HttpResponse>(fixture.ask("/simulation/secreta/2001/x", false, {}, "POST"));
    BOOST_TEST(refusal.status == 405);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(the_limit_of_traffic_can_be_changed_while_a_simulation_runs)
{
    auto setup = simulation_service_setup();
    setup.config.traffic_limit = 1000;
    Fixture fixture(setup);
    auto& browser = fixture.start();
    auto const group = fixture.forwarded("/simulation/secreta/2001/").group;
    auto const now = fixture.world.clock.now();
    (void)group->allowance(now);
    group->count_sent(1'000'000'000);
    BOOST_TEST(group->allowance(now) == 0u);
    setup.config.traffic_limit = 0;
    fixture.service.apply(setup.config);
    BOOST_TEST(group->allowance(now) > 0u);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(bytes_are_counted_also_of_simulations_that_have_ended)
{
    Fixture fixture;
    auto& first = fixture.start();
    auto& second = fixture.start();
    fixture.forwarded("/simulation/secreta/2001/").group->count_sent(1000);
    fixture.forwarded("/simulation/secretb/2002/").group->count_received(7);
    fixture.leave(first);
    auto const figures = fixture.get("/metrics").body;
    BOOST_TEST(figures.find("webots_gateway_bytes_total{from=\"browsers\"} 7\n") != std::string::npos,
               figures);
    BOOST_TEST(figures.find("webots_gateway_bytes_total{from=\"simulations\"} 1000\n") != std::string::npos,
               figures);
    BOOST_TEST(figures.find("webots_gateway_connections 0\n") != std::string::npos, figures);
    BOOST_TEST(fixture.get("/monitor").text().find(R"("sent":1000,)") != std::string::npos);
    fixture.leave(second);
}

BOOST_AUTO_TEST_CASE(a_token_is_in_no_log_and_on_no_page)
{
    Fixture fixture;
    auto& browser = fixture.start();
    BOOST_TEST(fixture.forwarded("/simulation/secreta/2001/").target == "/");
    BOOST_TEST(fixture.lines("secreta") == 0);
    for (auto const* path : {"/monitor", "/metrics", "/load"})
        BOOST_TEST(fixture.get(path).body.find("secreta") == std::string::npos, path);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_SUITE_END()
