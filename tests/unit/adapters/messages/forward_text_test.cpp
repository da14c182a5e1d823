#include "unit_test.hpp"

#include "adapters/messages/forward_text.hpp"
#include "core/access/passed_headers.hpp"
#include "core/text.hpp"

#include <boost/beast/http/field.hpp>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

using namespace webots_cloud;
using adapters::ForwardedResponse;
using adapters::HttpRequestReader;
using core::concat;

BOOST_AUTO_TEST_SUITE(forward_text)

using Body = ForwardedResponse::Body;
using Progress = ForwardedResponse::Progress;

namespace {

/// What the other server is sent for a request.
std::string forwarded(std::string const& head, HttpHeaders headers = {}, bool upgrade = false,
                      bool keep_alive = false, UpstreamKind kind = UpstreamKind::machine)
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
    forward.kind = kind;
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

/// What a head says: its first line and all of its fields, with names in small letters. Their order says
/// nothing.
struct Head
{
    Head(std::string_view first_line, std::vector<std::string> lines) : first_line(first_line)
    {
        for (auto const& line : lines)
            add(line);
    }

    explicit Head(std::string_view text)
    {
        BOOST_TEST_REQUIRE(text.ends_with("\r\n\r\n"), text);
        text.remove_suffix(4);
        auto const lines = core::split(text, '\n');
        for (std::size_t i = 0; i < lines.size(); ++i) {
            bool const is_last = i + 1 == lines.size();
            BOOST_TEST_REQUIRE((is_last || lines[i].ends_with('\r')), text);
            auto const line = lines[i].substr(0, lines[i].size() - (is_last ? 0 : 1));
            BOOST_TEST_REQUIRE(line != "", text);
            if (i == 0)
                first_line = line;
            else
                add(line);
        }
    }

    void add(std::string_view line)
    {
        auto const colon = line.find(": ");
        BOOST_TEST_REQUIRE(colon != std::string_view::npos, line);
        fields.insert(concat(core::lower_case(line.substr(0, colon)), line.substr(colon)));
    }

    bool operator==(Head const&) const = default;

    friend std::ostream& operator<<(std::ostream& out, Head const& head)
    {
        out << head.first_line;
        for (auto const& field : head.fields)
            out << " | " << field;
        return out;
    }

    std::string first_line;
    std::multiset<std::string> fields;
};

/// What a request says to the other server that reaches it.
Head asks(std::string_view first_line, std::vector<std::string> passed, std::string_view connection = "close",
          std::string_view from = "203.0.113.7, 10.0.0.1")
{
    passed.push_back(concat("Connection: ", connection));
    if (!from.empty())
        passed.push_back(concat("X-Forwarded-For: ", from));
    return Head(first_line, std::move(passed));
}

/// What an answer says to the browser that gets it.
Head answers(std::string_view first_line, std::vector<std::string> passed,
             std::string_view connection = "keep-alive")
{
    passed.push_back(concat("Connection: ", connection));
    return Head(first_line, std::move(passed));
}

ForwardedResponse parsed(std::string_view text, bool is_head = false, bool is_upgrade = false,
                         UpstreamKind kind = UpstreamKind::simulation)
{
    ForwardedResponse response(kind, is_head, is_upgrade);
    BOOST_TEST_REQUIRE((response.parse(text) == Progress::complete), text);
    return response;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_request_is_written_anew_with_the_other_servers_path)
{
    BOOST_TEST(Head(forwarded(std::string(start) + "Accept: */*\r\nCookie: a=b\r\n\r\n")) ==
               asks("GET /there?a=b HTTP/1.1", {"Host: h", "Accept: */*"}));
    BOOST_TEST(Head(forwarded("HEAD / HTTP/1.0\r\n\r\n")) == asks("HEAD /there?a=b HTTP/1.0", {}));
}

// RFC 9110, 7.6.1.
BOOST_AUTO_TEST_CASE(a_connection_may_be_kept_if_both_say_so)
{
    BOOST_TEST(Head(forwarded("GET /here HTTP/1.1\r\nHost: h\r\nConnection: close\r\n\r\n", {}, false,
                              true)) == asks("GET /there?a=b HTTP/1.1", {"Host: h"}, "keep-alive"));
    std::string const length = "Content-Length: 5\r\n";
    BOOST_TEST(parsed("HTTP/1.1 200 OK\r\n" + length + "\r\n").keeps_connection());
    BOOST_TEST(parsed("HTTP/1.0 200 OK\r\nConnection: Keep-Alive\r\n" + length + "\r\n").keeps_connection());
    BOOST_TEST(!parsed("HTTP/1.0 200 OK\r\n" + length + "\r\n").keeps_connection());
    BOOST_TEST(!parsed("HTTP/1.1 200 OK\r\nConnection: x, Close\r\n" + length + "\r\n").keeps_connection());
}

BOOST_AUTO_TEST_CASE(what_concerns_one_connection_alone_is_not_passed_on)
{
    BOOST_TEST(Head(forwarded(std::string(start) +
                              "connection: keep-alive, X-Own\r\nKeep-Alive: timeout=5\r\nX-Own: 1\r\n"
                              "Proxy-Connection: keep-alive\r\nTE: trailers\r\nUpgrade: h2c\r\n"
                              "Expect: 100-continue\r\nTrailer: x\r\nAccept: 2\r\n\r\n")) ==
               asks("GET /there?a=b HTTP/1.1", {"Host: h", "Accept: 2"}));
}

BOOST_AUTO_TEST_CASE(a_handshake_keeps_what_makes_it_one)
{
    auto const handshake =
        forwarded("GET /here HTTP/1.1\r\nHost: h\r\nUpgrade: websocket, h2c\r\nConnection: Upgrade\r\n"
                  "Sec-WebSocket-Key: k\r\nSec-WebSocket-Version: 13\r\nOrigin: https://o\r\n\r\n",
                  {}, true);
    BOOST_TEST(Head(handshake) == asks("GET /there?a=b HTTP/1.1",
                                       {"Host: h", "Sec-WebSocket-Key: k", "Sec-WebSocket-Version: 13",
                                        "Origin: https://o", "Upgrade: websocket"},
                                       "Upgrade"));
}

BOOST_AUTO_TEST_CASE(headers_are_replaced_where_the_endpoint_says_so)
{
    BOOST_TEST(Head(forwarded(std::string(start) + "accept: */*\r\n\r\n",
                              {{"Host", "127.0.0.1:1234"}, {"Accept", "text/html"}})) ==
               asks("GET /there?a=b HTTP/1.1", {"Host: 127.0.0.1:1234", "Accept: text/html"}));
}

// Only a gateway knows where browsers reach the machine behind it.
BOOST_AUTO_TEST_CASE(what_only_a_gateway_may_say_is_not_passed_on_from_browsers)
{
    auto const asked = std::string(start) + "Origin: https://o\r\nwebots-cloud-address: ws://evil\r\n\r\n";
    BOOST_TEST(Head(forwarded(asked)) == asks("GET /there?a=b HTTP/1.1", {"Host: h", "Origin: https://o"}));
    BOOST_TEST(Head(forwarded(asked, {{"Origin", ""}, {"Webots-Cloud-Address", "wss://h/machine/a"}})) ==
               asks("GET /there?a=b HTTP/1.1", {"Host: h", "Webots-Cloud-Address: wss://h/machine/a"}));
}

// The next server believes the last entries alone, which those have written whom we trust.
BOOST_AUTO_TEST_CASE(the_peer_is_appended_to_whatever_is_said_of_where_the_request_has_come_from)
{
    BOOST_TEST(
        Head(forwarded(std::string(start) +
                       "X-Forwarded-For: 192.0.2.1, 192.0.2.2\r\nForwarded: for=192.0.2.9\r\n"
                       "Connection: X-Forwarded-For\r\nx-forwarded-for: 192.0.2.3\r\n\r\n")) ==
        asks("GET /there?a=b HTTP/1.1", {"Host: h"}, "close", "192.0.2.1, 192.0.2.2, 192.0.2.3, 10.0.0.1"));
}

BOOST_AUTO_TEST_CASE(a_length_that_there_is_can_only_be_nothing)
{
    BOOST_TEST(Head(forwarded("POST /here HTTP/1.1\r\nHost: h\r\nContent-Length: 00\r\n\r\n")) ==
               asks("POST /there?a=b HTTP/1.1", {"Host: h", "Content-Length: 0"}));
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
    std::vector<std::string> const passed{"Server: Webots", "ETag: \"a\"", "Content-Length: 7"};
    BOOST_TEST(Head(head_of(response)) == answers("HTTP/1.1 200 Fine", passed));
    BOOST_TEST(Head(head_of(response, false)) == answers("HTTP/1.1 200 Fine", passed, "close"));
}

// A browser that gets 401 where it sent a password forgets it, for all of the site.
BOOST_AUTO_TEST_CASE(passwords_are_refused_only_by_servers_that_may_ask_for_them)
{
    auto const text = "HTTP/1.1 401 Unauthorized\r\nWWW-Authenticate: Basic\r\nContent-Length: 2\r\n\r\nno";
    std::string const length = "Content-Length: 2";
    for (auto const kind : {UpstreamKind::simulation, UpstreamKind::machine})
        BOOST_TEST(Head(head_of(parsed(text, false, false, kind))) ==
                   answers("HTTP/1.1 403 Forbidden", {length}));
    BOOST_TEST(Head(head_of(parsed(text, false, false, UpstreamKind::trusted_monitor))) ==
               answers("HTTP/1.1 401 Unauthorized", {"WWW-Authenticate: Basic", length}));
}

// The browser would read the rest of the body as the answer to its next request.
BOOST_AUTO_TEST_CASE(the_length_of_a_body_can_not_be_taken_away)
{
    auto const response = parsed(
        "HTTP/1.1 200 OK\r\nConnection: content-length, etag\r\nContent-Length: 007\r\nETag: \"a\"\r\n\r\n");
    BOOST_TEST(Head(head_of(response)) == answers("HTTP/1.1 200 OK", {"ETag: \"a\"", "Content-Length: 7"}));
}

BOOST_AUTO_TEST_CASE(without_a_length_an_answer_ends_with_its_last_chunk_or_with_the_connection)
{
    auto const chunked =
        parsed("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\nTrailer: X-Sum\r\n\r\n5\r\nhello\r\n");
    BOOST_TEST((chunked.body() == Body::chunked));
    BOOST_TEST(Head(head_of(chunked, false)) ==
               answers("HTTP/1.1 200 OK", {"Transfer-Encoding: chunked"}, "close"));
    BOOST_TEST((parsed("HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace\r\n\r\n").body() ==
                Body::endless));
}

BOOST_AUTO_TEST_CASE(some_answers_have_no_body_whatever_they_say)
{
    std::string_view const length = "Content-Length: 7\r\n\r\n";
    for (auto const* line : {"HTTP/1.1 304 Not Modified\r\n", "HTTP/1.1 204 No Content\r\n"})
        BOOST_TEST((parsed(std::string(line) + std::string(length)).body() == Body::none));
    auto const head = parsed(std::string("HTTP/1.1 200 OK\r\n") + std::string(length), true);
    BOOST_TEST((head.body() == Body::none));
    BOOST_TEST(Head(head_of(head)) == answers("HTTP/1.1 200 OK", {"Content-Length: 7"}));
    BOOST_TEST((parsed("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n", true).body() == Body::none));
}

BOOST_AUTO_TEST_CASE(a_handshake_is_accepted_with_what_the_other_server_says)
{
    std::string const text = "HTTP/1.1 101 Switching Protocols\r\nUpgrade: WebSocket\r\n"
                             "Connection: upgrade\r\nSec-WebSocket-Accept: a\r\n\r\nframe";
    auto const response = parsed(text, false, true);
    BOOST_TEST((response.body() == Body::websocket));
    BOOST_TEST(Head(head_of(response)) == answers("HTTP/1.1 101 Switching Protocols",
                                                  {"Sec-WebSocket-Accept: a", "Upgrade: websocket"},
                                                  "Upgrade"));
    BOOST_TEST(text.substr(response.head_size()) == "frame");
    BOOST_TEST(
        (parsed("HTTP/1.1 404 Not Found\r\nContent-Length: 3\r\n\r\n", false, true).body() == Body::counted));
    ForwardedResponse unasked(UpstreamKind::simulation, false, false);
    BOOST_TEST((unasked.parse(text) == Progress::malformed), "nobody has asked for that");
}

BOOST_AUTO_TEST_CASE(a_header_is_added_unless_the_other_server_sends_it)
{
    for (auto const& [sent, said] : {std::pair("Access-Control-Allow-Origin: *\r\n", "*"),
                                     {"access-control-allow-origin: x\r\n", "x"},
                                     {"", "*"}}) {
        auto response = parsed(concat("HTTP/1.1 200 OK\r\n", sent, "Content-Length: 1\r\n\r\n"));
        response.add_missing("Access-Control-Allow-Origin", "*");
        BOOST_TEST(
            Head(head_of(response)) ==
            answers("HTTP/1.1 200 OK", {concat("Access-Control-Allow-Origin: ", said), "Content-Length: 1"}));
    }
}

BOOST_AUTO_TEST_CASE(a_header_is_added_whatever_the_other_server_sends)
{
    std::vector<std::string> const with_ours{"Content-Length: 1", "Content-Security-Policy: sandbox"};
    auto with_both = with_ours;
    with_both.emplace_back("Content-Security-Policy: x");
    for (auto const& [sent, passed] : {std::pair("Content-Security-Policy: x\r\n", with_both),
                                       {"", with_ours},
                                       {"Connection: content-security-policy, close\r\n", with_ours}}) {
        auto response = parsed(concat("HTTP/1.1 200 OK\r\nContent-Length: 1\r\n", sent, "\r\n"));
        response.add("Content-Security-Policy", "sandbox");
        BOOST_TEST(Head(head_of(response)) == answers("HTTP/1.1 200 OK", passed));
    }
    auto handshake = parsed("HTTP/1.1 101 Switching Protocols\r\n\r\n", false, true);
    handshake.add("Content-Security-Policy", "sandbox");
    BOOST_TEST(head_of(handshake).find("sandbox") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_simulation_learns_nothing_of_its_visitor)
{
    auto const asked = std::string(start) +
                       "Authorization: Basic c2VjcmV0\r\nCookie: a=b\r\nReferer: https://site/class/abcd\r\n"
                       "X-Forwarded-For: 192.0.2.1\r\nForwarded: for=192.0.2.9\r\nUser-Agent: u\r\n\r\n";
    BOOST_TEST(Head(forwarded(asked, {}, false, false, UpstreamKind::simulation)) ==
               asks("GET /there?a=b HTTP/1.1", {"Host: h", "User-Agent: u"}, "close", ""));
    BOOST_TEST(Head(forwarded(asked, {}, false, false, UpstreamKind::trusted_monitor)) ==
               asks("GET /there?a=b HTTP/1.1", {"Host: h", "Authorization: Basic c2VjcmV0", "User-Agent: u"},
                    "close", "192.0.2.1, 10.0.0.1"));
}

/// Every name that Beast knows, which has IANA's registries of 2016, and what has come since.
std::vector<std::string> known_names()
{
    std::vector<std::string> names;
    for (auto const name : core::split(
             "Accept-CH Accept-Signature Access-Control-Allow-Private-Network "
             "Access-Control-Request-Private-Network Activate-Storage-Access ALPN Alt-Svc Alt-Used "
             "AMP-Cache-Transform Attribution-Reporting-Eligible Attribution-Reporting-Register-Source "
             "Attribution-Reporting-Register-Trigger Authentication-Control Available-Dictionary "
             "Cache-Group-Invalidation Cache-Groups Cache-Status Capsule-Protocol CDN-Cache-Control "
             "CDN-Loop Cert-Not-After Cert-Not-Before Clear-Site-Data Client-Cert Client-Cert-Chain "
             "Concealed-Auth-Export Configuration-Context Content-Digest Content-DPR "
             "Content-Security-Policy Content-Security-Policy-Report-Only Critical-CH "
             "Cross-Origin-Embedder-Policy Cross-Origin-Embedder-Policy-Report-Only "
             "Cross-Origin-Opener-Policy Cross-Origin-Opener-Policy-Report-Only "
             "Cross-Origin-Resource-Policy Deprecation Device-Memory Dictionary-ID Digest DNT "
             "Document-Policy Downlink DPoP DPoP-Nonce DPR Early-Data ECT Expect-CT Feature-Policy "
             "Front-End-Https Incremental Integrity-Policy Integrity-Policy-Report-Only Isolation "
             "Last-Event-ID Link-Template Memento-Datetime Metadata-Flavor NEL No-Vary-Search "
             "Observe-Browsing-Topics Odata-Isolation Origin-Agent-Cluster OSCORE Permissions-Policy "
             "Permissions-Policy-Report-Only Ping-From Ping-To Priority Proxy-Status Purpose "
             "Referrer-Policy Refresh Repeatability-Request-ID Replay-Nonce Report-To Reporting-Endpoints "
             "Repr-Digest Require-Document-Policy RTT Save-Data Sec-Browsing-Topics Sec-CH-UA "
             "Sec-CH-UA-Full-Version-List Sec-CH-UA-Mobile Sec-CH-UA-Platform Sec-Fetch-Dest "
             "Sec-Fetch-Mode Sec-Fetch-Site Sec-Fetch-Storage-Access Sec-Fetch-User Sec-GPC Sec-Purpose "
             "Sec-Speculation-Tags Sec-Token-Binding Server-Timing Service-Worker Service-Worker-Allowed "
             "Set-Cookie2 Set-Login Set-Txn Shared-Storage-Writable Signature Signature-Input SourceMap "
             "Speculation-Rules Sunset Supports-Loading-Mode Surrogate-Capability Surrogate-Control TCN "
             "Timing-Allow-Origin Topics Traceparent Tracestate Upgrade-Insecure-Requests "
             "Use-As-Dictionary Variant-Vary Viewport-Width Want-Content-Digest Want-Repr-Digest "
             "Webots-Cloud-Address X-Accel-Redirect X-Content-Type-Options Access-Control-Expose-Headers "
             "X-DNS-Prefetch-Control X-Forwarded-For X-Forwarded-Host X-Forwarded-Prefix X-Forwarded-Proto "
             "X-Frame-Options X-HTTP-Method-Override X-Original-URL X-Permitted-Cross-Domain-Policies "
             "X-Real-IP X-Requested-With X-Robots-Tag X-Sendfile X-UA-Compatible X-XSS-Protection",
             ' '))
        names.emplace_back(name);
    using boost::beast::http::field;
    for (auto each = static_cast<unsigned>(field::a_im); each <= static_cast<unsigned>(field::xref); ++each)
        names.emplace_back(boost::beast::http::to_string(static_cast<field>(each)));
    return names;
}

/// Names that a head has, in small letters.
std::set<std::string> names_in(std::string_view head)
{
    std::set<std::string> names;
    for (auto const& field : Head(head).fields)
        names.insert(field.substr(0, field.find(':')));
    return names;
}

template<class Table>
std::set<std::string> allowed(Table const& table, UpstreamKind kind, std::set<std::string> own)
{
    for (auto const& header : table)
        if (kind >= header.least)
            own.insert(core::lower_case(header.name));
    return own;
}

// A list of what is bad is never complete, so every name that there is goes both ways: what the tables of
// docs/gateway.md do not name stays.
BOOST_AUTO_TEST_CASE(of_all_registered_names_only_those_of_the_tables_pass)
{
    // What decides where a message ends has tests of its own.
    std::set<std::string> const framing{"content-length", "transfer-encoding", "connection",
                                        "proxy-connection", "upgrade"};
    for (auto const kind : {UpstreamKind::simulation, UpstreamKind::machine, UpstreamKind::trusted_monitor}) {
        std::set<std::string> asked;
        std::set<std::string> answered;
        std::size_t tried = 0;
        for (auto const& name : known_names()) {
            if (framing.contains(core::lower_case(name)))
                continue;
            ++tried;
            auto const field = name + ": 0\r\n";
            auto const asking =
                concat("GET /here HTTP/1.1\r\n", name == "Host" ? "" : "Host: h\r\n", field, "\r\n");
            asked.merge(names_in(forwarded(asking, {}, false, false, kind)));
            answered.merge(names_in(head_of(
                parsed("HTTP/1.1 200 OK\r\nContent-Length: 1\r\n" + field + "\r\n", false, false, kind))));
        }
        auto own = std::set<std::string>{"connection"};
        if (kind != UpstreamKind::simulation)
            own.insert("x-forwarded-for");
        BOOST_TEST(asked == allowed(core::passed_request_headers, kind, own),
                   boost::test_tools::per_element());
        BOOST_TEST(answered == allowed(core::passed_answer_headers, kind, {"connection", "content-length"}),
                   boost::test_tools::per_element());
    }
}

BOOST_AUTO_TEST_CASE(interim_answers_are_skipped)
{
    std::string const text = "HTTP/1.1 103 Early Hints\r\nLink: x\r\n\r\nHTTP/1.1 100 Continue\r\n\r\n"
                             "HTTP/1.1 200 OK\r\nContent-Length: 1\r\n\r\n!";
    auto const response = parsed(text);
    BOOST_TEST(Head(head_of(response)) == answers("HTTP/1.1 200 OK", {"Content-Length: 1"}));
    BOOST_TEST(text.substr(response.head_size()) == "!");
}

BOOST_AUTO_TEST_CASE(an_answer_may_come_byte_by_byte)
{
    std::string const text =
        "HTTP/1.1 103 Early Hints\r\n\r\nHTTP/1.1 200 OK\r\nContent-Length: 1\r\nX: y\r\n\r\n";
    ForwardedResponse response(UpstreamKind::simulation, false, false);
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
          "HTTP/1.1 200 OK\r\nTransfer-Encoding: gzip\r\n\r\n",
          "HTTP/1.1 200 OK\r\nX: a\x01"
          "b\r\n\r\n"}) {
        ForwardedResponse response(UpstreamKind::simulation, false, false);
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
        ForwardedResponse response(UpstreamKind::simulation, false, false);
        return response.parse(text);
    };
    BOOST_TEST((verdict(adapters::max_response_head, "\r\n\r\n") == Progress::complete));
    BOOST_TEST((verdict(adapters::max_response_head, "") == Progress::need_more));
    BOOST_TEST((verdict(adapters::max_response_head + 1, "\r\n\r\n") == Progress::malformed));
    BOOST_TEST((verdict(adapters::max_response_head + 1, "") == Progress::malformed));
}

BOOST_AUTO_TEST_SUITE_END()
