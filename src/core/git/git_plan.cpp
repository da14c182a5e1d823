#include "git_plan.hpp"

#include "core/text.hpp"
#include "git_names.hpp"

#include <algorithm>
#include <unordered_set>

namespace webots_cloud::core {
namespace {

using Kind = GitTreeEntry::Kind;

result<std::vector<GitTreeEntry>> read_tree(GitObjectId const& id, GitTreeLookup const& lookup)
{
    auto const* const object = lookup(id);
    if (!object)
        return Failure(errc::protocol_error, "the git server left out a folder");
    return parse_git_tree(*object);
}

/// Walks down one level per call, so that the depth is bounded by the limits and not by the stack.
class Planner
{
public:
    Planner(GitPlanLimits const& limits, GitTreeLookup const& lookup) : limits_(limits), lookup_(lookup) {}

    result<> add_folder(GitObjectId const& tree, std::string const& path, std::size_t depth)
    {
        if (depth > limits_.depth)
            return Failure(errc::too_large, "The project has folders that are nested too deeply.");
        auto const entries = read_tree(tree, lookup_);
        if (!entries)
            return entries.error();
        // Also what is left out: folders that hold nothing else may be shown again and again. All at once,
        // before their own folders are read: what was read of those above is still in memory.
        entries_ += entries->size();
        if (entries_ > limits_.items)
            return Failure(errc::too_large,
                           concat("The project has more than ", std::to_string(limits_.items), " files."));
        std::unordered_set<std::string_view> names;
        for (auto const& entry : *entries) {
            if (!is_safe_file_name(entry.name) || !names.insert(entry.name).second)
                return Failure(errc::protocol_error,
                               concat("The project has a file with a forbidden name: \"",
                                      printable(entry.name, 100), "\"."));
            if (entry.kind == Kind::submodule)
                continue;
            if (auto const added = add(entry, path, depth); !added)
                return added.error();
        }
        return {};
    }

    std::vector<GitPlanItem> items;

private:
    result<> add(GitTreeEntry const& entry, std::string const& path, std::size_t depth)
    {
        GitPlanItem item;
        item.kind = entry.kind;
        item.path = path.empty() ? entry.name : concat(path, "/", entry.name);
        item.id = entry.id;
        if (item.path.size() > limits_.path_length)
            return Failure(errc::too_large, "The project has a file whose path is too long.");
        path_bytes_ += item.path.size();
        if (path_bytes_ > limits_.path_bytes)
            return Failure(errc::too_large, "The project has too many files with long paths.");
        items.push_back(item);
        return entry.kind == Kind::folder ? add_folder(entry.id, item.path, depth + 1) : result<>();
    }

    GitPlanLimits limits_;
    std::size_t entries_ = 0;
    std::size_t path_bytes_ = 0;
    GitTreeLookup const& lookup_;
};

} // namespace

std::size_t GitPlanItem::depth() const noexcept
{
    return static_cast<std::size_t>(std::count(path.begin(), path.end(), '/'));
}

result<GitObjectId> find_git_folder(GitObjectId const& root, std::string_view path,
                                    GitTreeLookup const& lookup)
{
    auto tree = root;
    if (path.empty())
        return tree;
    for (auto const part : split(path, '/')) {
        auto const entries = read_tree(tree, lookup);
        if (!entries)
            return entries.error();
        auto const found = std::find_if(entries->begin(), entries->end(), [&](GitTreeEntry const& entry) {
            return entry.kind == Kind::folder && entry.name == part;
        });
        if (found == entries->end())
            return Failure(errc::not_found, concat("has no folder \"", printable(path, 200), "\""));
        tree = found->id;
    }
    return tree;
}

result<std::vector<GitPlanItem>> plan_git_folder(GitObjectId const& tree, GitPlanLimits const& limits,
                                                 GitTreeLookup const& lookup)
{
    Planner planner(limits, lookup);
    if (auto const added = planner.add_folder(tree, {}, 0); !added)
        return added.error();
    return std::move(planner.items);
}

} // namespace webots_cloud::core
