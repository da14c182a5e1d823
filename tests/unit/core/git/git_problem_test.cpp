// What git servers say, typed; and what the person who asked for a project is told of it.
#include "unit_test.hpp"

#include "core/git/git_problem.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::string_literals;

BOOST_AUTO_TEST_SUITE(git_problem_kinds)

namespace {

ProjectRef project()
{
    ProjectRef made;
    made.forge = "https://forge.example";
    made.owner = "ann";
    made.repository = "robots";
    return made;
}

} // namespace

BOOST_AUTO_TEST_CASE(the_errors_of_git_and_jgit_are_told_apart)
{
    struct Row
    {
        std::string_view words;
        GitProblem problem;
    };
    Row const rows[] = {
        {"upload-pack: not our ref 1234", GitProblem::object_not_advertised},
        {"want 1234 not valid", GitProblem::object_not_advertised},
        {"not our ref, with a filter", GitProblem::object_not_advertised},
        {"unexpected line: 'filter blob:none'", GitProblem::filter_not_supported},
        {"filter 'tree:0' not supported", GitProblem::filter_not_supported},
        {"a valid ref is what I want", GitProblem::server_error},
        {"access denied or repository not exported", GitProblem::server_error},
        {"", GitProblem::server_error},
    };
    for (auto const& row : rows) {
        auto const failure = git_server_error(row.words);
        BOOST_TEST((failure == row.problem), row.words);
        BOOST_TEST((failure.detail() == "the git server says: " + std::string(row.words)), row.words);
        BOOST_TEST(fails_as(failure, errc::protocol_error), row.words);
    }
}

BOOST_AUTO_TEST_CASE(what_a_server_says_is_made_printable_and_short)
{
    BOOST_TEST(git_server_error(" no\x1b[2J\n\0"s).detail() == "the git server says: no\\x1b[2J");
    BOOST_TEST(git_server_error(std::string(100'000, 'x')).detail().size() < 300u);
}

BOOST_AUTO_TEST_CASE(every_problem_becomes_a_sentence_with_a_public_code)
{
    struct Row
    {
        Failure failure;
        errc code;
        std::string_view sentence;
    };
    Row const rows[] = {
        {Failure(GitProblem::no_such_repository), errc::not_found,
         "Repository ann/robots does not exist or is private."},
        {{GitProblem::no_such_ref, "x"},
         errc::not_found,
         "Repository ann/robots has no branch or tag \"x\"."},
        {Failure(GitProblem::no_such_commit), errc::not_found, "Repository ann/robots has no such commit."},
        {{GitProblem::no_such_folder, "a"}, errc::not_found, "Repository ann/robots has no folder \"a\"."},
        {{GitProblem::not_a_commit, "v1"},
         errc::not_found,
         "Repository ann/robots has no commit at \"v1\", but something else."},
        {Failure(GitProblem::too_many_refs), errc::too_large,
         "Repository ann/robots has too many branches that begin alike."},
        {Failure(GitProblem::unknown_format), errc::refused,
         "Repository ann/robots has SHA-256 object names, which are not supported."},
        {{GitProblem::unreachable, "Could not resolve host: forge.example."},
         errc::unreachable,
         "https://forge.example can't be reached: Could not resolve host: forge.example. Try again later."},
        {{GitProblem::timed_out, "the git server took too long"},
         errc::timed_out,
         "https://forge.example can't be reached: the git server took too long. Try again later."},
        {{GitProblem::answer_too_large, "the answer is larger than 8 MB"},
         errc::too_large,
         "https://forge.example: the answer is larger than 8 MB."},
        {{GitProblem::malformed, "the git server sent a malformed delta"},
         errc::protocol_error,
         "https://forge.example: the git server sent a malformed delta."},
        {git_server_error("not our ref 12"), errc::not_found, "Repository ann/robots has no such commit."},
        {git_server_error("no filter, sorry."), errc::protocol_error,
         "https://forge.example: the git server says: no filter, sorry."},
        {git_server_error("Go away."), errc::protocol_error,
         "https://forge.example: the git server says: Go away."},
        {{GitProblem::no_single_files, "no files"}, errc::protocol_error, "https://forge.example: no files."},
        {{GitProblem::object_missing, "the git server left out a file"},
         errc::protocol_error,
         "https://forge.example: the git server left out a file."},
    };
    for (auto const& row : rows) {
        auto const explained = explain(row.failure, project());
        BOOST_TEST((explained == row.code), row.sentence);
        BOOST_TEST(explained.detail() == row.sentence);
    }
}

BOOST_AUTO_TEST_CASE(failures_without_a_problem_have_sentences_already)
{
    Failure const failure(errc::too_large, "The project is larger than 1 MB.");
    BOOST_TEST(!git_problem(failure).has_value());
    BOOST_TEST((explain(failure, project()) == errc::too_large));
    BOOST_TEST(explain(failure, project()).detail() == failure.detail());
    BOOST_TEST(fails_as(failure, errc::too_large));
    BOOST_TEST(!fails_as(failure, errc::protocol_error));
}

BOOST_AUTO_TEST_CASE(a_start_from_the_cache_names_its_reason)
{
    BOOST_TEST(explain_use_of_cache({GitProblem::unreachable, "no route"}, project()) ==
               "https://forge.example can't be reached: no route. Starting ann/robots from the cache.");
}

BOOST_AUTO_TEST_SUITE_END()
