// The address of a world on a forge (a server or a plain folder), taken apart.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/forge_kind.hpp>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// The address with which links to worlds of a forge begin, and what follows there.
struct ForgeAddress
{
    ForgeAddress() = default;
    ForgeAddress(std::string base, ForgeKind kind = ForgeKind::unknown)
        : url(std::move(base)), kind(kind == ForgeKind::unknown ? kind_of_forge(url) : kind)
    {}
    ForgeAddress(char const* base) : ForgeAddress(std::string(base)) {}

    std::string url; ///< Without a slash at the end: `https://github.com`.
    ForgeKind kind = ForgeKind::unknown;
};

/// A world in a folder of a repository, as
/// `<forge>/<owner>/<repository>/blob/<ref>/[<folder>/]worlds/<file>.wbt` and other links say.
struct ProjectRef
{
    ProjectRef() = default;

    std::string forge; ///< Base URL as the operator configured it, without a slash at the end.
    std::string owner; ///< On GitLab also a group and the groups in it: `<group>/<group>`.
    std::string repository;
    /// `<ref>[/<folder>]`, percent-decoded. Where the ref ends only the repository knows: refs may contain
    /// slashes.
    std::string ref_and_folder;
    std::string world; ///< `<file>.wbt`, in the project's folder `worlds`; empty: a folder is meant.

    /// What follows the first name in `ref_and_folder`, with the slash before it; empty: nothing. That is the
    /// folder wherever a ref is one name, as with `RefMeaning::none`.
    std::string_view folder_after_ref() const noexcept;

    /// `<forge>/<owner>/<repository>.git`
    std::string clone_url() const;

    /// `<forge>/<owner>/<repository>/blob/<ref>/[<folder>/]worlds/<file>.wbt`, decoded: the same of all links
    /// that name the world by one branch, tag or commit.
    std::string address() const;

    bool operator==(ProjectRef const&) const = default;
};

/// The one of `forges` that the URL of a world is on.
///
/// Errors: `invalid_url`, its detail being the text for the browser (protocol section 4.1.2, step 2).
result<ForgeAddress> forge_of(std::string_view url, std::vector<ForgeAddress> const& forges);

/// Takes the URL of a world apart.
///
/// Only links to `forges` are understood, in the forms that the forges' own pages have (docs/access.md).
/// Percent-encoding is decoded once; a query or fragment is ignored. Owner and repository are of the
/// characters that forges allow; the other parts are names that a file may have, in UTF-8, without control
/// characters and backslashes.
///
/// Errors: `invalid_url`, its detail being a text for the browser, where Python servers have one the same, or
/// that and what to do (protocol section 4.1.2, steps 2 and 5).
result<ProjectRef> parse_world_url(std::string_view url, std::vector<ForgeAddress> const& forges);

/// The same for the URL of a repository or of a folder in one, and of a file there that is no world, which
/// means its folder. The ref of a repository is `HEAD`.
///
/// Errors: as there.
result<ProjectRef> parse_folder_url(std::string_view url, std::vector<ForgeAddress> const& forges);

} // namespace webots_cloud
