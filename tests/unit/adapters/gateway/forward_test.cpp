#include "unit_test.hpp"

#include "forward_fixture.hpp"

#include <boost/asio/local/stream_protocol.hpp>

#include <cstring>
#include <filesystem>
#include <unistd.h>
#include <vector>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(forward)

BOOST_AUTO_TEST_CASE(a_websocket_becomes_a_tunnel_and_what_came_early_is_not_lost)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward("/there?x=1");
    Client browser(server);
    browser.ask_upgrade("/forward", "Origin: https://o\r\nX-Forwarded-For: 203.0.113.7\r\n");
    browser.say("early");
    auto upstream = other.accept();
    BOOST_TEST(upstream.read_request() ==
               "GET /there?x=1 HTTP/1.1\r\nHost: h\r\nOrigin: https://o\r\nSec-WebSocket-Version: 13\r\n"
               "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nX-Forwarded-For: 203.0.113.7, 127.0.0.1\r\n"
               "Upgrade: websocket\r\nConnection: Upgrade\r\n\r\n");
    upstream.say(std::string(accepted) + "greeting");
    BOOST_TEST(browser.read_to("\r\n\r\n") ==
               "HTTP/1.1 101 Switching Protocols\r\nSec-WebSocket-Accept: x\r\nUpgrade: websocket\r\n"
               "Connection: Upgrade\r\n\r\n");
    BOOST_TEST(browser.read(8) == "greeting");
    BOOST_TEST(upstream.read(5) == "early");
    browser.say("question");
    BOOST_TEST(upstream.read(8) == "question");
    upstream.say("answer");
    BOOST_TEST(browser.read(6) == "answer");
    BOOST_TEST(server.statistics().tunnels == 1u);
    BOOST_TEST(server.statistics().connections == 1u);
    upstream.close();
    BOOST_TEST(browser.read_all() == "");
}

// Protocol section 13.12: the pictures of a simulator that sends them by HTTP alone.
BOOST_AUTO_TEST_CASE(a_stream_is_sent_on_in_messages_until_the_browser_says_something)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward("/mjpeg");
    server.endpoint.forward->in_messages = true;
    Client browser(server);
    browser.ask_upgrade("/forward", "Origin: https://o\r\n");
    auto upstream = other.accept();
    BOOST_TEST(upstream.read_request() ==
               "GET /mjpeg HTTP/1.1\r\nHost: h\r\nOrigin: https://o\r\nX-Forwarded-For: 127.0.0.1\r\n"
               "Connection: close\r\n\r\n");
    upstream.say("HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=b\r\nSet-Cookie: "
                 "a=b\r\n\r\nfirst");
    BOOST_TEST(browser.read_to("\r\n\r\n") ==
               "HTTP/1.1 101 Switching Protocols\r\nServer: webots_cloud\r\nUpgrade: websocket\r\n"
               "Connection: Upgrade\r\nSec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n\r\n");
    BOOST_TEST(browser.read(7) == "\x82\x05"
                                  "first");
    auto const more = much(300);
    upstream.say(more);
    BOOST_TEST((browser.read(4 + more.size()) == std::string("\x82\x7e\x01\x2c") + more));
    browser.say(std::string("\x88\x80\0\0\0\0", 6)); // a close frame
    BOOST_TEST(browser.read_all() == std::string("\x88\x02\x03\xe8"));
    browser.shut_down();
    BOOST_TEST(upstream.read_all() == "");
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 0));
}

BOOST_AUTO_TEST_CASE(a_browser_that_takes_messages_slowly_gets_all_of_them_whole)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward("/mjpeg");
    server.endpoint.forward->in_messages = true;
    Client browser(server);
    browser.ask_upgrade("/forward", "");
    auto upstream = other.accept();
    upstream.read_request();
    auto const body = much(20'000'000);
    std::thread writer([&] {
        upstream.say("HTTP/1.1 200 OK\r\n\r\n");
        upstream.say(body);
        upstream.close();
    });
    browser.read_to("\r\n\r\n");
    auto const frames = browser.read_all(); // begins when the writer is far ahead
    writer.join();
    std::string got;
    std::size_t at = 0;
    auto const byte = [&](std::size_t i) {
        return static_cast<std::size_t>(static_cast<unsigned char>(frames.at(i)));
    };
    while (byte(at) == 0x82) {
        auto size = byte(at + 1);
        at += 2;
        if (size >= 126) {
            auto const digits = size == 126 ? 2U : 8U;
            size = 0;
            for (auto i = 0U; i < digits; ++i)
                size = size << 8 | byte(at++);
        }
        got += frames.substr(at, size);
        at += size;
    }
    BOOST_TEST((got == body));
    BOOST_TEST(frames.substr(at) == std::string("\x88\x02\x03\xe8"));
}

BOOST_AUTO_TEST_CASE(what_is_no_stream_is_not_sent_on_in_messages)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward("/mjpeg");
    server.endpoint.forward->in_messages = true;
    for (auto const* answer :
         {"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", "HTTP/1.1 204 No Content\r\n\r\n",
          "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\n\r\n",
          "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n1\r\na\r\n"}) {
        Client browser(server);
        browser.ask_upgrade("/forward", "");
        auto upstream = other.accept();
        upstream.read_request();
        upstream.say(answer);
        BOOST_TEST(browser.read_to("\r\n").starts_with("HTTP/1.1 502 "));
    }
}

BOOST_AUTO_TEST_CASE(who_has_said_all_may_go_on_listening)
{
    RunningServer server;
    OtherServer other;
    OpenTunnel tunnel(server, other);
    tunnel.browser.say("last words");
    tunnel.browser.shut_down();
    BOOST_TEST(tunnel.upstream.read_all() == "last words");
    tunnel.upstream.say("still here");
    BOOST_TEST(tunnel.browser.read(10) == "still here");
    tunnel.upstream.shut_down();
    BOOST_TEST(tunnel.browser.read_all() == "");
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 0));
}

BOOST_AUTO_TEST_CASE(an_answer_leaves_the_connection_open_for_the_next_request)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward();
    Client browser(server);
    browser.say(forwarded_request + forwarded_request + "GET /own HTTP/1.1\r\nHost: h\r\n\r\n");
    for (auto const* body : {"first", "second"}) {
        auto upstream = other.accept();
        BOOST_TEST(upstream.read_request() ==
                   "GET /there HTTP/1.1\r\nHost: h\r\nX-Forwarded-For: 127.0.0.1\r\n"
                   "Connection: close\r\n\r\n");
        upstream.say(answer(body));
        upstream.close();
    }
    BOOST_TEST(browser.read_to("first") ==
               "HTTP/1.1 200 OK\r\nContent-Length: 5\r\nConnection: keep-alive\r\n\r\nfirst");
    BOOST_TEST(browser.read_to("second").ends_with("\r\n\r\nsecond"));
    BOOST_TEST(browser.read_to("/own").ends_with("\r\n\r\n/own"));
    BOOST_TEST(server.statistics().forwarded == 2u);
}

BOOST_AUTO_TEST_CASE(a_large_answer_is_relayed_and_the_connection_used_again)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward();
    Client browser(server);
    auto const body = much(5'000'000);
    for (int i = 0; i < 2; ++i) {
        browser.say(forwarded_request +
                    "GET /own HTTP/1.1\r\nHost: h\r\n\r\n"); // the second is not the other server's
        auto upstream = other.accept();
        upstream.read_request();
        std::thread writer([&] { upstream.say(answer(body)); });
        browser.read_to("\r\n\r\n");
        BOOST_TEST((browser.read(body.size()) == body));
        writer.join();
        BOOST_TEST(upstream.read_all() == "");
        BOOST_TEST(browser.read_to("/own").ends_with("\r\n\r\n/own"));
    }
    BOOST_TEST(server.statistics().tunnels == 0u);
    BOOST_TEST(server.statistics().connections == 1u);
    BOOST_TEST(server.statistics().tunnel_bytes_sent > 2 * body.size());
}

BOOST_AUTO_TEST_CASE(an_answer_that_breaks_off_ends_the_connection)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward();
    Client browser(server);
    browser.say(forwarded_request);
    auto upstream = other.accept();
    upstream.read_request();
    upstream.say("HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\nhalf");
    BOOST_TEST(browser.read_to("half").ends_with("half"));
    upstream.close();
    BOOST_TEST(browser.read_all() == "");
}

BOOST_AUTO_TEST_CASE(an_endless_answer_ends_with_the_other_servers_connection)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward();
    Client browser(server);
    browser.say(forwarded_request + "GET /never HTTP/1.1\r\nHost: h\r\n\r\n");
    auto upstream = other.accept();
    upstream.read_request();
    upstream.say("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n");
    BOOST_TEST(browser.read_to("hello\r\n") ==
               "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\nConnection: close\r\n\r\n5\r\nhello\r\n");
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 1));
    upstream.say("0\r\n\r\n");
    upstream.shut_down();
    BOOST_TEST(browser.read_all() == "0\r\n\r\n");
    browser.shut_down();
    BOOST_TEST(upstream.read_all() == "", "what the browser said meanwhile was no part of it");
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 0));
}

BOOST_AUTO_TEST_CASE(nothing_follows_the_last_chunk_of_an_answer)
{
    std::string const head = "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n";
    std::string const rest = "0\r\nX-Sum: 1\r\n\r\nHTTP/1.1 200 OK\r\nContent-Length: 4\r\n\r\nevil";
    for (std::string const first : {"5\r\nhello\r\n", ""}) { // what arrives before the tunnel has begun
        RunningServer server;
        OtherServer other;
        server.endpoint.forward = other.forward();
        Client browser(server);
        browser.say(forwarded_request);
        auto upstream = other.accept();
        upstream.read_request();
        upstream.say(first.empty() ? head + rest : head + first);
        if (!first.empty()) {
            BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 1));
            upstream.say(rest);
        }
        auto const got = browser.read_all(); // though the other server keeps its connection
        BOOST_TEST(got == "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\nConnection: close\r\n\r\n" +
                              first + "0\r\n\r\n");
        browser.shut_down();
        BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 0));
    }
}

BOOST_AUTO_TEST_CASE(what_is_no_chunk_ends_the_answer_there)
{
    for (bool const hangs_up : {false, true}) {
        RunningServer server;
        OtherServer other;
        server.endpoint.forward = other.forward();
        Client browser(server);
        browser.say(forwarded_request);
        auto upstream = other.accept();
        upstream.read_request();
        upstream.say("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n");
        BOOST_TEST(browser.read_to("hello\r\n").ends_with("hello\r\n"));
        BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 1));
        upstream.say("no chunk"); // read by itself, as all before it has been relayed
        if (hangs_up)
            upstream.close();
        BOOST_TEST(browser.read_all() == "");
        browser.shut_down();
        BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 0));
    }
}

BOOST_AUTO_TEST_CASE(head_and_not_modified_are_answered_without_a_body)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward();
    Client browser(server);
    browser.say("HEAD /forward HTTP/1.1\r\nHost: h\r\n\r\n" + forwarded_request);
    for (auto const* head : {"HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\n",
                             "HTTP/1.1 304 Not Modified\r\nContent-Length: 5\r\n\r\n"}) {
        auto upstream = other.accept();
        upstream.read_request();
        upstream.say(head);
        BOOST_TEST(
            browser.read_to("\r\n\r\n").ends_with("Content-Length: 5\r\nConnection: keep-alive\r\n\r\n"));
    }
    browser.say("GET /own HTTP/1.0\r\n\r\n");
    BOOST_TEST(browser.read_all().ends_with("/own"));
}

BOOST_AUTO_TEST_CASE(a_handshake_that_the_other_server_refuses_is_an_answer_like_others)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward();
    Client browser(server);
    browser.ask_upgrade("/forward", {});
    {
        auto upstream = other.accept();
        upstream.read_request();
        upstream.say("HTTP/1.1 403 Forbidden\r\nContent-Length: 2\r\n\r\nno");
        BOOST_TEST(browser.read_to("no").starts_with("HTTP/1.1 403 Forbidden\r\n"));
    }
    browser.say("GET /own HTTP/1.0\r\n\r\n");
    BOOST_TEST(browser.read_all().ends_with("/own"));
}

BOOST_AUTO_TEST_CASE(a_server_that_is_not_there_is_a_bad_gateway)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward();
    other.close();
    Client browser(server);
    browser.say(forwarded_request + "GET /own HTTP/1.0\r\n\r\n");
    auto const answers = browser.read_all();
    BOOST_TEST(answers.starts_with("HTTP/1.1 502 Bad Gateway\r\n"), answers);
    BOOST_TEST(answers.find("can't be reached. Please try again in a moment.") != std::string::npos, answers);
    BOOST_TEST(answers.ends_with("/own"));
    BOOST_TEST(answers.find("dressed") == std::string::npos);
    BOOST_TEST(server.statistics().bad_gateways == 1u);
    Client person(server);
    person.say("GET /forward HTTP/1.1\r\nHost: h\r\nAccept: text/html\r\nConnection: close\r\n\r\n");
    auto const page = person.read_all();
    BOOST_TEST(page.starts_with("HTTP/1.1 502 Bad Gateway\r\n"), page);
    BOOST_TEST(page.find("\r\n\r\ndressed: ") != std::string::npos, page);
}

BOOST_AUTO_TEST_CASE(an_answer_that_makes_no_sense_is_a_bad_gateway)
{
    RunningServer server;
    OtherServer other;
    server.endpoint.forward = other.forward();
    Client browser(server);
    std::string const endless = "HTTP/1.1 200 OK\r\nX: " + std::string(100'000, 'x');
    for (std::string const& nonsense : {std::string("SSH-2.0-OpenSSH\r\n\r\n"), std::string(), endless}) {
        browser.say(forwarded_request);
        auto upstream = other.accept();
        upstream.read_request();
        upstream.say(nonsense);
        upstream.shut_down();
        BOOST_TEST(browser.read_to("moment.\r\n").starts_with("HTTP/1.1 502 "));
    }
    BOOST_TEST(server.statistics().bad_gateways == 3u);
}

BOOST_AUTO_TEST_CASE(a_server_that_does_not_answer_in_time_is_given_up)
{
    HttpServerParams params;
    params.answer_timeout = std::chrono::seconds(1);
    RunningServer server(params);
    OtherServer other;
    server.endpoint.forward = other.forward();
    Client browser(server);
    browser.say(forwarded_request);
    auto upstream = other.accept();
    upstream.read_request();
    upstream.say("HTTP/1.1 200 OK\r\n");
    BOOST_TEST(browser.read_to("moment.\r\n").starts_with("HTTP/1.1 504 Gateway Timeout\r\n"));
    BOOST_TEST(upstream.read_all() == "");
    BOOST_TEST(server.statistics().late_gateways == 1u);
    browser.say("GET /own HTTP/1.0\r\n\r\n");
    BOOST_TEST(browser.read_all().ends_with("/own"));
}

BOOST_AUTO_TEST_CASE(a_broker_hands_out_connections)
{
    namespace local = boost::asio::local;
    auto const path = std::filesystem::temp_directory_path() /
                      ("webots_cloud_broker_" + std::to_string(::getpid()) + ".sock");
    std::filesystem::remove(path);
    boost::asio::io_context context;
    local::stream_protocol::acceptor broker(context, local::stream_protocol::endpoint(path.string()));
    RunningServer server;
    Forward forward;
    forward.upstream.broker = path;
    forward.target = "/there";
    server.endpoint.forward = forward;
    Client browser(server);
    browser.say(forwarded_request);
    {
        auto asked = broker.accept();
        int ends[2];
        BOOST_TEST_REQUIRE(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0);
        char byte = 0;
        iovec part{&byte, 1};
        alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))]{};
        msghdr message{};
        message.msg_iov = &part;
        message.msg_iovlen = 1;
        message.msg_control = control;
        message.msg_controllen = sizeof control;
        auto* const header = CMSG_FIRSTHDR(&message);
        header->cmsg_level = SOL_SOCKET;
        header->cmsg_type = SCM_RIGHTS;
        header->cmsg_len = CMSG_LEN(sizeof(int));
        std::memcpy(CMSG_DATA(header), &ends[0], sizeof(int));
        BOOST_TEST_REQUIRE(::sendmsg(asked.native_handle(), &message, 0) == 1);
        ::close(ends[0]);
        std::array<char, 4096> head{};
        BOOST_TEST(::read(ends[1], head.data(), head.size()) > 0);
        auto const text = answer("handed out");
        BOOST_TEST(::write(ends[1], text.data(), text.size()) == static_cast<ssize_t>(text.size()));
        BOOST_TEST(browser.read_to("handed out").starts_with("HTTP/1.1 200 OK\r\n"));
        ::close(ends[1]);
    }
    browser.say(forwarded_request);
    broker.accept().close(); // it can't reach the server
    BOOST_TEST(browser.read_to("moment.\r\n").starts_with("HTTP/1.1 502 "));
    broker.close();
    browser.say(forwarded_request);
    BOOST_TEST(browser.read_to("moment.\r\n").starts_with("HTTP/1.1 502 "));
    std::filesystem::remove(path);
}

BOOST_AUTO_TEST_CASE(a_group_counts_its_tunnels_and_ends_them)
{
    RunningServer server;
    OtherServer other;
    auto const group = std::make_shared<TunnelGroup>();
    auto forward = other.forward();
    forward.group = group;
    server.endpoint.forward = forward;
    OpenTunnel first(server, other);
    OpenTunnel second(server, other);
    first.browser.say("12345");
    BOOST_TEST(first.upstream.read(5) == "12345");
    Client asking(server);
    asking.say(forwarded_request);
    auto upstream = other.accept();
    upstream.read_request();
    server.run([&] {
        BOOST_TEST(group->open() == 3u);
        BOOST_TEST(group->received() > 5u);
        BOOST_TEST(group->sent() > 0u);
        group->close();
        BOOST_TEST(group->open() == 0u);
    });
    BOOST_TEST(first.browser.read_all() == "");
    BOOST_TEST(second.upstream.read_all() == "");
    BOOST_TEST(asking.read_to("start again.\r\n").starts_with("HTTP/1.1 502 "));
    BOOST_TEST(server.eventually_counts(&HttpServerStatistics::tunnels, 0));
    Client late(server);
    late.say(forwarded_request);
    BOOST_TEST(late.read_to("start again.\r\n").starts_with("HTTP/1.1 502 "));
}

BOOST_AUTO_TEST_SUITE_END()
