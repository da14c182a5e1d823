#include "unit_test.hpp"

#include "core/access/password_guesses.hpp"
#include "core/base64.hpp"
#include "core/pages/http_pages.hpp"
#include "service/error_page.hpp"

#include <webots_cloud/access_control.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/world.hpp>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(access_control)

namespace {

using Headers = std::vector<std::pair<std::string_view, std::string_view>>;

/// Answers everything, and remembers what it was asked last.
class Site final : public Endpoint
{
public:
    Answer respond(IncomingRequest const& request) override
    {
        ++requests;
        by_operator = request.is_operator;
        if (request.upgrade)
            return AcceptWebSocket();
        HttpResponse response(200, "text/html", "here");
        response.fixed_headers = fixed_headers;
        return response;
    }

    std::uint64_t max_body(IncomingRequest const&) override { return 7; }
    boost::asio::awaitable<HttpResponse> respond_to_body(IncomingRequest const&) override
    {
        HttpResponse response(200, "text/html", "taken");
        co_return response;
    }

    boost::asio::awaitable<void> serve_websocket(ChannelInfo, Channel&) override { co_return; }

    int requests = 0;
    bool by_operator = false;
    std::string_view fixed_headers;
};

bool is_secret(std::string_view token)
{
    return token == "secret";
}

struct Fixture
{
    explicit Fixture(GuardedServer server = GuardedServer(), AccessConfig config = AccessConfig(),
                     OperatorTokenCheck check = is_secret)
        : access(std::move(config), std::move(server), site, world.clock, log.logger(), std::move(check))
    {}

    Answer ask(std::string_view path, Headers const& headers, bool upgrade = false)
    {
        IncomingRequest request;
        request.method = "GET";
        request.path = path;
        request.headers = headers;
        request.upgrade = upgrade;
        return access.respond(request);
    }

    HttpResponse get(std::string_view path, Headers const& headers = {})
    {
        return std::get<HttpResponse>(ask(path, headers));
    }

    /// The status of a WebSocket handshake.
    int open(std::string_view path, Headers const& headers)
    {
        auto const answer = ask(path, headers, true);
        auto const* const refusal = std::get_if<HttpResponse>(&answer);
        return refusal ? refusal->status : 101;
    }

    testing::World world;
    testing::RecordingLog log;
    Site site;
    AccessControl access;
};

GuardedServer server(std::string name)
{
    return GuardedServer(std::move(name));
}

} // namespace

BOOST_AUTO_TEST_CASE(a_server_of_this_machine_answers_to_its_own_names_only)
{
    AccessConfig config;
    config.host_names = {"teacher-pc"};
    Fixture fixture(server("localhost"), config);
    for (auto const host : {"localhost:1999", "127.0.0.1:1999", "teacher-pc:1999"})
        BOOST_TEST(fixture.get("/load", {{"Host", host}}).status == 200, host);
    for (auto const path : {"/load", "/session", "/viewer/", "/metrics", "/"})
        BOOST_TEST(fixture.get(path, {{"Host", "evil.example:1999"}}).status == 421, path);
    BOOST_TEST(fixture.open("/client", {{"Host", "evil.example"}, {"Origin", "http://evil.example"}}) == 421);
    BOOST_TEST(fixture.site.requests == 3);
}

BOOST_AUTO_TEST_CASE(a_public_site_answers_to_any_name)
{
    Fixture fixture(server("sim.example.org"));
    BOOST_TEST(fixture.get("/load", {{"Host", "anything.example"}}).status == 200);
    BOOST_TEST(fixture.open("/client", {{"Host", "x.example"}, {"Origin", "https://anybody.example"}}) ==
               101);
}

BOOST_AUTO_TEST_CASE(a_site_reaches_as_far_as_its_machines_when_nobody_named_it)
{
    Fixture fixture(server("localhost"));
    Fleet fleet;
    fleet.put(ServerSpec("localhost:2000"));
    fixture.access.follow(fleet);
    BOOST_TEST(fixture.get("/session", {{"Host", "sessions.example.org"}}).status == 421);
    fleet.put(ServerSpec("sim1.example.org/2000"));
    BOOST_TEST(fixture.get("/session", {{"Host", "sessions.example.org"}}).status == 200);
    BOOST_TEST(fixture.open("/", {{"Host", "x"}, {"Origin", "https://anybody.example"}}) == 101);
    fixture.access.apply(AccessConfig(), server("localhost"), is_secret);
    BOOST_TEST(fixture.get("/session", {{"Host", "sessions.example.org"}}).status == 200, "a reload");
    fleet.remove("sim1.example.org/2000");
    BOOST_TEST(fixture.get("/session", {{"Host", "sessions.example.org"}}).status == 421);
    for (auto const* const machine : {"10.0.0.2:2000", "sim1.example.org:2000", "sim2.example.org:2000"})
        fleet.put(ServerSpec(machine));
    fleet.drain("sim1.example.org:2000", true); // is the same machine
    BOOST_TEST(fixture.get("/session", {{"Host", "sessions.example.org"}}).status == 200);
    fleet.remove("sim1.example.org:2000");
    BOOST_TEST(fixture.open("/", {{"Host", "x"}, {"Origin", "https://anybody.example"}}) == 101);
    fleet.remove("sim2.example.org:2000");
    BOOST_TEST(fixture.get("/session", {{"Host", "sessions.example.org"}}).status == 200);
    BOOST_TEST(fixture.open("/", {{"Host", "x"}, {"Origin", "https://anybody.example"}}) == 403);
    fleet.remove("10.0.0.2:2000");
    BOOST_TEST(fixture.get("/session", {{"Host", "sessions.example.org"}}).status == 421);
}

// Protocol section 13.12.
BOOST_AUTO_TEST_CASE(who_knows_the_address_of_a_simulation_may_use_it_from_any_page)
{
    Fixture fixture(server("localhost"));
    for (auto const path : {"/simulation/abc/2001/", "/2000/simulation/abc/2001/"}) {
        BOOST_TEST(fixture.open(path, {{"Host", "localhost:2000"}, {"Origin", "https://webots.cloud"}}) ==
                       101,
                   path);
        BOOST_TEST(fixture.open(path, {{"Host", "evil.example"}, {"Origin", "https://webots.cloud"}}) == 421,
                   path);
    }
    BOOST_TEST(fixture.open("/2000/client",
                            {{"Host", "localhost:2000"}, {"Origin", "https://evil.example"}}) == 403);
}

BOOST_AUTO_TEST_CASE(foreign_pages_open_no_web_socket_and_the_log_names_the_key)
{
    Fixture fixture(server("localhost"));
    for (auto const path : {"/client", "/", "/monitor", "/session"}) {
        BOOST_TEST(fixture.open(path, {{"Host", "localhost:2000"}, {"Origin", "https://evil.example"}}) ==
                       403,
                   path);
        BOOST_TEST(fixture.open(path, {{"Host", "localhost:2000"}, {"Origin", "null"}}) == 403, path);
        BOOST_TEST(fixture.open(path, {{"Host", "localhost:2000"}, {"Origin", "http://localhost:1999"}}) ==
                       101,
                   path);
        BOOST_TEST(fixture.open(path, {{"Host", "localhost:2000"}}) == 101, path << " of a program");
    }
    BOOST_TEST(fixture.log.contains("Refused a WebSocket of a page of https://evil.example: to let it in, "
                                    "add \"https://evil.example\" to "
                                    "\"allowedOrigins\""));
    BOOST_TEST(fixture.log.contains(
        "Refused a WebSocket of a page of null (opened from disk, or in a sandboxed frame): "
        "to let it in, add \"null\" to \"allowedOrigins\""));
}

BOOST_AUTO_TEST_CASE(a_proxy_that_leaves_out_its_port_is_named_in_the_log)
{
    Fixture fixture(server("sim.example.org"));
    auto const open = [&](Headers const& headers, bool is_from_proxy) {
        IncomingRequest request;
        request.method = "GET";
        request.path = "/client";
        request.headers = headers;
        request.upgrade = true;
        request.is_from_proxy = is_from_proxy;
        BOOST_TEST(std::holds_alternative<AcceptWebSocket>(fixture.access.respond(request)));
        return fixture.log.contains("without its port");
    };
    std::pair<std::string_view, std::string_view> const page{"Origin", "https://sim.example.org:8443"};
    BOOST_TEST(!open({page, {"Host", "sim.example.org"}}, false));
    BOOST_TEST(!open({page, {"Host", "sim.example.org:8443"}}, true));
    BOOST_TEST(!open({page, {"Host", "sim.example.org"}, {"X-Forwarded-Port", "8443"}}, true));
    BOOST_TEST(!open({{"Origin", "https://other.example.org:8443"}, {"Host", "sim.example.org"}}, true));
    BOOST_TEST(open({page, {"Host", "sim.example.org"}}, true));
}

BOOST_AUTO_TEST_CASE(bodies_reach_an_endpoint_that_takes_them_unless_they_may_not)
{
    Fixture fixture(server("localhost"));
    testing::World world;
    auto const answer = [&](std::string_view host, std::string_view origin = "http://localhost:2000") {
        Headers const headers{{"Host", host}, {"Origin", origin}};
        IncomingRequest request;
        request.method = "POST";
        request.path = "/form";
        request.headers = headers;
        BOOST_TEST(fixture.access.max_body(request) == 7u);
        return world.run(fixture.access.respond_to_body(request));
    };
    BOOST_TEST(answer("localhost:2000").body == "taken");
    BOOST_TEST(answer("evil.example").status == 421);
    BOOST_TEST(answer("localhost:2000", "").body == "taken");
    BOOST_TEST(answer("localhost:2000", "https://evil.example").status == 403);
}

// Webots' own page, opened from disk, shows this sentence; without it, it would try to connect for ever.
BOOST_AUTO_TEST_CASE(a_page_that_may_open_no_web_socket_is_told_so_when_it_asks_where_to)
{
    auto relaying = server("localhost");
    relaying.starts_here = true;
    Fixture fixture(relaying);
    auto const answer = [&](std::string_view origin) {
        return fixture.get("/session", {{"Host", "localhost:2000"}, {"Origin", origin}});
    };
    auto const refused = answer("null");
    BOOST_TEST(refused.status == 200);
    BOOST_TEST(refused.body == "Error: pages of null (opened from disk, or in a sandboxed frame) may not use "
                               "this server. Its operator can add "
                               "\"null\" to \"allowedOrigins\".");
    BOOST_TEST(!Fixture(server("localhost"))
                    .get("/session", {{"Host", "localhost:2000"}, {"Origin", "null"}})
                    .body.starts_with("Error: "),
               "a machine may let it in");
    BOOST_TEST(!answer("http://localhost:1999").body.starts_with("Error: "));
    BOOST_TEST(!fixture.get("/session", {{"Host", "localhost:2000"}}).body.starts_with("Error: "),
               "a program");
    BOOST_TEST(
        !fixture.get("/load", {{"Host", "localhost:2000"}, {"Origin", "null"}}).body.starts_with("Error: "));
}

BOOST_AUTO_TEST_CASE(operator_requests_need_the_token_and_a_known_host)
{
    Fixture fixture(server("sim.example.org"));
    auto const is_operators = [&](Headers const& headers) {
        (void)fixture.get("/api/drain", headers);
        return fixture.site.by_operator;
    };
    BOOST_TEST(is_operators({{"Host", "sim.example.org"}, {"Authorization", "Bearer secret"}}));
    BOOST_TEST(is_operators({{"Host", "10.0.0.5:2000"}, {"Authorization", "Bearer secret"}}));
    for (Headers const& headers :
         {Headers{{"Host", "sim.example.org"}}, Headers{{"Host", "sim.example.org"}, {"X-Forwarded-For", ""}},
          Headers{{"Host", "localhost"}, {"Authorization", "Bearer"}},
          Headers{{"Host", "localhost"}, {"Authorization", "Bearer wrong"}},
          Headers{{"Host", "localhost"}, {"Authorization", "Basic secret"}},
          Headers{{"Host", "evil.example"}, {"Authorization", "Bearer secret"}}})
        BOOST_TEST(!is_operators(headers));
}

BOOST_AUTO_TEST_CASE(without_a_token_nobody_is_an_operator_but_over_the_socket)
{
    Fixture fixture(server("localhost"), AccessConfig(), OperatorTokenCheck());
    (void)fixture.get("/api/drain", {{"Host", "localhost"}, {"Authorization", "Bearer "}});
    BOOST_TEST(!fixture.site.by_operator);
    IncomingRequest request;
    request.method = "POST";
    request.path = "/api/drain";
    request.is_operator = true;
    (void)fixture.access.respond(request);
    BOOST_TEST(fixture.site.by_operator);
}

// Browsers send no token by themselves. Over a socket that is forwarded to the operator's machine they need
// none.
BOOST_AUTO_TEST_CASE(operator_requests_of_foreign_pages_are_refused)
{
    auto guarded = server("sim.example.org");
    guarded.machine_names = {"localhost"};
    Fixture fixture(guarded);
    auto const status = [&](std::string_view origin, std::string_view host, bool over_socket) {
        Headers const headers{{"Host", host}, {"Origin", origin}, {"Authorization", "Bearer secret"}};
        IncomingRequest request;
        request.method = "POST";
        request.path = "/api/drain";
        request.headers = headers;
        request.is_operator = over_socket;
        return std::get<HttpResponse>(fixture.access.respond(request)).status;
    };
    for (bool const over_socket : {false, true}) {
        BOOST_TEST(status("", "localhost:8080", over_socket) == 200, "a program");
        BOOST_TEST(status("http://localhost:8080", "localhost:8080", over_socket) == 200);
        BOOST_TEST(status("https://sim.example.org", "sim.example.org", over_socket) == 200);
        BOOST_TEST(status("https://evil.example", "localhost:8080", over_socket) == 403);
        BOOST_TEST(status("null", "localhost:8080", over_socket) == 403);
    }
    // A simulation's page, and a name that was rebound to this machine.
    BOOST_TEST(status("http://localhost:2001", "localhost:8080", true) == 403);
    BOOST_TEST(status("http://evil.example:8080", "evil.example:8080", true) == 403);
    // A proxy that names another host: the page was given the token.
    BOOST_TEST(status("https://sim.example.org", "127.0.0.1:2000", false) == 200);
    BOOST_TEST(status("https://sim.example.org", "127.0.0.1:2000", true) == 403);
}

BOOST_AUTO_TEST_CASE(another_check_holds_from_the_next_request_on)
{
    Fixture fixture(server("localhost"), AccessConfig(), OperatorTokenCheck());
    Headers const headers{{"Host", "localhost"}, {"Authorization", "Bearer secret"}};
    (void)fixture.get("/api/drain", headers);
    BOOST_TEST(!fixture.site.by_operator);
    fixture.access.apply(AccessConfig(), server("localhost"), is_secret);
    (void)fixture.get("/api/drain", headers);
    BOOST_TEST(fixture.site.by_operator);
    fixture.access.apply(AccessConfig(), server("localhost"), OperatorTokenCheck());
    (void)fixture.get("/api/drain", headers);
    BOOST_TEST(!fixture.site.by_operator);
}

BOOST_AUTO_TEST_CASE(the_monitor_asks_for_its_password_where_there_is_one)
{
    AccessConfig config;
    config.monitor_password = "open sesame";
    Fixture fixture(server("sim.example.org"), config);
    auto const right = "Basic " + core::base64("operator:open sesame");
    auto const wrong = "Basic " + core::base64("operator:open sesamE");
    for (auto const path : {"/monitor", "/metrics"}) {
        auto const refused = fixture.get(path);
        BOOST_TEST(refused.status == 401);
        BOOST_TEST((refused.headers ==
                    HttpHeaders{{"WWW-Authenticate", "Basic realm=\"monitor\", charset=\"UTF-8\""}}));
        BOOST_TEST(fixture.get(path, {{"Authorization", wrong}}).status == 401);
        BOOST_TEST(fixture.get(path, {{"Authorization", "Basic "}}).status == 401);
        BOOST_TEST(fixture.get(path, {{"Authorization", right}}).status == 200);
    }
    BOOST_TEST(fixture.open("/monitor", {}) == 401);
    BOOST_TEST(fixture.open("/monitor", {{"Authorization", right}}) == 101);
    BOOST_TEST(fixture.get("/load").status == 200);
}

BOOST_AUTO_TEST_CASE(behind_a_session_server_that_passes_no_password_on_the_monitor_says_what_to_do)
{
    AccessConfig config;
    config.monitor_password = "open sesame";
    Fixture fixture(server("sim.example.org"), config);
    auto const refused = fixture.get("/monitor", {{"Webots-Cloud-Untrusted", "1"}});
    BOOST_TEST(refused.status == 403, "by a 401 the browser would forget the session server's password");
    BOOST_TEST(refused.headers.empty(), "a browser would ask for what does not come through");
    BOOST_TEST(refused.body.find("\"trusted\": true") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(whoever_has_the_key_of_a_monitors_page_needs_neither_origin_nor_password)
{
    AccessConfig config;
    config.monitor_password = "open sesame";
    config.allowed_origins.emplace();
    Fixture fixture(server("sim.example.org"), config);
    Headers const sandboxed{{"Host", "sim.example.org"}, {"Origin", "null"}};
    for (auto const* path : {"/monitor/key", "/2000/monitor/key", "/machine/abc/monitor/key"})
        BOOST_TEST(fixture.open(path, sandboxed) == 101, path); // the endpoint looks at the key
    BOOST_TEST(fixture.get("/monitor/key", sandboxed).status == 200);
    for (auto const* path : {"/monitor", "/2000/monitor", "/client", "/2000/client", "/"})
        BOOST_TEST(fixture.open(path, sandboxed) == 403, path);
}

BOOST_AUTO_TEST_CASE(whoever_guesses_passwords_or_tokens_is_slowed_down)
{
    AccessConfig config;
    config.monitor_password = "open sesame";
    Fixture fixture(server("sim.example.org"), config);
    auto const status = [&](std::string_view path, std::string_view client,
                            std::string const& authorization) {
        Headers const headers{{"Host", "sim.example.org"}, {"Authorization", authorization}};
        IncomingRequest request;
        request.method = "GET";
        request.path = path;
        request.headers = headers;
        request.client = request.quota_key = client;
        return std::get<HttpResponse>(fixture.access.respond(request)).status;
    };
    auto const right = "Basic " + core::base64("operator:open sesame");
    for (std::size_t guess = 0; guess < core::passwords_of_client.burst; ++guess) {
        BOOST_TEST(status("/monitor", "192.0.2.1", "Basic b3BlbiBzZXNhbUU=") == 401);
        BOOST_TEST(status("/api/drain", "192.0.2.2", "Bearer wrong") == 200); // as everybody else
    }
    BOOST_TEST(!fixture.site.by_operator);
    for (auto const* path : {"/monitor", "/metrics"})
        BOOST_TEST(status(path, "192.0.2.1", right) == 429); // else guessing would be as fast as ever
    BOOST_TEST(status("/api/drain", "192.0.2.2", "Bearer secret") == 429);
    BOOST_TEST(status("/load", "192.0.2.1", right) == 200);
    fixture.world.advance(std::chrono::seconds(11)); // one more guess
    BOOST_TEST(status("/monitor", "192.0.2.1", right) == 200);
    BOOST_TEST(status("/monitor", "192.0.2.3", right) == 200);
    BOOST_TEST(status("/api/drain", "192.0.2.3", "Bearer secret") == 200);
    BOOST_TEST(fixture.site.by_operator);
}

BOOST_AUTO_TEST_CASE(the_monitor_is_for_the_addresses_that_the_operator_names)
{
    AccessConfig config;
    config.monitor_addresses = {"10.0.0.0/8", "::1"};
    Fixture fixture(server("sim.example.org"), config);
    auto const status = [&](std::string_view client, Headers const& headers = {}) {
        IncomingRequest request;
        request.method = "GET";
        request.path = "/metrics";
        request.headers = headers;
        request.peer = "10.0.0.1"; // a proxy
        request.client = client;
        return std::get<HttpResponse>(fixture.access.respond(request)).status;
    };
    BOOST_TEST(status("10.1.2.3") == 200);
    BOOST_TEST(status("::1") == 200);
    BOOST_TEST(status("203.0.113.7") == 403);
    BOOST_TEST(status("") == 403);
    config.monitor_password = "open sesame";
    fixture.access.apply(config, server("sim.example.org"), is_secret);
    auto const right = "Basic " + core::base64("operator:open sesame");
    BOOST_TEST(status("10.1.2.3") == 200);
    BOOST_TEST(status("203.0.113.7") == 401);
    BOOST_TEST(status("203.0.113.7", {{"Authorization", right}}) == 200);
}

BOOST_AUTO_TEST_CASE(pages_say_who_may_frame_them_and_nothing_is_guessed)
{
    Fixture fixture(server("localhost"));
    Headers const here{{"Host", "localhost"}};
    BOOST_TEST(fixture.get("/load", here).fixed_headers == "X-Content-Type-Options: nosniff\r\n");
    constexpr auto* expected = "X-Content-Type-Options: nosniff\r\n"
                               "Content-Security-Policy: frame-ancestors 'self' https://webots.cloud\r\n";
    BOOST_TEST(fixture.get("/viewer/", here).fixed_headers == expected);
    BOOST_TEST(fixture.get("/monitor", here).fixed_headers == expected);
    BOOST_TEST(fixture.get("/class/K7M2Q", here).fixed_headers == expected);
    AccessConfig config;
    config.frame_ancestors = {"https://course.example.edu"};
    fixture.access.apply(config, server("sim.example.org"), is_secret);
    BOOST_TEST(fixture.get("/viewer/").fixed_headers ==
               "X-Content-Type-Options: nosniff\r\n"
               "Content-Security-Policy: frame-ancestors 'self' https://course.example.edu\r\n");
    BOOST_TEST(fixture.open("/client", {{"Origin", "https://anybody.example"}}) == 101,
               "frames are not sockets");
    fixture.site.fixed_headers = "Access-Control-Allow-Origin: *\r\n";
    BOOST_TEST(fixture.get("/session").fixed_headers == "Access-Control-Allow-Origin: *\r\n");
}

BOOST_AUTO_TEST_CASE(people_see_a_refusal_in_a_page_of_ours_and_programs_the_sentence_alone)
{
    AccessConfig config;
    config.monitor_addresses = {"192.0.2.1"};
    Fixture fixture(server("localhost"), std::move(config));
    Headers const page{{"Host", "localhost:1999"}, {"Accept", "text/html,*/*"}};
    auto const refused = fixture.get("/monitor", page);
    BOOST_TEST(refused.status == 403);
    BOOST_TEST(refused.body.starts_with("<!DOCTYPE html>"));
    BOOST_TEST(refused.body.find("<h1>The monitor of this server is not for your address.</h1>") !=
               std::string::npos);
    BOOST_TEST(refused.body.find("--accent") != std::string::npos, "the design tokens are in it");
    BOOST_TEST(refused.body.find("href=\"./\"") != std::string::npos);
    BOOST_TEST(fixture.get("/monitor").body == "The monitor of this server is not for your address.");
    auto script = page;
    script.emplace_back("Sec-Fetch-Mode", "cors");
    BOOST_TEST(fixture.get("/monitor", script).body == "The monitor of this server is not for your address.");
    BOOST_TEST(fixture.get("/load", page).body == fixture.get("/load").body, "which is no refusal");
}

BOOST_AUTO_TEST_CASE(a_refusal_is_in_the_language_that_the_browser_asks_for)
{
    AccessConfig config;
    config.monitor_addresses = {"192.0.2.1"};
    Fixture fixture(server("localhost"), std::move(config));
    auto const refused = [&](std::string_view language) {
        return fixture.get(
            "/monitor",
            {{"Host", "localhost:1999"}, {"Accept", "text/html,*/*"}, {"Accept-Language", language}});
    };
    auto const german = refused("de-DE,de;q=0.9,en;q=0.8");
    BOOST_TEST(german.status == 403);
    for (auto const* part :
         {"<html lang=\"de\">", "<h1>Der Monitor dieses Servers ist nicht für Ihre Adresse bestimmt.</h1>",
          ">Startseite</a>"})
        BOOST_TEST(german.body.find(part) != std::string::npos, part);
    BOOST_TEST_REQUIRE(!german.headers.empty());
    BOOST_TEST(german.headers.back().first == "Vary");
    BOOST_TEST(german.headers.back().second == "Accept-Language");
    for (std::string const language : {"de", "es", "fr", "it", "ja", "zh"}) {
        auto const body = refused(language).body;
        BOOST_TEST(body.find("<html lang=\"" + language + "\">") != std::string::npos, language);
        BOOST_TEST(body.find("The monitor of this server") == std::string::npos, language);
        BOOST_TEST(body.find("Start page") == std::string::npos, language);
    }
    BOOST_TEST(refused("nl").body.find("<h1>The monitor of this server is not") != std::string::npos);
    BOOST_TEST(refused("nl").body.find("<html lang=\"en\">") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_refusal_for_programs_stays_in_english_as_a_whole)
{
    IncomingRequest request;
    request.method = "GET";
    request.path = "/";
    Headers const headers{{"Accept", "text/html"}, {"Accept-Language", "de"}};
    request.headers = headers;
    HttpResponse response(400, std::string(core::html_type), "Expected /api/drain.");
    dress_for_people(response, request);
    for (auto const* part : {"<html lang=\"en\">", "<h1>Expected /api/drain.</h1>", ">Start page</a>"})
        BOOST_TEST(response.body.find(part) != std::string::npos, part);
}

BOOST_AUTO_TEST_CASE(the_way_home_from_a_refusal_leads_up)
{
    IncomingRequest request;
    request.method = "GET";
    request.path = "/viewer/worlds/nothing";
    Headers const headers{{"Accept", "text/html"}};
    request.headers = headers;
    HttpResponse response(404, std::string(core::html_type), "<html><title>404: Not Found</title></html>");
    dress_for_people(response, request);
    BOOST_TEST(response.body.find("href=\"./../../\"") != std::string::npos);
    BOOST_TEST(response.body.find("There is nothing at this address.") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(base64_is_padded)
{
    BOOST_TEST(core::base64("") == "");
    BOOST_TEST(core::base64("f") == "Zg==");
    BOOST_TEST(core::base64("fo") == "Zm8=");
    BOOST_TEST(core::base64("foo") == "Zm9v");
    BOOST_TEST(core::base64("\xff\xfe\xfd\xfc") == "//79/A==");
}

BOOST_AUTO_TEST_SUITE_END()
