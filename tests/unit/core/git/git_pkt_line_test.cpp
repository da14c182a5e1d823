// The frames of git's protocol.
#include "unit_test.hpp"

#include "core/git/git_pkt_line.hpp"
#include "core/text.hpp"

#include <string>
#include <vector>

using namespace webots_cloud;
using core::PktLine;
using core::PktLineDecoder;

BOOST_AUTO_TEST_SUITE(git_pkt_line)

namespace {

/// The frames of a stream that arrives in pieces of `piece` bytes: payloads in brackets, other kinds as their
/// number.
std::string frames(std::string_view stream, std::size_t piece)
{
    PktLineDecoder decoder;
    std::string text;
    for (std::size_t i = 0; i < stream.size(); i += piece) {
        decoder.push(stream.substr(i, piece));
        for (;;) {
            auto const line = decoder.next();
            if (!line)
                return text + "error";
            if (!*line)
                break;
            auto const& frame = **line;
            text += frame.kind == PktLine::Kind::data ? core::concat("[", frame.payload, "]")
                                                      : std::to_string(static_cast<int>(frame.kind));
        }
    }
    return decoder.at_boundary() ? text : text + "...";
}

} // namespace

BOOST_AUTO_TEST_CASE(a_frame_begins_with_its_length_in_hexadecimal_digits)
{
    BOOST_TEST(core::pkt_line("a\n") == "0006a\n");
    BOOST_TEST(core::pkt_line("") == "0004");
    BOOST_TEST(core::pkt_line(std::string(65516, 'x')).substr(0, 4) == "fff0");
}

BOOST_AUTO_TEST_CASE(frames_are_found_however_the_stream_is_cut)
{
    auto const stream =
        core::pkt_line("version 2\n") + "0001" + core::pkt_line("") + "0000" + "0002" + core::pkt_line("x");
    for (std::size_t piece = 1; piece <= stream.size(); ++piece)
        BOOST_TEST(frames(stream, piece) == "[version 2\n]2[]13[x]");
}

BOOST_AUTO_TEST_CASE(a_frame_that_is_not_complete_is_waited_for)
{
    BOOST_TEST(frames("0006a", 1) == "...");
    BOOST_TEST(frames("00", 1) == "...");
}

BOOST_AUTO_TEST_CASE(what_is_no_length_is_an_error)
{
    for (auto const* const stream : {"0003", "zzzz", "-001", "+004", " 004", "fff1", "ffff", "<htm", "0x04"})
        BOOST_TEST(frames(stream, 4) == "error", stream);
}

BOOST_AUTO_TEST_CASE(the_text_of_a_frame_has_no_newline_at_its_end)
{
    PktLine line;
    line.payload = "abc\n";
    BOOST_TEST(line.text() == "abc");
    line.payload = "abc";
    BOOST_TEST(line.text() == "abc");
}

BOOST_AUTO_TEST_CASE(the_words_of_a_server_end_before_its_newlines_and_zero_bytes)
{
    using namespace std::string_view_literals;
    BOOST_TEST(core::git_server_words("upload-pack: not our ref.\n\0"sv) == "upload-pack: not our ref.");
    BOOST_TEST(core::git_server_words("\0 out of\0order\0\n\0"sv) == "out of\0order"sv);
    BOOST_TEST(core::git_server_words("\0\n"sv) == "");
    BOOST_TEST(core::git_server_words("") == "");
}

BOOST_AUTO_TEST_SUITE_END()
