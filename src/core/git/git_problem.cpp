#include "git_problem.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"
#include "git_pkt_line.hpp"

namespace webots_cloud::core {
namespace {

class GitProblemCategory final : public boost::system::error_category
{
public:
    char const* name() const noexcept override { return "git"; }
    std::string message(int problem) const override
    {
        return make_error_code(public_code(static_cast<GitProblem>(problem))).message();
    }
};

boost::system::error_category const& git_problem_category() noexcept
{
    static GitProblemCategory const category;
    return category;
}

GitProblem classify(std::string_view words) noexcept
{
    auto const says = [&](std::string_view part) { return words.find(part) != std::string_view::npos; };
    if (says("not our ref") || (says("want ") && says(" not valid")))
        return GitProblem::object_not_advertised;
    return says("filter") ? GitProblem::filter_not_supported : GitProblem::server_error;
}

std::string_view without_full_stop(std::string_view words) noexcept
{
    return words.substr(0, words.find_last_not_of('.') + 1);
}

} // namespace

boost::system::error_code make_error_code(GitProblem problem) noexcept
{
    return {static_cast<int>(problem), git_problem_category()};
}

std::optional<GitProblem> git_problem(Failure const& failure) noexcept
{
    if (failure.code().category() != git_problem_category())
        return std::nullopt;
    return static_cast<GitProblem>(failure.code().value());
}

bool operator==(Failure const& failure, GitProblem problem) noexcept
{
    return failure.code() == make_error_code(problem);
}

errc public_code(GitProblem problem) noexcept
{
    switch (problem) {
    case GitProblem::no_such_repository:
    case GitProblem::no_such_ref:
    case GitProblem::no_such_commit:
    case GitProblem::no_such_folder:
    case GitProblem::not_a_commit:
        return errc::not_found;
    case GitProblem::unknown_format:
        return errc::refused;
    case GitProblem::unreachable:
        return errc::unreachable;
    case GitProblem::timed_out:
        return errc::timed_out;
    case GitProblem::too_many_refs:
    case GitProblem::answer_too_large:
        return errc::too_large;
    case GitProblem::malformed:
    case GitProblem::server_error:
    case GitProblem::object_not_advertised:
    case GitProblem::filter_not_supported:
    case GitProblem::no_single_files:
    case GitProblem::object_missing:
        break;
    }
    return errc::protocol_error;
}

bool fails_as(Failure const& failure, errc code) noexcept
{
    auto const problem = git_problem(failure);
    return problem ? public_code(*problem) == code : failure == code;
}

Failure git_server_error(std::string_view words)
{
    constexpr std::size_t max_words = 200;
    auto const said = printable(git_server_words(words), max_words);
    return {classify(said), concat("the git server says: ", said)};
}

Failure explain(Failure const& failure, ProjectRef const& project)
{
    auto const problem = git_problem(failure);
    if (!problem)
        return failure;
    auto const code = make_error_code(public_code(*problem));
    auto const repository = concat(project.owner, "/", project.repository);
    auto const message = failure.message();
    auto const words = without_full_stop(message);
    switch (*problem) {
    case GitProblem::no_such_repository:
        return refused(Refused::no_repository, {{"name", repository}});
    case GitProblem::object_not_advertised:
    case GitProblem::no_such_commit:
        return refused(Refused::no_commit, {{"name", repository}});
    case GitProblem::no_such_ref:
        return refused(Refused::no_ref, {{"name", repository}, {"ref", failure.detail()}});
    case GitProblem::no_such_folder:
        return refused(Refused::no_folder, {{"name", repository}, {"folder", failure.detail()}});
    case GitProblem::not_a_commit:
        return refused(Refused::not_a_commit, {{"name", repository}, {"ref", failure.detail()}});
    case GitProblem::too_many_refs:
        return refused(Refused::too_many_refs, {{"name", repository}});
    case GitProblem::unknown_format:
        return refused(Refused::sha256_repository, {{"name", repository}});
    case GitProblem::unreachable:
    case GitProblem::timed_out:
        return refused(code, Refused::site_unreachable, {{"site", project.forge}, {"why", words}});
    default:
        return refused(code, Refused::site_fault, {{"site", project.forge}, {"why", words}});
    }
}

std::string explain_use_of_cache(Failure const& failure, ProjectRef const& project)
{
    return concat(project.forge, " can't be reached: ", without_full_stop(failure.message()), ". Starting ",
                  project.owner, "/", project.repository, " from the cache.");
}

} // namespace webots_cloud::core
