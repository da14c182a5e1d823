// Whether a commit belongs to a repository. A server sends every object in its store, and forges keep
// commits of other people (forks, pull requests) in the same store.
#pragma once

#include "git_object_id.hpp"
#include "git_refs.hpp"

#include <functional>
#include <string>
#include <vector>

namespace webots_cloud::core {

/// The commits that branches and tags point to, each once: what people with write access have accepted.
std::vector<GitObjectId> git_tips(std::vector<GitRef> const& refs);

/// Finds a commit object; null when it is not there.
using GitCommitLookup = std::function<std::string const*(GitObjectId const&)>;

/// True when `commit` is one of `tips` or an ancestor of one, by way of commits that `lookup` finds.
bool is_in_git_history(GitObjectId const& commit, std::vector<GitObjectId> const& tips,
                       GitCommitLookup const& lookup);

} // namespace webots_cloud::core
