#include "unit_test.hpp"

#include "adapters/http/forward_text.hpp"

#include <algorithm>
#include <string>

using namespace webots_cloud;
using adapters::ForwardedResponse;
using adapters::HttpRequestReader;
using Body = ForwardedResponse::Body;
using Progress = ForwardedResponse::Progress;

namespace {

/// What the other server is sent for a request.
std::string forwarded(std::string const& head, HttpHeaders headers = {}, bool upgrade = false,
                      bool keep_alive = false)
{
    HttpRequestReader reader;
    auto const space = reader.prepare();
    BOOST_TEST_REQUIRE(head.size() <= space.size());
    std::copy(head.begin(), head.end(), space.begin());
    reader.commit(head.size());
    BOOST_TEST_REQUIRE((reader.parse() == HttpRequestReader::Progress::complete));
    auto request = reader.request();
    request.peer = "10.0.0.1";
    request.client = "203.0.113.7";
    request.upgrade = upgrade;
    Forward forward;
    forward.target = "/there?a=b";
    forward.headers = std::move(headers);
    return adapters::forwarded_request(reader, request, forward, keep_alive);
}

std::string_view const start = "GET /here HTTP/1.1\r\nHost: h\r\n";

/// The head for the browser.
std::string head_of(ForwardedResponse const& response, bool keep_alive = true)
{
    std::string head;
    response.append_head(head, keep_alive);
    return head;
}

ForwardedResponse parsed(std::string_view text, bool is_head = false, bool is_upgrade = false)
{
    ForwardedResponse response(is_head, is_upgrade);
    BOOST_TEST_REQUIRE((response.parse(text) == Progress::complete), text);
    return response;
}

} // namespace

BOOST_AUTO_TEST_SUITE(forward_text)

BOOST_AUTO_TEST_CASE(a_request_is_written_anew_with_the_other_servers_path)
{
    BOOST_TEST(forwarded(std::string(start) + "Accept: */*\r\nCookie: a=b\r\n\r\n") ==
               "GET /there?a=b HTTP/1.1\r\nHost: h\r\nAccept: */*\r\nCookie: a=b\r\n"
               "X-Forwarded-For: 203.0.113.7, 10.0.0.1\r\nConnection: close\r\n\r\n");
    BOOST_TEST(forwarded("HEAD / HTTP/1.0\r\n\r\n") ==
               "HEAD /there?a=b HTTP/1.0\r\nX-Forwarded-For: 203.0.113.7, 10.0.0.1\r\n"
               "Connection: close\r\n\r\n");
}

// RFC 9110, 7.6.1.
BOOST_AUTO_TEST_CASE(a_connection_may_be_kept_if_both_say_so)
{
    BOOST_TEST(forwarded("GET /here HTTP/1.1\r\nHost: h\r\nConnection: close\r\n\r\n", {}, false, true) ==
               "GET /there?a=b HTTP/1.1\r\nHost: h\r\nX-Forwarded-For: 203.0.113.7, 10.0.0.1\r\n"
               "Connection: keep-alive\r\n\r\n");
    std::string const length = "Content-Length: 5\r\n";
    BOOST_TEST(parsed("HTTP/1.1 200 OK\r\n" + length + "\r\n").keeps_connection());
    BOOST_TEST(parsed("HTTP/1.0 200 OK\r\nConnection: Keep-Alive\r\n" + length + "\r\n").keeps_connection());
    BOOST_TEST(!parsed("HTTP/1.0 200 OK\r\n" + length + "\r\n").keeps_connection());
    BOOST_TEST(!parsed("HTTP/1.1 200 OK\r\nConnection: x, Close\r\n" + length + "\r\n").keeps_connection());
}

BOOST_AUTO_TEST_CASE(what_concerns_one_connection_alone_is_not_passed_on)
{
    BOOST_TEST(forwarded(std::string(start) +
                         "connection: keep-alive, X-Own\r\nKeep-Alive: timeout=5\r\nX-Own: 1\r\n"
                         "Proxy-Connection: keep-alive\r\nTE: trailers\r\nUpgrade: h2c\r\n"
                         "Expect: 100-continue\r\nTrailer: x\r\nX-Kept: 2\r\n\r\n") ==
               "GET /there?a=b HTTP/1.1\r\nHost: h\r\nX-Kept: 2\r\n"
               "X-Forwarded-For: 203.0.113.7, 10.0.0.1\r\nConnection: close\r\n\r\n");
}

BOOST_AUTO_TEST_CASE(a_handshake_keeps_what_makes_it_one)
{
    BOOST_TEST(forwarded("GET /here HTTP/1.1\r\nHost: h\r\nUpgrade: websocket, h2c\r\nConnection: Upgrade\r\n"
                         "Sec-WebSocket-Key: k\r\nSec-WebSocket-Version: 13\r\nOrigin: https://o\r\n\r\n",
                         {}, true) ==
               "GET /there?a=b HTTP/1.1\r\nHost: h\r\nSec-WebSocket-Key: k\r\nSec-WebSocket-Version: 13\r\n"
               "Origin: https://o\r\nX-Forwarded-For: 203.0.113.7, 10.0.0.1\r\n"
               "Upgrade: websocket\r\nConnection: Upgrade\r\n\r\n");
}

BOOST_AUTO_TEST_CASE(headers_are_replaced_where_the_endpoint_says_so)
{
    BOOST_TEST(forwarded(std::string(start) + "accept: */*\r\n\r\n",
                         {{"Host", "127.0.0.1:1234"}, {"Accept", "text/html"}}) ==
               "GET /there?a=b HTTP/1.1\r\nHost: 127.0.0.1:1234\r\nAccept: text/html\r\n"
               "X-Forwarded-For: 203.0.113.7, 10.0.0.1\r\nConnection: close\r\n\r\n");
}

// Issue 24: only a gateway knows where browsers reach the machine behind it.
BOOST_AUTO_TEST_CASE(what_only_a_gateway_may_say_is_not_passed_on_from_browsers)
{
    auto const asked = std::string(start) + "Origin: https://o\r\nwebots-cloud-address: ws://evil\r\n\r\n";
    BOOST_TEST(forwarded(asked) == "GET /there?a=b HTTP/1.1\r\nHost: h\r\nOrigin: https://o\r\n"
                                   "X-Forwarded-For: 203.0.113.7, 10.0.0.1\r\nConnection: close\r\n\r\n");
    BOOST_TEST(forwarded(asked, {{"Origin", ""}, {"Webots-Cloud-Address", "wss://h/machine/a"}}) ==
               "GET /there?a=b HTTP/1.1\r\nHost: h\r\nWebots-Cloud-Address: wss://h/machine/a\r\n"
               "X-Forwarded-For: 203.0.113.7, 10.0.0.1\r\nConnection: close\r\n\r\n");
}

// The next server believes the last entries alone, which those have written whom we trust.
BOOST_AUTO_TEST_CASE(the_peer_is_appended_to_whatever_is_said_of_where_the_request_has_come_from)
{
    BOOST_TEST(forwarded(std::string(start) +
                         "X-Forwarded-For: 192.0.2.1, 192.0.2.2\r\nForwarded: for=192.0.2.9\r\n"
                         "Connection: X-Forwarded-For\r\nx-forwarded-for: 192.0.2.3\r\n\r\n") ==
               "GET /there?a=b HTTP/1.1\r\nHost: h\r\n"
               "X-Forwarded-For: 192.0.2.1, 192.0.2.2, 192.0.2.3, 10.0.0.1\r\nConnection: close\r\n\r\n");
}

BOOST_AUTO_TEST_CASE(a_length_that_there_is_can_only_be_nothing)
{
    BOOST_TEST(forwarded("POST /here HTTP/1.1\r\nHost: h\r\nContent-Length: 00\r\n\r\n") ==
               "POST /there?a=b HTTP/1.1\r\nHost: h\r\nContent-Length: 0\r\n"
               "X-Forwarded-For: 203.0.113.7, 10.0.0.1\r\nConnection: close\r\n\r\n");
}

BOOST_AUTO_TEST_CASE(an_answer_with_a_length_leaves_the_browsers_connection_open)
{
    std::string const text = "HTTP/1.0 200 Fine\r\nServer: Webots\r\nConnection: close, X-Own\r\nX-Own: 1\r\n"
                             "Keep-Alive: 5\r\nContent-Length: 7\r\nETag: \"a\"\r\n\r\nbody";
    auto const response = parsed(text);
    BOOST_TEST(response.status() == 200);
    BOOST_TEST((response.body() == Body::counted));
    BOOST_TEST(response.length() == 7u);
    BOOST_TEST(text.substr(response.head_size()) == "body");
    std::string const head = "HTTP/1.1 200 Fine\r\nServer: Webots\r\nContent-Length: 7\r\nETag: \"a\"\r\n";
    BOOST_TEST(head_of(response) == head + "Connection: keep-alive\r\n\r\n");
    BOOST_TEST(head_of(response, false) == head + "Connection: close\r\n\r\n");
}

BOOST_AUTO_TEST_CASE(without_a_length_an_answer_lasts_as_long_as_the_connection)
{
    auto const chunked =
        parsed("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\nTrailer: X-Sum\r\n\r\n5\r\nhello\r\n");
    BOOST_TEST((chunked.body() == Body::endless));
    BOOST_TEST(head_of(chunked, false) ==
               "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\nTrailer: X-Sum\r\n"
               "Connection: close\r\n\r\n");
    BOOST_TEST((parsed("HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace\r\n\r\n").body() ==
                Body::endless));
    BOOST_TEST((parsed("HTTP/1.1 200 OK\r\nTransfer-Encoding: gzip\r\n\r\n").body() == Body::endless));
}

BOOST_AUTO_TEST_CASE(some_answers_have_no_body_whatever_they_say)
{
    std::string_view const length = "Content-Length: 7\r\n\r\n";
    for (auto const* line : {"HTTP/1.1 304 Not Modified\r\n", "HTTP/1.1 204 No Content\r\n"})
        BOOST_TEST((parsed(std::string(line) + std::string(length)).body() == Body::none));
    auto const head = parsed(std::string("HTTP/1.1 200 OK\r\n") + std::string(length), true);
    BOOST_TEST((head.body() == Body::none));
    BOOST_TEST(head_of(head) == "HTTP/1.1 200 OK\r\nContent-Length: 7\r\nConnection: keep-alive\r\n\r\n");
    BOOST_TEST((parsed("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n", true).body() == Body::none));
}

BOOST_AUTO_TEST_CASE(a_handshake_is_accepted_with_what_the_other_server_says)
{
    std::string const text = "HTTP/1.1 101 Switching Protocols\r\nUpgrade: WebSocket\r\n"
                             "Connection: upgrade\r\nSec-WebSocket-Accept: a\r\n\r\nframe";
    auto const response = parsed(text, false, true);
    BOOST_TEST((response.body() == Body::websocket));
    BOOST_TEST(head_of(response) == "HTTP/1.1 101 Switching Protocols\r\nSec-WebSocket-Accept: a\r\n"
                                    "Upgrade: websocket\r\nConnection: Upgrade\r\n\r\n");
    BOOST_TEST(text.substr(response.head_size()) == "frame");
    BOOST_TEST(
        (parsed("HTTP/1.1 404 Not Found\r\nContent-Length: 3\r\n\r\n", false, true).body() == Body::counted));
    ForwardedResponse unasked(false, false);
    BOOST_TEST((unasked.parse(text) == Progress::malformed), "nobody has asked for that");
}

BOOST_AUTO_TEST_CASE(a_header_is_added_unless_the_other_server_sends_it)
{
    for (std::string const sent :
         {"Access-Control-Allow-Origin: *\r\n", "access-control-allow-origin: x\r\n", ""}) {
        auto response = parsed("HTTP/1.1 200 OK\r\n" + sent + "Content-Length: 1\r\n\r\n");
        response.add_missing("Access-Control-Allow-Origin", "*");
        auto const added = sent.empty() ? "Access-Control-Allow-Origin: *\r\n" : "";
        BOOST_TEST(head_of(response) == "HTTP/1.1 200 OK\r\n" + sent + "Content-Length: 1\r\n" + added +
                                            "Connection: keep-alive\r\n\r\n");
    }
}

BOOST_AUTO_TEST_CASE(a_header_is_added_whatever_the_other_server_sends)
{
    for (std::string const sent :
         {"Content-Security-Policy: x\r\n", "", "Connection: content-security-policy, close\r\n"}) {
        auto response = parsed("HTTP/1.1 200 OK\r\nContent-Length: 1\r\n" + sent + "\r\n");
        response.add("Content-Security-Policy", "sandbox");
        auto const kept = sent.starts_with("Connection") ? "" : sent;
        BOOST_TEST(head_of(response) == "HTTP/1.1 200 OK\r\nContent-Length: 1\r\n" + kept +
                                            "Content-Security-Policy: sandbox\r\n"
                                            "Connection: keep-alive\r\n\r\n");
    }
    auto handshake = parsed("HTTP/1.1 101 Switching Protocols\r\n\r\n", false, true);
    handshake.add("Content-Security-Policy", "sandbox");
    BOOST_TEST(head_of(handshake).find("sandbox") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(the_other_server_gets_no_say_about_the_rest_of_the_site)
{
    auto const response = parsed("HTTP/1.1 200 OK\r\nservice-worker-allowed: /\r\nSet-Cookie: a=b; Path=/\r\n"
                                 "Clear-Site-Data: \"*\"\r\nStrict-Transport-Security: max-age=9\r\n"
                                 "Content-Length: 1\r\n\r\n");
    BOOST_TEST(head_of(response) == "HTTP/1.1 200 OK\r\nContent-Length: 1\r\nConnection: keep-alive\r\n\r\n");
}

BOOST_AUTO_TEST_CASE(interim_answers_are_skipped)
{
    std::string const text = "HTTP/1.1 103 Early Hints\r\nLink: x\r\n\r\nHTTP/1.1 100 Continue\r\n\r\n"
                             "HTTP/1.1 200 OK\r\nContent-Length: 1\r\n\r\n!";
    auto const response = parsed(text);
    BOOST_TEST(head_of(response) == "HTTP/1.1 200 OK\r\nContent-Length: 1\r\nConnection: keep-alive\r\n\r\n");
    BOOST_TEST(text.substr(response.head_size()) == "!");
}

BOOST_AUTO_TEST_CASE(an_answer_may_come_byte_by_byte)
{
    std::string const text =
        "HTTP/1.1 103 Early Hints\r\n\r\nHTTP/1.1 200 OK\r\nContent-Length: 1\r\nX: y\r\n\r\n";
    ForwardedResponse response(false, false);
    for (std::size_t size = 0; size < text.size(); ++size)
        BOOST_TEST_REQUIRE((response.parse(text.substr(0, size)) == Progress::need_more));
    BOOST_TEST((response.parse(text) == Progress::complete));
}

// What two programs could understand differently is passed on to nobody.
BOOST_AUTO_TEST_CASE(nonsense_is_refused)
{
    for (std::string const text :
         {"SSH-2.0-OpenSSH\r\n\r\n", "HTTP/1.1 200 OK\r\nno colon\r\n\r\n", "HTTP/2 200\r\n\r\n",
          "HTTP/1.1 200 OK\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
          "HTTP/1.1 200 OK\r\nContent-Length: 1\r\nTransfer-Encoding: chunked\r\n\r\n",
          "HTTP/1.1 200 OK\r\nContent-Length: -1\r\n\r\n",
          "HTTP/1.1 200 OK\r\nX: a\x01"
          "b\r\n\r\n"}) {
        ForwardedResponse response(false, false);
        BOOST_TEST((response.parse(text) == Progress::malformed), text);
    }
}

BOOST_AUTO_TEST_CASE(a_head_has_a_limit)
{
    auto const verdict = [](std::size_t size, std::string_view end) {
        std::string text = "HTTP/1.1 200 OK\r\n";
        while (text.size() + 5'000 < size)
            text.append("X: ").append(4'000, 'x').append("\r\n");
        text.append("Y: ").append(size - text.size() - end.size(), 'y').append(end);
        ForwardedResponse response(false, false);
        return response.parse(text);
    };
    BOOST_TEST((verdict(adapters::max_response_head, "\r\n\r\n") == Progress::complete));
    BOOST_TEST((verdict(adapters::max_response_head, "") == Progress::need_more));
    BOOST_TEST((verdict(adapters::max_response_head + 1, "\r\n\r\n") == Progress::malformed));
    BOOST_TEST((verdict(adapters::max_response_head + 1, "") == Progress::malformed));
}

BOOST_AUTO_TEST_SUITE_END()
