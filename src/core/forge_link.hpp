// Links to files and folders of repositories, as people copy them from the pages of GitHub, GitLab, Gitea,
// Forgejo and Bitbucket: which part is the repository, and where the ref begins. Where the ref ends only the
// repository knows. Nothing is decoded or checked here: that do `parse_world_url`, the rules of operators
// (core/projects/repository_policy) and the keys of worlds (core/load/world_key), which agree in this way.
#pragma once

#include <webots_cloud/forge_kind.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The kind with this name; `unknown`: there is none.
ForgeKind forge_kind(std::string_view name) noexcept;

/// Views of what is there, in a link.
enum class LinkView
{
    file,  ///< `blob`, `raw`: of one file.
    folder ///< `tree`, `src`: of a folder, or of a file as well.
};

/// The same in all spellings: `<names>/blob/<ref_space><rest>`.
struct ForgeLink
{
    std::string_view names;     ///< `<owner>/<repository>`, on GitLab `<group>/.../<repository>`.
    std::string_view ref_space; ///< `refs/tags/` in a link that says that its ref is a tag; else empty.
    std::string_view rest;      ///< `<ref>/<path>`; empty: the link ends before them.
    LinkView view = LinkView::file;
};

/// Takes apart what follows the address of a forge and a slash. Nothing: it leads to no file or folder of a
/// repository.
std::optional<ForgeLink> forge_link(std::string_view path, ForgeKind kind) noexcept;

/// `url` in two parts, `<site>/<path>`. A page of the same forge at another host, as
/// `raw.githubusercontent.com` is GitHub's, is written as if it were at the usual one.
struct PlacedLink
{
    std::string_view site; ///< `https://github.com`, `local:`
    std::string_view path;
    bool lacks_view = false; ///< The path is `<owner>/<repository>/<ref>/...`.
};

PlacedLink placed_link(std::string_view url) noexcept;

/// The same of a whole link to a forge that is not known: its names begin with what follows the host.
std::optional<ForgeLink> forge_link(PlacedLink const& link) noexcept;

/// The link at the usual host of its forge.
std::string usual_address(std::string_view url);

} // namespace webots_cloud::core
