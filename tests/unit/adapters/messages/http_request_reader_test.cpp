#include "unit_test.hpp"

#include "adapters/messages/http_request_reader.hpp"
#include "adapters/messages/websocket_handshake.hpp"

#include <algorithm>
#include <string>

using namespace webots_cloud;
using adapters::HttpRequestReader;

BOOST_AUTO_TEST_SUITE(http_request_reader)

using Progress = HttpRequestReader::Progress;

namespace {

void feed(HttpRequestReader& reader, std::string_view bytes)
{
    while (!bytes.empty()) {
        auto const space = reader.prepare();
        auto const size = std::min(space.size(), bytes.size());
        std::copy_n(bytes.begin(), size, space.begin());
        reader.commit(size);
        bytes.remove_prefix(size);
    }
}

/// 0 for a complete, valid request; -1 when more input is needed; otherwise the status of the refusal.
int verdict(std::string_view bytes)
{
    HttpRequestReader reader;
    feed(reader, bytes);
    auto const progress = reader.parse();
    return progress == Progress::complete ? 0 : progress != Progress::refused ? -1 : reader.refusal();
}

int verdict_of_field(std::string const& field)
{
    return verdict("GET / HTTP/1.1\r\nHost: h\r\n" + field + "\r\n\r\n");
}

std::string with_line(std::size_t length)
{
    std::string const start = "GET /";
    std::string const end = " HTTP/1.1";
    return start + std::string(length - start.size() - end.size(), 'x') + end + "\r\nHost: h\r\n\r\n";
}

std::string with_header(std::size_t length)
{
    std::string const host = "Host: h\r\n";
    std::string const name = "X: ";
    return "GET / HTTP/1.1\r\n" + host + name + std::string(length - host.size() - name.size() - 2, 'x') +
           "\r\n\r\n";
}

} // namespace

BOOST_AUTO_TEST_CASE(a_request_is_taken_apart)
{
    HttpRequestReader reader;
    feed(reader,
         "GET /session?url=https://a/b?c HTTP/1.1\r\nHost: a:1\r\nX-Empty:\r\nX-Blanks: \t b c \t\r\n\r\n");
    BOOST_TEST_REQUIRE((reader.parse() == Progress::complete));
    auto const& request = reader.request();
    BOOST_TEST(request.method == "GET");
    BOOST_TEST(request.path == "/session");
    BOOST_TEST(request.query == "url=https://a/b?c");
    BOOST_TEST(request.header("host") == "a:1");
    BOOST_TEST(request.header("X-Empty") == "");
    BOOST_TEST(request.header("x-blanks") == "b c");
    BOOST_TEST(request.headers.size() == 3u);
    BOOST_TEST(reader.keep_alive());
    BOOST_TEST(reader.rest() == "");
}

BOOST_AUTO_TEST_CASE(bytes_may_come_one_by_one)
{
    HttpRequestReader reader;
    std::string const text = "\r\nGET /a HTTP/1.1\r\nHost: h\r\nA: " + std::string(9000, 'x') + "\r\n\r\n";
    for (std::size_t i = 0; i + 1 < text.size(); ++i) {
        feed(reader, text.substr(i, 1));
        BOOST_TEST_REQUIRE((reader.parse() == Progress::need_more), i);
    }
    feed(reader, "\n");
    BOOST_TEST_REQUIRE((reader.parse() == Progress::complete));
    BOOST_TEST(reader.request().path == "/a");
    BOOST_TEST(reader.request().header("A").size() == 9000u);
}

BOOST_AUTO_TEST_CASE(every_cut_of_two_pipelined_requests_gives_both)
{
    std::string const text = "GET /1 HTTP/1.1\r\nHost: h\r\n\r\nGET /2?q HTTP/1.0\r\n\r\n";
    for (std::size_t cut = 0; cut <= text.size(); ++cut) {
        HttpRequestReader reader;
        std::vector<std::string> paths;
        auto const take = [&] {
            while (reader.parse() == Progress::complete) {
                paths.emplace_back(reader.request().path);
                reader.next();
            }
        };
        feed(reader, text.substr(0, cut));
        take();
        feed(reader, text.substr(cut));
        take();
        BOOST_TEST((paths == std::vector<std::string>{"/1", "/2"}), cut);
        BOOST_TEST(!reader.has_begun(), cut);
    }
}

BOOST_AUTO_TEST_CASE(many_requests_of_one_connection_are_read_in_order)
{
    HttpRequestReader reader;
    for (int i = 0; i < 5000; ++i) {
        feed(reader, "GET /" + std::to_string(i) + " HTTP/1.1\r\nHost: h\r\n\r\n");
        BOOST_TEST_REQUIRE((reader.parse() == Progress::complete));
        BOOST_TEST_REQUIRE(reader.request().path == "/" + std::to_string(i));
        reader.next();
    }
}

BOOST_AUTO_TEST_CASE(the_version_and_the_connection_field_decide_whether_the_connection_stays)
{
    auto const stays = [](std::string const& version, std::string const& fields) {
        HttpRequestReader reader;
        feed(reader, "GET / HTTP/" + version + "\r\nHost: h\r\n" + fields + "\r\n");
        BOOST_TEST_REQUIRE((reader.parse() == Progress::complete));
        return reader.keep_alive();
    };
    BOOST_TEST(stays("1.1", ""));
    BOOST_TEST(!stays("1.1", "Connection: close\r\n"));
    BOOST_TEST(!stays("1.1", "Connection: Upgrade, CLOSE\r\n"));
    BOOST_TEST(!stays("1.0", ""));
    BOOST_TEST(stays("1.0", "connection: Keep-Alive\r\n"));
    BOOST_TEST(!stays("1.0", "Connection: close\r\n"));
}

BOOST_AUTO_TEST_CASE(options_may_be_asked_of_no_path)
{
    HttpRequestReader reader;
    feed(reader, "OPTIONS * HTTP/1.0\r\n\r\n");
    BOOST_TEST((reader.parse() == Progress::complete));
    BOOST_TEST(reader.request().path == "*");
    BOOST_TEST(verdict("OPTIONS ** HTTP/1.0\r\n\r\n") == 400);
    BOOST_TEST(verdict("options * HTTP/1.0\r\n\r\n") == 400);
}

BOOST_AUTO_TEST_CASE(absolute_targets_are_those_of_their_path)
{
    auto const target = [](std::string const& text) {
        HttpRequestReader reader;
        feed(reader, "GET " + text + " HTTP/1.1\r\nHost: h\r\n\r\n");
        BOOST_TEST_REQUIRE((reader.parse() == Progress::complete), text);
        return std::string(reader.request().path) + " " + std::string(reader.request().query);
    };
    BOOST_TEST(target("http://a.b:80/session?x") == "/session x");
    BOOST_TEST(target("HTTPS://a") == "/ ");
    BOOST_TEST(target("http://a?x=/") == "/ x=/");
    BOOST_TEST(target("//a") == "//a ");
    for (auto const* bad : {"a", "*", "a:80", "ftp://a/", "http:///x", "http://", "?x"})
        BOOST_TEST(verdict("GET " + std::string(bad) + " HTTP/1.1\r\nHost: h\r\n\r\n") == 400, bad);
}

BOOST_AUTO_TEST_CASE(request_lines_end_at_8_kib_and_headers_at_16)
{
    BOOST_TEST(verdict(with_line(8192)) == 0);
    BOOST_TEST(verdict(with_line(8193)) == 414);
    BOOST_TEST(verdict("GET /" + std::string(8192, 'x')) == 414);
    BOOST_TEST(verdict("GET /" + std::string(8000, 'x')) == -1);
    BOOST_TEST(verdict(with_header(16384)) == 0);
    BOOST_TEST(verdict(with_header(16385)) == 431);
    auto endless = with_header(17000);
    endless.resize(endless.size() - 4);
    BOOST_TEST(verdict(endless) == 431);
    std::string many;
    for (int i = 0; i < 99; ++i)
        many += "A: b\r\n";
    BOOST_TEST(verdict("GET / HTTP/1.1\r\nHost: h\r\n" + many + "\r\n") == 0);
    BOOST_TEST(verdict("GET / HTTP/1.1\r\nHost: h\r\n" + many + "A: b\r\n\r\n") == 431);
}

BOOST_AUTO_TEST_CASE(bodies_of_unknown_length_are_refused_however_they_are_announced)
{
    BOOST_TEST(verdict_of_field("Content-Length: 0") == 0);
    BOOST_TEST(verdict_of_field("Content-Length: 000") == 0);
    BOOST_TEST(verdict_of_field("Content-Length: 1") == -1, "who reads it decides");
    BOOST_TEST(verdict_of_field("content-length: 18446744073709551615") == 413);
    BOOST_TEST(verdict_of_field("Content-Length: 1, 1") == 413);
    BOOST_TEST(verdict_of_field("Transfer-Encoding: chunked") == 413);
    BOOST_TEST(verdict_of_field("Transfer-Encoding: identity") == 413);
    for (auto const* bad : {"", "-1", "+1", "1a", "0x0", "1, 2", "99999999999999999999999999",
                            "0\r\nContent-Length: 5", "0\r\nTransfer-Encoding: chunked"})
        BOOST_TEST(verdict_of_field("Content-Length: " + std::string(bad)) == 400, bad);
}

BOOST_AUTO_TEST_CASE(long_methods_are_refused_however_much_of_the_request_has_come)
{
    std::string const rest = " / HTTP/1.1\r\nHost: h\r\n\r\n";
    BOOST_TEST(verdict(std::string(32, 'X') + rest) == 0);
    BOOST_TEST(verdict(std::string(33, 'X')) == 400);
    BOOST_TEST(verdict(std::string(33, 'X') + rest) == 400);
}

BOOST_AUTO_TEST_CASE(garbage_is_refused_at_once)
{
    BOOST_TEST(verdict("\x16\x03\x01\x02") == 400); // a TLS client hello
    BOOST_TEST(verdict(std::string_view("\0", 1)) == 400);
    BOOST_TEST(verdict(" GET / HTTP/1.1\r\n") == 400);
    BOOST_TEST(verdict(std::string(100, 'A')) == 400);
    BOOST_TEST(verdict("GET") == -1);
    for (auto const* bad : {"GET /", "GET / HTTP/1", "GET  / HTTP/1.1", "GET / HTTP/1.1 ",
                            "GET /a b HTTP/1.1", "GET / http/1.1", "GET / HTTP/1.x", "G(T / HTTP/1.1",
                            "GET /\x7f HTTP/1.1", "GET /\x01 HTTP/1.1", "GET / HTTP/11"})
        BOOST_TEST(verdict(std::string(bad) + "\r\nHost: h\r\n\r\n") == 400, bad);
    BOOST_TEST(verdict("GET / HTTP/1.1\nHost: h\n\n") == 400);
    BOOST_TEST(verdict("GET / HTTP/2.0\r\nHost: h\r\n\r\n") == 505);
    BOOST_TEST(verdict("PRI * HTTP/2.0\r\n\r\n") == 505);
    BOOST_TEST(verdict("GET / HTTP/1.7\r\nHost: h\r\n\r\n") == 505); // no such version
}

BOOST_AUTO_TEST_CASE(fields_that_proxies_may_read_differently_are_refused)
{
    for (auto const* bad :
         {"A : b", " A: b", "\tfolded", ": b", "A", "A(: b", "A: b\x01", "A: b\rc", "A: b\nc", "Host: other",
          "A: b\r\n c", "A: b\r\n\t", "A:\r\n b", "A:\r\n \r\n b", "A:\r\n ", "A: b\r\n \r\nC: d"})
        BOOST_TEST(verdict_of_field(bad) == 400, bad);
    BOOST_TEST(verdict("GET / HTTP/1.1\r\n\r\n") == 400);
    BOOST_TEST(verdict("GET / HTTP/1.0\r\n\r\n") == 0);
    BOOST_TEST(verdict_of_field("A: b\tc \xc3\xa4") == 0);
}

BOOST_AUTO_TEST_CASE(websocket_handshakes_are_judged)
{
    auto const judge = [](std::string const& start, std::string const& fields) {
        HttpRequestReader reader;
        feed(reader, start + "\r\nHost: h\r\n" + fields + "\r\n");
        BOOST_TEST_REQUIRE((reader.parse() == Progress::complete), fields);
        if (!adapters::wants_websocket(reader))
            return -1;
        auto const refusal = adapters::refuse_handshake(reader);
        return refusal ? refusal->status : 0;
    };
    std::string const key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    std::string const version = "Sec-WebSocket-Version: 13\r\n";
    std::string const upgrade = "Upgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n";
    BOOST_TEST(judge("GET / HTTP/1.1", upgrade + key + version) == 0);
    BOOST_TEST(
        judge("GET / HTTP/1.1", "Upgrade: h2c, WebSocket\r\nConnection: upgrade\r\n" + key + version) == 0);
    BOOST_TEST(judge("GET / HTTP/1.1", "Upgrade: websocket\r\n" + key + version) == 400);
    BOOST_TEST(judge("GET / HTTP/1.1", upgrade + version) == 400);
    BOOST_TEST(judge("GET / HTTP/1.1", upgrade + version + "Sec-WebSocket-Key: short==\r\n") == 400);
    BOOST_TEST(judge("GET / HTTP/1.1", upgrade + key) == 426);
    BOOST_TEST(judge("GET / HTTP/1.1", upgrade + key + "Sec-WebSocket-Version: 8\r\n") == 426);
    BOOST_TEST(judge("GET / HTTP/1.1", "Connection: upgrade\r\n") == -1); // as proxies send it for everything
    BOOST_TEST(judge("GET / HTTP/1.1", "Upgrade: h2c\r\nConnection: upgrade\r\n") == -1);
    BOOST_TEST(judge("POST / HTTP/1.1", upgrade + key + version) == -1);
    BOOST_TEST(judge("GET / HTTP/1.0", upgrade + key + version) == -1);
}

BOOST_AUTO_TEST_CASE(the_key_is_answered_as_the_standard_says)
{
    std::string out;
    adapters::append_handshake_answer(out, "dGhlIHNhbXBsZSBub25jZQ==");
    BOOST_TEST(out.find("\r\nSec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n") != std::string::npos);
    BOOST_TEST(out.starts_with("HTTP/1.1 101 "));
    BOOST_TEST(out.ends_with("\r\n\r\n"));
}

BOOST_AUTO_TEST_SUITE_END()
