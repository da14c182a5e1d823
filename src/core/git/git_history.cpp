#include "git_history.hpp"

#include "git_tree.hpp"

#include <unordered_set>

namespace webots_cloud::core {

std::vector<GitObjectId> git_tips(std::vector<GitRef> const& refs)
{
    std::vector<GitObjectId> tips;
    std::unordered_set<GitObjectId, GitObjectIdHash> seen;
    for (auto const& ref : refs)
        if (is_branch_or_tag(ref.name) && seen.insert(ref.id).second)
            tips.push_back(ref.id);
    return tips;
}

bool is_in_git_history(GitObjectId const& commit, std::vector<GitObjectId> const& tips,
                       GitCommitLookup const& lookup)
{
    std::unordered_set<GitObjectId, GitObjectIdHash> seen(tips.begin(), tips.end());
    std::vector<GitObjectId> waiting(seen.begin(), seen.end());
    while (!waiting.empty() && seen.count(commit) == 0) {
        auto const* const object = lookup(waiting.back());
        waiting.pop_back();
        if (!object)
            continue;
        for (auto const& parent : parents_of_commit(*object))
            if (seen.insert(parent).second)
                waiting.push_back(parent);
    }
    return seen.count(commit) > 0;
}

} // namespace webots_cloud::core
