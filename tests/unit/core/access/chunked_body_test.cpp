#include "unit_test.hpp"

#include "core/access/chunked_body.hpp"

#include <string>

using namespace webots_cloud;
using core::ChunkedBody;

BOOST_AUTO_TEST_SUITE(chunked_body)

namespace {

/// What is taken of a text that comes in pieces of this size.
std::string taken(std::string_view text, std::size_t piece, ChunkedBody& body)
{
    std::string all;
    while (!text.empty() && !body.is_over()) {
        auto const next = text.substr(0, piece);
        all.append(next.substr(0, body.take(next)));
        text.remove_prefix(next.size());
    }
    return all;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_body_ends_with_its_last_chunk_whatever_follows)
{
    std::string const body = "5;a=\"b\"\r\nhello\r\nA\r\n0123456789\r\n000\r\n";
    for (std::string const rest : {"\r\n", "X-Sum: 1\r\n\r\n", "\r\nHTTP/1.1 200 OK\r\n\r\n"}) {
        for (std::size_t piece = 1; piece < 60; ++piece) {
            ChunkedBody chunks;
            BOOST_TEST(taken(body + rest, piece, chunks) == body);
            BOOST_TEST(chunks.is_complete());
        }
    }
}

BOOST_AUTO_TEST_CASE(data_may_look_like_chunks)
{
    ChunkedBody chunks;
    std::string const body = "7\r\n0\r\n\r\n0\n\r\n0\r\n";
    BOOST_TEST(taken(body, 3, chunks) == body);
    BOOST_TEST(chunks.is_complete());
}

BOOST_AUTO_TEST_CASE(what_is_no_chunk_ends_the_body_there)
{
    for (std::string const text : {"x", "-1\r\n", "\r\n", "5\nhello", "5 \n", "fffffffffffffffff\r\n",
                                   "1\r\nab", "1\r\na\rb", "1\rb", ";a\r\n"}) {
        ChunkedBody chunks;
        taken(text, 1, chunks);
        BOOST_TEST(chunks.is_malformed(), text);
        BOOST_TEST(!chunks.is_complete());
    }
    ChunkedBody chunks;
    taken("1;" + std::string(1000, 'x'), 100, chunks);
    BOOST_TEST(chunks.is_malformed(), "an extension without an end");
}

BOOST_AUTO_TEST_CASE(a_body_that_breaks_off_is_not_complete)
{
    for (std::string const text : {"", "5", "5\r\n", "5\r\nhell", "5\r\nhello\r\n", "5\r\nhello\r\n0\r"}) {
        ChunkedBody chunks;
        BOOST_TEST(taken(text, 2, chunks) == text);
        BOOST_TEST(!chunks.is_over(), text);
    }
}

BOOST_AUTO_TEST_SUITE_END()
