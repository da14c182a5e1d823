// The transport between libgit2 and the server, which rewrites what passes, and its pipe.
#include "unit_test.hpp"

#include "adapters/git/git2_transport.hpp"
#include "adapters/git/git_pipe.hpp"
#include "core/git/git_problem.hpp"

#include <boost/asio/error.hpp>

#include <string>
#include <thread>

BOOST_AUTO_TEST_SUITE(git2_transport)

namespace {

using namespace webots_cloud;
using namespace webots_cloud::adapters;

std::string const commit(40, 'a');
std::string const shallow = "0035shallow " + commit + "\n";

/// The same answer, in pieces of `size` bytes.
result<std::string> passed(std::string const& answer, std::size_t size)
{
    GitAnswerStart start;
    std::string all;
    for (std::size_t at = 0; at < answer.size(); at += size) {
        auto const piece = start.push(std::string_view(answer).substr(at, size));
        if (!piece)
            return piece.error();
        all += *piece;
    }
    return all;
}

} // namespace

BOOST_AUTO_TEST_CASE(depth_is_asked_for_after_what_is_wanted)
{
    auto const want = "0032want " + commit + "\n";
    BOOST_TEST(make_shallow(want + "00000009done\n").value() == want + "000ddeepen 1\n00000009done\n");
}

BOOST_AUTO_TEST_CASE(a_request_that_does_not_end_is_none)
{
    for (auto const* request : {"", "0032want", "zzzz", "0003", "0005x"})
        BOOST_CHECK(make_shallow(request).error() == core::GitProblem::malformed);
}

BOOST_AUTO_TEST_CASE(the_answer_about_depth_is_taken_off_however_it_is_cut)
{
    std::string const rest = "0008NAK\n0000 and shallow bytes of all sorts";
    for (std::size_t size = 1; size < 130; ++size) {
        BOOST_TEST(passed(shallow + shallow + "0000" + rest, size).value() == rest);
        BOOST_TEST(passed(rest, size).value() == rest);
    }
}

BOOST_AUTO_TEST_CASE(the_words_of_a_server_that_refuses_are_kept)
{
    auto const refused = passed("000eERR enough", 3);
    BOOST_REQUIRE(refused.has_error());
    BOOST_TEST(refused.error().message() == "the git server says: enough");
}

BOOST_AUTO_TEST_CASE(an_answer_without_frames_is_refused)
{
    BOOST_CHECK(passed("<html>", 6).error() == core::GitProblem::malformed);
    BOOST_CHECK(passed("0002", 4).error() == core::GitProblem::malformed);
}

BOOST_AUTO_TEST_CASE(a_pipe_hands_on_more_than_it_has_room_for)
{
    GitPipe pipe;
    std::string const piece(300'000, 'x');
    constexpr int pieces = 20;
    std::thread writer([&] {
        for (int i = 0; i < pieces; ++i)
            if (!pipe.write(piece))
                break;
        pipe.end({});
    });
    std::size_t total = 0;
    std::string buffer(65'536, '\0');
    while (auto const count = pipe.read(buffer.data(), buffer.size()).value())
        total += count;
    writer.join();
    BOOST_TEST(total == piece.size() * pieces);
}

BOOST_AUTO_TEST_CASE(a_pipe_gives_its_bytes_before_its_failure)
{
    GitPipe pipe;
    BOOST_REQUIRE(pipe.write("abc").has_value());
    pipe.end(Failure(errc::timed_out, "late"));
    char buffer[8];
    BOOST_TEST(pipe.read(buffer, sizeof buffer).value() == 3U);
    BOOST_CHECK(pipe.read(buffer, sizeof buffer).error() == errc::timed_out);
}

BOOST_AUTO_TEST_CASE(a_writer_whose_reader_left_stops)
{
    GitPipe pipe;
    std::thread writer([&] {
        auto outcome = pipe.write("x");
        while (outcome)
            outcome = pipe.write(std::string(500'000, 'x'));
        BOOST_CHECK(outcome.error() == Failure(boost::asio::error::operation_aborted));
    });
    pipe.leave();
    writer.join();
}

BOOST_AUTO_TEST_SUITE_END()
