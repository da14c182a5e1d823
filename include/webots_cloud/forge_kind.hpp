// What is known of forges before one of them is asked. A kind of forge is a value of ForgeKind and a row of
// `forge_kinds`. To add one to the library: docs/recipes.md ("Another source of projects").
#pragma once

#include <webots_cloud/export.hpp>

#include <array>
#include <string_view>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What a forge is: what links to its files look like (docs/access.md), and how its projects are got, unless
/// they are in a folder of this machine. Gitea is Forgejo too.
enum class ForgeKind
{
    unknown, ///< A git server; what its links look like is found out of each.
    github,
    gitlab,
    gitea,
    bitbucket
};

/// A name of a kind.
struct ForgeKindRow
{
    constexpr ForgeKindRow() = default;
    constexpr ForgeKindRow(std::string_view name, ForgeKind kind, std::string_view site)
        : name(name), kind(kind), site(site)
    {}

    std::string_view name; ///< As configurations have it: `kind` of a forge.
    ForgeKind kind = ForgeKind::unknown;
    std::string_view site; ///< Its address that everybody knows, whose kind need not be said; or empty.
};

inline constexpr std::array forge_kinds{
    ForgeKindRow("github", ForgeKind::github, "https://github.com"),
    ForgeKindRow("gitlab", ForgeKind::gitlab, "https://gitlab.com"),
    ForgeKindRow("gitea", ForgeKind::gitea, "https://gitea.com"),
    ForgeKindRow("forgejo", ForgeKind::gitea, "https://codeberg.org"),
    ForgeKindRow("bitbucket", ForgeKind::bitbucket, "https://bitbucket.org"),
};

/// Of the forges that everybody knows; `unknown` of others.
ForgeKind kind_of_forge(std::string_view url) noexcept;

/// What a source makes of the `<ref>` in the address of a world. `RepositoryRules::blocked` depends on it:
/// what a rule names by one ref must not run under another.
enum class RefMeaning
{
    git,    ///< A branch, a tag or a commit of git.
    none,   ///< Nothing: the project is the same whatever the ref is, as in a plain folder.
    unknown ///< A rule that names a ref blocks the whole repository.
};

} // namespace webots_cloud
