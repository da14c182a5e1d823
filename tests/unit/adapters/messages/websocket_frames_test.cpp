#include "unit_test.hpp"

#include "adapters/messages/websocket_frames.hpp"

#include <string>
#include <vector>

using namespace webots_cloud;
using adapters::CloseCode;
using adapters::WebSocketEvent;
using adapters::WebSocketFrameReader;
using adapters::WebSocketSide;

BOOST_AUTO_TEST_SUITE(websocket_frames)

using Kind = WebSocketEvent::Kind;

namespace {

constexpr std::size_t limit = 64 * 1024;

/// A frame as a browser sends it. `first` holds the final bit and the opcode.
std::string frame(unsigned first, std::string payload)
{
    std::string const mask = "\x11\x22\x33\x44";
    std::string bytes(1, static_cast<char>(first));
    auto const size = payload.size();
    if (size < 126) {
        bytes.push_back(static_cast<char>(0x80 | size));
    } else if (size < 65536) {
        bytes.push_back(static_cast<char>(0x80 | 126));
        bytes.push_back(static_cast<char>(size >> 8));
        bytes.push_back(static_cast<char>(size & 0xff));
    } else {
        bytes.push_back(static_cast<char>(0x80 | 127));
        for (int shift = 56; shift >= 0; shift -= 8)
            bytes.push_back(static_cast<char>(size >> shift & 0xff));
    }
    for (std::size_t i = 0; i < size; ++i)
        payload[i] = static_cast<char>(payload[i] ^ mask[i % 4]);
    return bytes + mask + payload;
}

std::vector<WebSocketEvent> events(WebSocketFrameReader& reader, std::string_view bytes)
{
    std::vector<WebSocketEvent> found;
    while (!bytes.empty()) {
        auto event = reader.next(bytes);
        if (event.kind != Kind::need_more)
            found.push_back(event);
        if (event.kind == Kind::fault)
            break;
    }
    return found;
}

/// The close code of the only event, a protocol error; 0 for anything else.
unsigned fault(std::string const& bytes)
{
    WebSocketFrameReader reader(limit);
    auto const found = events(reader, bytes);
    return found.size() == 1 && found[0].kind == Kind::fault ? static_cast<unsigned>(found[0].code) : 0;
}

} // namespace

BOOST_AUTO_TEST_CASE(messages_of_every_length_form_are_read)
{
    for (std::size_t const size :
         {std::size_t{0}, std::size_t{125}, std::size_t{126}, std::size_t{65535}, limit}) {
        WebSocketFrameReader reader(limit);
        std::string const text(size, 'x');
        auto const found = events(reader, frame(0x81, text) + frame(0x82, "\xff"));
        BOOST_TEST_REQUIRE(found.size() == 2u, size);
        BOOST_TEST((found[0].kind == Kind::message));
        BOOST_TEST((found[0].payload == text), size);
        BOOST_TEST(found[1].payload == "\xff");
    }
}

BOOST_AUTO_TEST_CASE(bytes_may_come_one_by_one_and_pings_between_fragments)
{
    WebSocketFrameReader reader(limit);
    auto const bytes = frame(0x01, "gr\xc3") + frame(0x89, "p") + frame(0x00, "") + frame(0x8a, "") +
                       frame(0x80, "\xbc\xc3\x9f");
    std::vector<WebSocketEvent> found;
    for (char const byte : bytes)
        for (auto& event : events(reader, std::string_view(&byte, 1)))
            found.push_back(event);
    BOOST_TEST_REQUIRE(found.size() == 3u);
    BOOST_TEST((found[0].kind == Kind::ping));
    BOOST_TEST(found[0].payload == "p");
    BOOST_TEST((found[1].kind == Kind::pong));
    BOOST_TEST(found[2].payload == "gr\xc3\xbc\xc3\x9f");
}

BOOST_AUTO_TEST_CASE(what_one_side_writes_the_other_reads_and_its_own_does_not)
{
    for (auto const from : {WebSocketSide::client, WebSocketSide::server})
        for (std::size_t const size : {0, 125, 126, 65535, 65536}) {
            std::string const text(size, 'x');
            std::string bytes;
            adapters::append_text_frame(bytes, text, from);
            adapters::append_pong_frame(bytes, "p", from);
            adapters::append_close_frame(bytes, 1000, "why", from);
            WebSocketFrameReader reader(limit, from);
            auto const found = events(reader, bytes);
            BOOST_TEST_REQUIRE(found.size() == 3u, size);
            BOOST_TEST((found[0].payload == text), size);
            BOOST_TEST(found[1].payload == "p");
            BOOST_TEST(static_cast<unsigned>(found[2].code) == 1000u);
            bool const is_client = from == WebSocketSide::client;
            WebSocketFrameReader own(limit, is_client ? WebSocketSide::server : WebSocketSide::client);
            auto const refused = events(own, bytes);
            BOOST_TEST_REQUIRE(refused.size() == 1u);
            BOOST_TEST(static_cast<unsigned>(refused[0].code) == 1002u);
        }
}

BOOST_AUTO_TEST_CASE(what_breaks_the_protocol_is_1002)
{
    BOOST_TEST(fault(std::string("\x81\x01x", 3)) == 1002u); // not masked
    BOOST_TEST(fault(frame(0xc1, "x")) == 1002u);            // compressed, which was not agreed on
    BOOST_TEST(fault(frame(0x83, "x")) == 1002u);            // unknown opcodes
    BOOST_TEST(fault(frame(0x8b, "x")) == 1002u);
    BOOST_TEST(fault(frame(0x80, "x")) == 1002u); // continues nothing
    BOOST_TEST(fault(frame(0x01, "x") + frame(0x81, "x")) == 1002u);
    BOOST_TEST(fault(frame(0x09, "x")) == 1002u); // a ping in fragments
    BOOST_TEST(fault(frame(0x89, std::string(126, 'x'))) == 1002u);
    BOOST_TEST(fault(frame(0x88, "x")) == 1002u); // half a code
    for (auto const* code : {"\x03\xe7", "\x03\xec", "\x03\xed", "\x03\xee", "\x07\xd0", "\x13\x88"})
        BOOST_TEST(fault(frame(0x88, code)) == 1002u, code);
}

BOOST_AUTO_TEST_CASE(messages_over_the_limit_are_1009_before_they_are_sent_whole)
{
    auto const long_frame = frame(0x81, std::string(limit + 1, 'x'));
    BOOST_TEST(fault(long_frame.substr(0, 14)) == 1009u);
    BOOST_TEST(fault(frame(0x01, std::string(limit, 'x')) + frame(0x80, "x").substr(0, 6)) == 1009u);
    std::string const endless("\x81\xff\xff\xff\xff\xff\xff\xff\xff\xff....", 14);
    BOOST_TEST(fault(endless) == 1009u);
}

BOOST_AUTO_TEST_CASE(fragments_without_end_are_1009_even_when_they_are_empty)
{
    WebSocketFrameReader reader(limit);
    auto first = events(reader, frame(0x01, ""));
    for (int i = 0; i < 1'000'000; ++i) {
        auto const found = events(reader, frame(0x00, ""));
        if (found.empty())
            continue;
        BOOST_TEST(static_cast<unsigned>(found[0].code) == 1009u);
        return;
    }
    BOOST_ERROR("a million fragments were taken");
}

BOOST_AUTO_TEST_CASE(text_that_is_no_utf_8_is_1007)
{
    BOOST_TEST(fault(frame(0x81, "\xc3")) == 1007u);
    BOOST_TEST(fault(frame(0x81, "\xed\xa0\x80")) == 1007u);
    BOOST_TEST(fault(frame(0x01, "\xc3") + frame(0x80, "x")) == 1007u);
    BOOST_TEST(fault(frame(0x88, "\x03\xe8\xff")) == 1007u);
    BOOST_TEST(fault(frame(0x82, "\xc3")) == 0u);
}

BOOST_AUTO_TEST_CASE(a_browser_may_close_with_or_without_a_code)
{
    WebSocketFrameReader reader(limit);
    BOOST_TEST(static_cast<unsigned>(events(reader, frame(0x88, "")).at(0).code) == 0u);
    BOOST_TEST(static_cast<unsigned>(events(reader, frame(0x88, "\x03\xe8gone")).at(0).code) == 1000u);
    BOOST_TEST((events(reader, frame(0x88, "\x0b\xb8")).at(0).kind == Kind::close));
}

BOOST_AUTO_TEST_CASE(frames_of_the_server_are_whole_and_not_masked)
{
    std::string out;
    adapters::append_text_frame(out, "1");
    adapters::append_close_frame(out, 1001, "bye");
    adapters::append_close_frame(out, 0, "ignored");
    adapters::append_ping_frame(out);
    adapters::append_pong_frame(out, "p");
    BOOST_TEST(out == std::string("\x81\x01"
                                  "1\x88\x05\x03\xe9"
                                  "bye\x88\x00\x89\x00\x8a\x01p",
                                  17));
    out.clear();
    adapters::append_text_frame(out, std::string(65535, 'x'));
    BOOST_TEST(out.starts_with("\x81\x7e\xff\xffx"));
    out.clear();
    adapters::append_text_frame(out, std::string(65536, 'x'));
    BOOST_TEST(out.substr(0, 10) == std::string("\x81\x7f\0\0\0\0\0\1\0\0", 10));
    out.clear();
    adapters::append_close_frame(out, 1001, std::string(200, 'x'));
    BOOST_TEST(out.size() == 127u);
}

BOOST_AUTO_TEST_SUITE_END()
