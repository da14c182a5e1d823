// What can go wrong between us and a git server: typed where its answer is parsed, so that nothing later has
// to search sentences.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/project_ref.hpp>

#include <boost/system/error_code.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// As the code of a `Failure`, for `explain` to make a sentence of. Failures with other codes have theirs.
enum class GitProblem
{
    // The repository. The detail is what it lacks: the printable name of a ref or folder; or none.
    no_such_repository = 1, ///< Or a private one: forges do not tell.
    no_such_ref,
    no_such_commit,
    no_such_folder,
    not_a_commit,   ///< The ref points to something else.
    too_many_refs,  ///< That begin alike.
    unknown_format, ///< Object names are SHA-256.

    // The way to the server: what has happened, in words without a full stop.
    unreachable, ///< Or out of order: status 5xx.
    timed_out,
    answer_too_large, ///< Larger than the limit of a single answer.

    // The server's answer: as before.
    malformed,             ///< It is not git's protocol.
    server_error,          ///< The server reports one; the words are its own.
    object_not_advertised, ///< The same: it does not send an object that no ref points to.
    filter_not_supported,  ///< The same, about the option `filter`.
    no_single_files,       ///< It sends commits, but no files by name.
    object_missing         ///< The pack lacks an object.
};

boost::system::error_code make_error_code(GitProblem problem) noexcept;

/// The problem that a failure is about; nothing for failures with other codes.
std::optional<GitProblem> git_problem(Failure const& failure) noexcept;

bool operator==(Failure const& failure, GitProblem problem) noexcept;

/// What callers of the git source are told: `malformed` is a `protocol_error` to them.
errc public_code(GitProblem problem) noexcept;

/// True when a failure has the code, or is about a problem that has it.
bool fails_as(Failure const& failure, errc code) noexcept;

/// What a server reports in `words`, in a line `ERR` or in the error channel of a pack, as git and JGit say
/// it. The only place that searches such text.
Failure git_server_error(std::string_view words);

/// The same failure as a sentence for the person who asked for the project, with a public code.
Failure explain(Failure const& failure, ProjectRef const& project);

/// Why a project is started from the cache: the server could not be asked.
std::string explain_use_of_cache(Failure const& failure, ProjectRef const& project);

} // namespace webots_cloud::core

template<>
struct boost::system::is_error_code_enum<webots_cloud::core::GitProblem> : std::true_type
{};
