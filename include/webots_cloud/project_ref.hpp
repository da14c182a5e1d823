// The address of a world on a forge (a git server or a plain folder), taken apart.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What a source makes of the `<ref>` in the address of a world. "blockedRepositories" has to know it: what a
/// rule names by one ref must not run under another.
enum class RefMeaning
{
    git,    ///< A branch, a tag or a commit of git.
    none,   ///< Nothing: the project is the same whatever the ref is, as in a plain folder.
    unknown ///< A rule that names a ref blocks the whole repository.
};

/// A world in a folder of a repository, as
/// `<forge>/<owner>/<repository>/(blob|tree)/<ref>/[<folder>/]worlds/<file>.wbt` says.
struct ProjectRef
{
    ProjectRef() = default;

    std::string forge; ///< Base URL as the operator configured it, without a slash at the end.
    std::string owner;
    std::string repository;
    /// `<ref>[/<folder>]`, percent-decoded. Where the ref ends only the repository knows: refs may contain
    /// slashes.
    std::string ref_and_folder;
    std::string world; ///< `<file>.wbt`, in the project's folder `worlds`.

    /// `<forge>/<owner>/<repository>.git`
    std::string clone_url() const;

    bool operator==(ProjectRef const&) const = default;
};

/// The one of `forges` that the URL of a world is on.
///
/// Errors: `invalid_url`, its detail being the text for the browser (protocol section 4.1.2, step 2).
result<std::string> forge_of(std::string_view url, std::vector<std::string> const& forges);

/// Takes the URL of a world apart.
///
/// `forges` are base URLs such as `https://github.com`; only those are understood. Percent-encoding is
/// decoded once; a query or fragment is ignored. Owner and repository are of the characters that forges
/// allow; the other parts are names that a file may have, in UTF-8, without control characters and
/// backslashes.
///
/// Errors: `invalid_url`, its detail being the text that browsers have always been shown (protocol section
/// 4.1.2, steps 2 and 5).
result<ProjectRef> parse_world_url(std::string_view url, std::vector<std::string> const& forges);

} // namespace webots_cloud
