#include "unit_test.hpp"

#include "core/git/git_lfs_problem.hpp"

#include <boost/system/errc.hpp>

#include <vector>

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(git_lfs_problem)

namespace {

LfsProblems const problems{"owner/robots", "https://git.example.org"};

bool says(Failure const& failure, std::string_view words)
{
    return failure.message().find(words) != std::string::npos;
}

} // namespace

BOOST_AUTO_TEST_CASE(each_status_of_a_batch_says_who_can_help)
{
    struct Row
    {
        int status;
        errc code;
        std::string_view says;
    };
    std::vector<Row> const rows{{401, errc::refused, "must be public"},
                                {403, errc::refused, "must be public"},
                                {404, errc::not_found, "https://git.example.org has no LFS server"},
                                {501, errc::not_found, "https://git.example.org has no LFS server"},
                                {429, errc::unreachable, "try again later"},
                                {509, errc::refused, "quota is used up"},
                                {503, errc::unreachable, "Try again later"},
                                {302, errc::protocol_error, "out of order"}};
    for (auto const& row : rows) {
        auto const failure = problems.about_batch(row.status);
        BOOST_TEST((failure == row.code), row.status);
        BOOST_TEST(says(failure, row.says), failure.message());
        BOOST_TEST(says(failure, "owner/robots"), failure.message());
    }
}

BOOST_AUTO_TEST_CASE(a_file_that_is_not_there_is_its_authors_to_send)
{
    for (int const status : {0, 404, 410}) {
        auto const failure = problems.about_object("\"a.stl\"", status, "gone.");
        BOOST_TEST((failure == errc::not_found));
        BOOST_TEST(says(failure, "\"a.stl\" (it says: gone)"), failure.message());
        BOOST_TEST(says(failure, "git lfs push"), failure.message());
    }
    BOOST_TEST((problems.about_object("\"a.stl\"", 403, {}) == errc::refused));
    BOOST_TEST((problems.about_object("\"a.stl\"", 507, {}) == errc::refused));
    BOOST_TEST((problems.about_object("\"a.stl\"", 500, {}) == errc::unreachable));
    BOOST_TEST((problems.about_object("\"a.stl\"", 418, {}) == errc::protocol_error));
    BOOST_TEST((problems.about_content("\"a.stl\"") == errc::protocol_error));
    BOOST_TEST((problems.about_extension("\"a.stl\"") == errc::refused));
}

BOOST_AUTO_TEST_CASE(what_somebody_has_cancelled_is_not_explained)
{
    Failure const cancelled(make_error_code(boost::system::errc::operation_canceled));
    BOOST_TEST((problems.explain(cancelled).code() == cancelled.code()));
    BOOST_TEST(!says(problems.explain(cancelled), "owner/robots"));
    BOOST_TEST(says(problems.explain(Failure(errc::timed_out, "slow.")), "Try again later"));
    BOOST_TEST(
        says(problems.explain(Failure(errc::refused, "is at 10.0.0.1")), "Only hosts of the Internet"));
    BOOST_TEST(says(problems.explain(Failure(errc::protocol_error, "nonsense")), "out of order"));
}

BOOST_AUTO_TEST_SUITE_END()
