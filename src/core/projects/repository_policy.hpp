// Which projects may run here: the operator's lists, and the share of idle time for all others.
#pragma once

#include "outside_projects.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/project_ref.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The operator's rules (protocol section 4.1.2, step 3).
struct RepositoryPolicy
{
    RepositoryPolicy() = default;
    RepositoryPolicy(RepositoryRules repository_rules, OutsideProjects outside_projects)
        : rules(std::move(repository_rules)), outside(std::move(outside_projects))
    {}

    RepositoryRules rules;
    OutsideProjects outside; ///< Whether others than `rules.allowed` run here at all.
};

// A rule is a URL prefix, compared by segments, so `https://github.com/cyberbotics` does not cover
// `https://github.com/cyberbotics-evil`. Rule and world are normalised first: percent-encodings
// decoded, host in lower case and without its usual port, no empty and dot segments, no `.git` after the
// repository, no query and fragment; `blob`, `tree`, `src/branch` and the like are the same
// (core/forge_link). Of a world's `url` the parts are compared that `parse_world_url` finds, since they are
// what is fetched.
//
// `blocks` has to know every way to name a ref that a source understands: one that it does not know is a way
// around "blockedRepositories". A source that accepts more than `refs/heads/x`, `refs/tags/x`, `HEAD` and
// hashes needs a `RefMeaning` of its own.

/// What the rules have to know of the forge of a world. The address of the forge says nothing about its kind:
/// a plain folder may have one with `https:`.
struct ForgeOfWorld
{
    ForgeOfWorld(std::string_view url, RefMeaning refs) : ForgeOfWorld(url, refs, kind_of_forge(url)) {}
    ForgeOfWorld(std::string_view url, RefMeaning refs, ForgeKind kind) : url(url), refs(refs), kind(kind) {}

    std::string_view url; ///< What `forge_of` found: the owner's name follows that address.
    RefMeaning refs;
    ForgeKind kind;
};

/// True when `rule` certainly names the world or something that contains it. Owner and repository are
/// compared without case only on forges that are known to ignore it.
bool allows(std::string_view rule, std::string_view url, ForgeOfWorld const& forge);

/// True when `rule` possibly names the world or something that contains it: owner and repository without
/// case, whatever the scheme, `refs/heads/x` and `refs/tags/x` as `x`. A commit that is asked for by its
/// hash, and `HEAD`, may be on any branch: a rule with a branch blocks them, and a rule with a hash every
/// branch.
bool blocks(std::string_view rule, std::string_view url, ForgeOfWorld const& forge);

/// True when a rule could be about worlds of this forge.
bool is_on_forge(std::string_view rule, std::string_view forge);

/// A repository's name without `.git`, in whatever case, at its end.
std::string_view without_dot_git(std::string_view name) noexcept;

/// Why a world of this forge must not run at this load, or nothing when it may.
/// `may_start` in service/simulations/start_rules asks before anything is fetched.
std::optional<Failure> refusal(RepositoryPolicy const& policy, std::string_view url,
                               ForgeOfWorld const& forge, double load);

} // namespace webots_cloud::core
