#include "unit_test.hpp"

#include "adapters/network/network_fixture.hpp"

#include <zlib.h>

#include <optional>
#include <vector>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(http_server)

namespace {

std::size_t count(std::string_view text, std::string_view what)
{
    std::size_t found = 0;
    for (auto at = text.find(what); at != std::string_view::npos; at = text.find(what, at + 1))
        ++found;
    return found;
}

/// A masked frame; the mask is zero.
std::string frame(unsigned first, std::string_view payload)
{
    std::string bytes{static_cast<char>(first), static_cast<char>(0x80 | payload.size()), 0, 0, 0, 0};
    return bytes.append(payload);
}

std::string unpacked(std::string const& gzip)
{
    z_stream stream{};
    BOOST_TEST_REQUIRE(::inflateInit2(&stream, 15 + 16) == Z_OK);
    std::string text(4'000'000, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(gzip.data()));
    stream.avail_in = static_cast<uInt>(gzip.size());
    stream.next_out = reinterpret_cast<Bytef*>(text.data());
    stream.avail_out = static_cast<uInt>(text.size());
    BOOST_TEST(::inflate(&stream, Z_FINISH) == Z_STREAM_END);
    text.resize(stream.total_out);
    ::inflateEnd(&stream);
    return text;
}

std::string close_frame(unsigned code)
{
    return {static_cast<char>(0x88), 2, static_cast<char>(code >> 8), static_cast<char>(code & 0xff)};
}

} // namespace

BOOST_AUTO_TEST_CASE(pipelined_requests_are_answered_in_order_until_one_wants_no_more)
{
    RunningServer server;
    Client client(server);
    std::string requests;
    for (int i = 0; i < 2000; ++i)
        requests += "GET /" + std::to_string(i) + "; HTTP/1.1\r\nHost: h\r\n\r\n";
    client.say(
        requests +
        "GET /last HTTP/1.1\r\nHost: h\r\nConnection: close\r\n\r\nGET /never HTTP/1.1\r\nHost: h\r\n\r\n");
    auto const answers = client.read_all();
    BOOST_TEST(count(answers, "HTTP/1.1 200 OK\r\n") == 2001u);
    std::size_t at = 0;
    for (int i = 0; i < 2000 && at != std::string::npos; ++i)
        at = answers.find("\r\n\r\n/" + std::to_string(i) + ";", at);
    BOOST_TEST((at != std::string::npos));
    BOOST_TEST(answers.ends_with("\r\nConnection: close\r\n\r\n/last"));
}

BOOST_AUTO_TEST_CASE(http_1_0_is_answered_and_closed_unless_it_asks_otherwise)
{
    RunningServer server;
    Client plain(server);
    plain.say("GET /a HTTP/1.0\r\n\r\n");
    BOOST_TEST(plain.read_all().ends_with("Connection: close\r\n\r\n/a"));
    Client kept(server);
    kept.say("GET /a HTTP/1.0\r\nConnection: keep-alive\r\n\r\n");
    BOOST_TEST(kept.read_to("\r\n\r\n/a").find("Connection: keep-alive\r\n") != std::string::npos);
    kept.say("GET /b HTTP/1.0\r\n\r\n");
    BOOST_TEST(kept.read_all().ends_with("/b"));
}

BOOST_AUTO_TEST_CASE(head_is_answered_without_the_body_that_it_counts)
{
    RunningServer server;
    Client client(server);
    client.say(
        "HEAD /four HTTP/1.1\r\nHost: h\r\n\r\nPOST /x HTTP/1.1\r\nHost: h\r\nConnection: close\r\n\r\n");
    auto const answers = client.read_all();
    BOOST_TEST(answers.find("Content-Length: 5\r\nConnection: keep-alive\r\n\r\nHTTP/1.1 405 ") !=
               std::string::npos);
    BOOST_TEST(answers.ends_with("\r\n\r\n/x"));
}

// RFC 9110, 8.6: if there is a Content-Length, it is that of the answer to GET.
BOOST_AUTO_TEST_CASE(head_of_what_nobody_has_made_tells_no_length)
{
    RunningServer server;
    Client client(server);
    client.say("HEAD /nothing HTTP/1.1\r\nHost: h\r\n\r\nGET /nothing HTTP/1.1\r\nHost: h\r\n\r\n");
    BOOST_TEST(client.read_to("\r\n\r\n").find("Content-Length") == std::string::npos);
    BOOST_TEST(client.read_to("\r\n\r\n").find("Content-Length: 0\r\n") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_body_is_refused_and_the_connection_closed)
{
    RunningServer server;
    Client client(server);
    client.say("POST / HTTP/1.1\r\nHost: h\r\nContent-Length: 100000\r\n\r\n" + std::string(100'000, 'x'));
    auto const answer = client.read_all();
    BOOST_TEST(answer.starts_with("HTTP/1.1 413 "));
    BOOST_TEST(count(answer, "HTTP/1.1") == 1u);
    BOOST_TEST(server.statistics().refused_bodies == 1u);
}

BOOST_AUTO_TEST_CASE(a_body_that_the_endpoint_takes_is_read_to_its_end_and_the_next_request_follows)
{
    RunningServer server;
    Client client(server);
    std::string const body(250'000, 'b');
    // The first and the last one come with the heads of others, as from a client that pipelines.
    client.say(
        "GET /a HTTP/1.1\r\nHost: h\r\n\r\nPOST /body HTTP/1.1\r\nHost: h\r\nContent-Length: 5\r\n\r\nfirst"
        "POST /body HTTP/1.1\r\nHost: h\r\nContent-Length: 250000\r\n\r\nb");
    BOOST_TEST(client.read_to("\r\n\r\n/a").starts_with("HTTP/1.1 200 OK\r\n"));
    BOOST_TEST(client.read_to("\r\n\r\nfirst").starts_with("HTTP/1.1 200 OK\r\n"));
    client.say(body.substr(1) + "GET /b HTTP/1.1\r\nHost: h\r\nConnection: close\r\n\r\n");
    auto const answers = client.read_all();
    BOOST_TEST((answers.find("\r\n\r\n" + body + "HTTP/1.1 200 OK\r\n") != std::string::npos));
    BOOST_TEST(answers.ends_with("\r\n\r\n/b"));
    BOOST_TEST(server.statistics().requests == 4u);
    BOOST_TEST(server.statistics().refused_bodies == 0u);
}

BOOST_AUTO_TEST_CASE(who_waits_for_leave_to_send_a_body_gets_it_once)
{
    RunningServer server;
    Client client(server);
    client.say("POST /body HTTP/1.1\r\nHost: h\r\nExpect: 100-continue\r\nContent-Length: 3\r\n\r\n");
    BOOST_TEST(client.read_to("\r\n\r\n") == "HTTP/1.1 100 Continue\r\n\r\n");
    client.say("abc");
    BOOST_TEST(client.read_to("\r\n\r\nabc").starts_with("HTTP/1.1 200 OK\r\n"));
    client.say("POST /other HTTP/1.1\r\nHost: h\r\nExpect: 100-continue\r\nContent-Length: 3\r\n\r\n");
    BOOST_TEST(client.read_all().starts_with("HTTP/1.1 413 "));
}

BOOST_AUTO_TEST_CASE(a_body_that_is_longer_than_the_endpoint_takes_is_refused_before_it_has_come)
{
    RunningServer server;
    for (auto const* const length :
         {"Content-Length: 300001", "Content-Length: 18446744073709551615", "Transfer-Encoding: chunked",
          "Content-Length: 3\r\nContent-Length: 3"}) {
        Client client(server);
        client.say("POST /body HTTP/1.1\r\nHost: h\r\n" + std::string(length) + "\r\n\r\n");
        BOOST_TEST(client.read_to("\r\n").starts_with("HTTP/1.1 413 "), length);
    }
    BOOST_TEST(server.statistics().requests == 0u);
}

BOOST_AUTO_TEST_CASE(who_sends_a_body_too_slowly_is_answered_408)
{
    HttpServerParams params;
    params.body_timeout = std::chrono::seconds(1);
    RunningServer server(params);
    Client client(server);
    client.say("POST /body HTTP/1.1\r\nHost: h\r\nContent-Length: 10\r\n\r\nhalf");
    BOOST_TEST(client.read_all().starts_with("HTTP/1.1 408 "));
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::timed_out, 1));
}

BOOST_AUTO_TEST_CASE(all_bodies_together_have_a_limit_and_room_again_when_one_is_answered)
{
    HttpServerParams params;
    params.body_bytes = 200'000;
    RunningServer server(params);
    auto const request = "Host: h\r\nContent-Length: 150000\r\n\r\n" + std::string(150'000, 'x');
    Client first(server);
    first.say("POST /body/later HTTP/1.1\r\n" + request);
    BOOST_TEST(eventually([&] { return server.endpoint.held != nullptr; }));
    Client second(server);
    second.say("POST /body HTTP/1.1\r\n" + request);
    auto const refusal = second.read_to("\r\n\r\n");
    BOOST_TEST(refusal.starts_with("HTTP/1.1 503 "));
    BOOST_TEST(refusal.find("\r\nRetry-After: 5\r\n") != std::string::npos);
    server.run([&] { server.endpoint.held.load()->cancel(); });
    BOOST_TEST(first.read_to("\r\n").starts_with("HTTP/1.1 200 "));
    Client third(server);
    third.say("POST /body HTTP/1.1\r\n" + request);
    BOOST_TEST(third.read_to("\r\n").starts_with("HTTP/1.1 200 "));
}

BOOST_AUTO_TEST_CASE(one_client_has_a_quarter_of_the_memory_for_bodies)
{
    HttpServerParams params;
    params.body_bytes = 400'000;
    RunningServer server(params);
    auto const request = [](std::string const& path, std::string const& client, std::size_t size) {
        return "POST " + path + " HTTP/1.1\r\nHost: h\r\nX-Forwarded-For: " + client +
               "\r\nContent-Length: " + std::to_string(size) + "\r\n\r\n" + std::string(size, 'x');
    };
    Client first(server);
    first.say(request("/body/later", "203.0.113.7", 80'000));
    BOOST_TEST(eventually([&] { return server.endpoint.held != nullptr; }));
    for (std::size_t const size :
         {std::size_t{60'000}, std::size_t{21'000}}) { // one of which comes with its head
        Client more(server);
        more.say(request("/body", "203.0.113.7", size));
        auto const refusal = more.read_to("\r\n\r\n");
        BOOST_TEST(refusal.starts_with("HTTP/1.1 503 "), size);
        BOOST_TEST(refusal.find("\r\nRetry-After: 5\r\n") != std::string::npos);
    }
    Client other(server);
    other.say(request("/body", "203.0.113.8", 60'000));
    BOOST_TEST(other.read_to("\r\n").starts_with("HTTP/1.1 200 "));
    server.run([&] { server.endpoint.held.load()->cancel(); });
    BOOST_TEST(first.read_to("\r\n").starts_with("HTTP/1.1 200 "));
    Client again(server);
    again.say(request("/body", "203.0.113.7", 60'000));
    BOOST_TEST(again.read_to("\r\n").starts_with("HTTP/1.1 200 "));
}

BOOST_AUTO_TEST_CASE(who_goes_away_before_its_body_has_come_leaves_nothing_behind)
{
    HttpServerParams params;
    params.body_bytes = 200'000;
    RunningServer server(params);
    for (int i = 0; i < 4; ++i) {
        Client client(server);
        client.say("POST /body HTTP/1.1\r\nHost: h\r\nContent-Length: 150000\r\n\r\n" +
                   std::string(100'000, 'x'));
        client.shut_down();
        BOOST_TEST(client.read_all() == "", i);
    }
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::connections, 0));
}

BOOST_AUTO_TEST_CASE(half_sent_requests_are_answered_408_and_silent_connections_closed)
{
    HttpServerParams params;
    params.header_timeout = std::chrono::seconds(1);
    RunningServer server(params);
    Client half(server);
    Client silent(server);
    half.say("GET / HTTP/1.1\r\nHost: ");
    BOOST_TEST(half.read_all().starts_with("HTTP/1.1 408 "));
    BOOST_TEST(silent.read_all() == "");
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::timed_out, 2));
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::connections, 0));
}

BOOST_AUTO_TEST_CASE(an_address_has_a_limit_of_connections_and_room_again_when_some_end)
{
    HttpServerParams params;
    params.network.connections_per_address = 3;
    params.network.trusted_proxies.clear();
    RunningServer server(params);
    std::vector<std::optional<Client>> clients(3);
    for (auto& client : clients)
        client.emplace(server);
    BOOST_TEST_REQUIRE(server.eventually_counts(&HttpServerStatistics::connections, 3));
    Client refused(server);
    BOOST_TEST(refused.read_all().starts_with("HTTP/1.1 503 "));
    BOOST_TEST(server.statistics().refused_address == 1u);
    clients[0]->upgrade("/echo"); // a WebSocket counts as one connection still
    BOOST_TEST_REQUIRE(server.eventually_counts(&HttpServerStatistics::websockets, 1));
    Client refused_too(server);
    BOOST_TEST(refused_too.read_all().starts_with("HTTP/1.1 503 "));
    clients[0].reset();
    BOOST_TEST_REQUIRE(server.eventually_counts(&HttpServerStatistics::connections, 2));
    Client admitted(server);
    admitted.say("GET /in HTTP/1.0\r\n\r\n");
    BOOST_TEST(admitted.read_all().ends_with("/in"));
}

BOOST_AUTO_TEST_CASE(a_trusted_proxy_says_for_whom_it_asks)
{
    RunningServer server;
    Client proxy(server);
    auto const who = [&proxy](std::string const& fields) {
        proxy.say("GET /who HTTP/1.1\r\nHost: h\r\n" + fields + "\r\n");
        BOOST_TEST(proxy.read_to("I am ").ends_with("\r\n\r\nI am "));
        return proxy.read_to("\n");
    };
    std::string const own = "127.0.0.1, counted by []\n";
    BOOST_TEST(who("") == own);
    BOOST_TEST(who("X-Forwarded-For: 192.0.2.1, 203.0.113.7\r\n") ==
               "203.0.113.7, counted by [203.0.113.7]\n");
    BOOST_TEST(who("") == own, "what was said of one request does not hold for the next");
    BOOST_TEST(who("X-Forwarded-For: 192.0.2.1\r\nX-Forwarded-For: 2001:db8::7, 127.0.0.1\r\n") ==
               "2001:db8::7, counted by [2001:db8::/64]\n");
    BOOST_TEST(who("X-Forwarded-For: unknown\r\n") == own);
    BOOST_TEST(who("X-Forwarded-For: 127.0.0.2\r\n") == "127.0.0.2, counted by []\n");
    BOOST_TEST(who("forwarded: for=\"[2001:db8::7]:80\"\r\n") == "2001:db8::7, counted by [2001:db8::/64]\n");
    Client browser(server);
    browser.upgrade("/who", "X-Forwarded-For: 203.0.113.7\r\n");
    BOOST_TEST(browser.read_to("\n").ends_with("I am 203.0.113.7, counted by [203.0.113.7]\n"));
}

BOOST_AUTO_TEST_CASE(websockets_behind_a_proxy_are_counted_by_client)
{
    HttpServerParams params;
    params.network.connections_per_address = 2;
    RunningServer server(params);
    auto const from = [](std::string const& client) {
        return "X-Forwarded-For: 192.0.2." + std::to_string(client.size()) + ", " + client + "\r\n";
    };
    std::vector<std::optional<Client>> clients(6);
    for (auto& client : clients)
        client.emplace(server);
    clients[0]->upgrade("/echo", from("203.0.113.7"));
    clients[1]->upgrade("/echo", from("203.0.113.7"));
    Client refused(server);
    refused.ask_upgrade("/echo", "X-Forwarded-For: 198.51.100.1, 203.0.113.7\r\n");
    auto const refusal = refused.read_to("moment.\r\n");
    BOOST_TEST(refusal.starts_with("HTTP/1.1 429 Too Many Requests\r\n"), refusal);
    BOOST_TEST(refusal.find("\r\nRetry-After: 5\r\n") != std::string::npos, refusal);
    refused.say("GET /still-served HTTP/1.0\r\nX-Forwarded-For: 203.0.113.7\r\n\r\n");
    BOOST_TEST(refused.read_all().ends_with("/still-served"), "a proxy's connection serves others too");
    clients[2]->upgrade("/echo", from("203.0.113.8"));
    clients[3]->upgrade("/echo", from("2001:db8::1"));
    clients[4]->upgrade("/echo", from("2001:db8::ffff:1"));
    Client neighbour(server);
    neighbour.ask_upgrade("/echo", from("2001:db8::2"));
    BOOST_TEST(neighbour.read_to("\r\n").starts_with("HTTP/1.1 429 "), "a /64 network is one client");
    BOOST_TEST(server.statistics().refused_address == 2u);
    clients[0].reset();
    BOOST_TEST_REQUIRE(server.eventually_counts(&HttpServerStatistics::websockets, 4));
    clients[5]->upgrade("/echo", from("203.0.113.7"));
    std::vector<std::optional<Client>> own(5); // connections of the proxy itself
    for (auto& client : own)
        client.emplace(server).upgrade("/echo");
}

BOOST_AUTO_TEST_CASE(what_others_claim_is_not_believed)
{
    HttpServerParams params;
    params.network.trusted_proxies = {"10.0.0.0/8"};
    RunningServer server(params);
    Client client(server);
    client.say("GET /who HTTP/1.0\r\nX-Forwarded-For: 203.0.113.7\r\nForwarded: for=203.0.113.8\r\n\r\n");
    BOOST_TEST(client.read_all().ends_with("I am 127.0.0.1, counted by [127.0.0.1]\n"));
}

BOOST_AUTO_TEST_CASE(a_trusted_proxy_that_is_no_address_is_refused)
{
    boost::asio::io_context context;
    HttpServerParams params;
    params.network.trusted_proxies = {"::1", "proxy.example.org"};
    auto const server = make_http_server(context.get_executor(), params, Logger());
    auto const listening = server->listen();
    BOOST_TEST_REQUIRE(!listening);
    BOOST_TEST((listening.error() == errc::invalid_config));
    BOOST_TEST(listening.error().message() ==
               "A trusted proxy is neither an address nor a network: proxy.example.org");
}

BOOST_AUTO_TEST_CASE(this_computer_has_no_limit_because_proxies_are_there)
{
    HttpServerParams params;
    params.network.connections_per_address = 1;
    RunningServer server(params);
    Client first(server);
    Client second(server);
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::connections, 2));
    BOOST_TEST(server.statistics().refused_address == 0u);
}

BOOST_AUTO_TEST_CASE(a_browser_that_does_not_read_is_dropped_and_slows_nobody)
{
    RunningServer server;
    Client slow(server);
    slow.upgrade("/flood");
    BOOST_TEST(eventually([&] { return server.endpoint.flood_refused.load(); }));
    BOOST_TEST(server.statistics().slow_readers == 1u);
    BOOST_TEST(server.endpoint.max_queued > 200'000u); // the queue, and what the kernel has not sent
    Client other(server);
    other.say("GET /served HTTP/1.0\r\n\r\n");
    BOOST_TEST(other.read_all().ends_with("/served"));
    BOOST_TEST(eventually([&] { return server.endpoint.ended == 1; }));
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::connections, 0));
}

BOOST_AUTO_TEST_CASE(a_shared_body_is_sent_from_where_it_is_and_compressed_once_for_who_takes_that)
{
    RunningServer server;
    std::string text;
    for (int i = 0; i < 50'000; ++i)
        text += std::to_string(i) + " ";
    server.endpoint.shared = std::make_shared<SharedBody const>(text);
    Client client(server);
    std::string const asked = "GET /shared HTTP/1.1\r\nHost: h\r\n";
    client.say(asked + "\r\nHEAD /shared HTTP/1.1\r\nHost: h\r\n\r\nGET /next HTTP/1.1\r\nHost: h\r\n\r\n");
    auto const length = "Content-Length: " + std::to_string(text.size()) + "\r\n";
    auto const head = client.read_to("\r\n\r\n");
    BOOST_TEST(head.find(length) != std::string::npos, head);
    BOOST_TEST(head.find("Content-Encoding") == std::string::npos);
    BOOST_TEST((client.read(text.size()) == text));
    BOOST_TEST(client.read_to("\r\n\r\n").find(length) != std::string::npos); // of HEAD
    client.read_to("\r\n\r\n");
    BOOST_TEST(client.read(5) == "/next");
    std::string compressed;
    for (auto const* encodings : {"gzip, br", "br;q=1.0, gzip;q=0.5", "GZIP"}) {
        client.say(asked + "Accept-Encoding: " + encodings + "\r\n\r\n");
        auto const answer = client.read_to("\r\n\r\n");
        BOOST_TEST(answer.find("Content-Encoding: gzip\r\n") != std::string::npos, encodings);
        auto const body = client.read(server.endpoint.shared->gzip.size());
        BOOST_TEST(body.starts_with("\x1f\x8b"));
        BOOST_TEST((compressed.empty() || body == compressed));
        compressed = body;
    }
    BOOST_TEST(unpacked(compressed) == text);
    for (auto const* encodings : {"gzip;q=0", "br", "gzipped"}) {
        client.say(asked + "Accept-Encoding: " + encodings + "\r\n\r\n");
        BOOST_TEST(client.read_to("\r\n\r\n").find(length) != std::string::npos, encodings);
        BOOST_TEST((client.read(text.size()) == text));
    }
}

BOOST_AUTO_TEST_CASE(a_shared_body_that_brings_its_compressed_form_is_sent_as_that_however_large_it_is)
{
    RunningServer server;
    auto const body = std::make_shared<SharedBody>(std::string(1'000'000, 'x'));
    body->gzip = "compressed";
    server.endpoint.shared = body;
    Client client(server);
    client.say("GET /shared HTTP/1.1\r\nHost: h\r\nAccept-Encoding: gzip\r\n\r\n");
    auto const head = client.read_to("\r\n\r\n");
    BOOST_TEST(head.find("Content-Encoding: gzip\r\n") != std::string::npos, head);
    BOOST_TEST(head.find("Content-Length: 10\r\n") != std::string::npos, head);
    BOOST_TEST(client.read(10) == "compressed");
}

BOOST_AUTO_TEST_CASE(who_does_not_take_a_shared_body_holds_no_copy_and_is_cut_in_time)
{
    HttpServerParams params;
    params.write_timeout = std::chrono::seconds(1);
    RunningServer server(params);
    // Far more than the kernel buffers for a connection.
    server.endpoint.shared = std::make_shared<SharedBody const>(std::string(64'000'000, 'x'));
    auto const readers = [&] { return server.endpoint.shared.use_count() - 1; };
    Client slow(server);
    slow.say("GET /shared HTTP/1.1\r\nHost: h\r\n\r\n");
    BOOST_TEST(eventually([&] { return readers() == 1; }));
    Client other(server);
    other.say("GET /served HTTP/1.0\r\n\r\n");
    BOOST_TEST(other.read_all().ends_with("/served"));
    BOOST_TEST(eventually([&] { return readers() == 0; }));
    BOOST_TEST(server.statistics().timed_out == 1u);
    BOOST_TEST(slow.read_all().size() < 64'000'000u);
}

BOOST_AUTO_TEST_CASE(what_a_client_does_not_take_waits_with_us_and_not_in_the_kernel_where_no_deadline_is)
{
    HttpServerParams params;
    params.write_timeout = std::chrono::seconds(1);
    RunningServer server(params);
    server.endpoint.shared =
        std::make_shared<SharedBody const>(std::string(150'000, 'x')); // as a monitor page
    Client slow(server, 4096);
    slow.say("GET /shared HTTP/1.1\r\nHost: h\r\n\r\n");
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::timed_out, 1));
    BOOST_TEST(server.endpoint.shared.use_count() == 1);
}

// Protocol sections 2.2 and 4.1.
BOOST_AUTO_TEST_CASE(a_handshake_is_taken_from_every_origin_and_negotiates_nothing)
{
    RunningServer server;
    Client client(server);
    client.say(
        "GET /echo HTTP/1.1\r\nHost: h\r\nOrigin: https://elsewhere.example.org\r\nUpgrade: websocket\r\n"
        "Connection: keep-alive, Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: chat\r\n"
        "Sec-WebSocket-Extensions: permessage-deflate\r\nSec-WebSocket-Key: "
        "dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    BOOST_TEST(client.read_to("\r\n\r\n") == "HTTP/1.1 101 Switching Protocols\r\nServer: "
                                             "webots_cloud\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                                             "Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n\r\n");
}

BOOST_AUTO_TEST_CASE(messages_that_came_with_the_handshake_are_answered_in_order)
{
    RunningServer server;
    Client client(server);
    client.upgrade("/echo");
    std::string frames;
    std::string echoes;
    for (int i = 0; i < 200; ++i) {
        auto const text = std::to_string(i);
        frames += frame(0x81, text);
        echoes += std::string{static_cast<char>(0x81), static_cast<char>(text.size())} + text;
    }
    client.say(frames);
    BOOST_TEST(client.read(echoes.size()) == echoes);
    client.say(frame(0x88, "\x03\xe8"));
    BOOST_TEST(client.read_all() == close_frame(1000));
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::websockets, 0));
}

BOOST_AUTO_TEST_CASE(messages_that_are_sent_together_go_out_together)
{
    RunningServer server;
    Client client(server);
    client.upgrade("/twice");
    auto const segments = [&client] {
        struct // as in linux/tcp.h; that of the C library ends earlier
        {
            tcp_info known;
            std::uint64_t rates_and_bytes[4];
            std::uint32_t segments_and_others[4];
            std::uint32_t data_segments_in;
        } info{};
        socklen_t size = sizeof info;
        BOOST_TEST_REQUIRE(::getsockopt(client.descriptor(), IPPROTO_TCP, TCP_INFO, &info, &size) == 0);
        return info.data_segments_in;
    };
    auto const frames = std::string("\x81\x05hello\x81\x05hello");
    client.say(frame(0x81, "hello"));
    BOOST_TEST(client.read(frames.size()) == frames);
    auto const before = segments();
    client.say(frame(0x81, "hello"));
    BOOST_TEST(client.read(frames.size()) == frames);
    BOOST_TEST(segments() - before == 1u);
}

// The event loop belongs to nobody else.
BOOST_AUTO_TEST_CASE(of_many_small_messages_a_few_are_handled_before_others_have_their_turn)
{
    RunningServer server;
    Client client(server);
    client.upgrade("/turns");
    std::string frames;
    for (int i = 0; i < 2000; ++i)
        frames += frame(0x81, "");
    client.say(frames);
    BOOST_TEST(eventually([&] { return server.endpoint.messages == 2000; }));
    BOOST_TEST(server.endpoint.max_messages_per_turn <= 32);
    client.say(frame(0x88, ""));
    BOOST_TEST(client.read_all() == std::string("\x88\0", 2));
}

BOOST_AUTO_TEST_CASE(of_many_pings_that_come_at_once_the_last_is_answered)
{
    RunningServer server;
    Client client(server);
    client.upgrade("/echo");
    std::string frames;
    for (int i = 0; i < 2000; ++i)
        frames += frame(0x89, "");
    client.say(frames + frame(0x89, "last") + frame(0x81, "x"));
    auto const answers = client.read_to(std::string("\x81\x01x", 3));
    BOOST_TEST(answers.size() < 100u);
    BOOST_TEST(answers.find("\x8a\x04last") != std::string::npos);
    client.say(frame(0x88, ""));
    BOOST_TEST(client.read_all() == std::string("\x88\0", 2));
}

BOOST_AUTO_TEST_CASE(a_browser_that_breaks_the_protocol_is_told_why_and_closed)
{
    RunningServer server;
    Client client(server);
    client.upgrade("/echo");
    client.say(std::string("\x81\x01x", 3));
    BOOST_TEST(client.read_all() == close_frame(1002));
    BOOST_TEST(server.statistics().bad_frames == 1u);
}

// Protocol section 13, quirk Q8.
BOOST_AUTO_TEST_CASE(silent_websockets_are_pinged_and_those_that_do_not_answer_are_dropped)
{
    HttpServerParams params;
    params.network.ping_interval = std::chrono::seconds(1);
    params.network.ping_timeout = std::chrono::seconds(2);
    RunningServer server(params);
    Client dead(server);
    dead.upgrade("/echo");
    Client living(server);
    living.upgrade("/echo");
    for (int i = 0; i < 4; ++i) {
        BOOST_TEST_REQUIRE(living.read(2) == std::string("\x89\0", 2));
        living.say(frame(0x8a, ""));
    }
    BOOST_TEST(dead.read_all() == std::string("\x89\0", 2));
    BOOST_TEST(server.statistics().dead_peers == 1u);
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::websockets, 1));
    // Protocol section 4.1.4: a lost browser's simulation ends, and the log is to say why it was lost.
    BOOST_TEST_REQUIRE(eventually([&] { return server.endpoint.ended == 1; }));
    BOOST_TEST(
        server.endpoint.last_failure.message() ==
        "the browser answered no ping for 2 s: it may be asleep, or its network gone (\"pingTimeout\")");
}

BOOST_AUTO_TEST_CASE(without_a_limit_silent_websockets_are_pinged_again_and_kept)
{
    HttpServerParams params;
    params.network.ping_interval = std::chrono::seconds(1);
    params.network.ping_timeout = std::chrono::seconds(0);
    RunningServer server(params);
    Client asleep(server);
    asleep.upgrade("/echo");
    for (int i = 0; i < 3; ++i)
        BOOST_TEST_REQUIRE(asleep.read(2) == std::string("\x89\0", 2));
    asleep.say(frame(0x81, "awake"));
    BOOST_TEST(asleep.read_to("awake").ends_with("awake"));
    BOOST_TEST(server.statistics().dead_peers == 0u);
}

BOOST_AUTO_TEST_CASE(stopping_closes_websockets_with_1001_and_waits_for_nobody)
{
    RunningServer server;
    Client websocket(server);
    websocket.upgrade("/echo");
    Client silent(server);
    Client half(server);
    half.say("GET /");
    BOOST_TEST_REQUIRE(server.eventually_counts(&HttpServerStatistics::connections, 3));
    BOOST_TEST(server.stop()); // none of the clients answers
    auto const farewell = websocket.read_all();
    BOOST_TEST(farewell.starts_with(std::string("\x88\x18\x03\xe9", 4)), "got " << farewell);
    BOOST_TEST(silent.read_all() == "");
    BOOST_TEST(server.endpoint.ended == 1);
}

BOOST_AUTO_TEST_SUITE_END()
