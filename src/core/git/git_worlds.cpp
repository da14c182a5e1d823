#include "git_worlds.hpp"

#include "core/safe_names.hpp"
#include "core/text.hpp"
#include "git_problem.hpp"
#include "git_tree.hpp"

#include <algorithm>
#include <utility>

namespace webots_cloud::core {
namespace {

using Kind = GitTreeEntry::Kind;

constexpr std::string_view worlds_folder = "worlds";

result<std::vector<GitTreeEntry>> entries_of(GitObjectId const& tree, GitTreeLookup const& lookup)
{
    auto const* const object = lookup(tree);
    if (!object)
        return Failure(GitProblem::object_missing, "the git server left out a folder");
    return parse_git_tree(*object);
}

bool is_world_name(std::string_view name)
{
    constexpr std::string_view extension = ".wbt";
    return name.size() > extension.size() && name.ends_with(extension);
}

std::string_view last_name(std::string_view path)
{
    return path.substr(path.rfind('/') + 1); // npos + 1 is 0
}

/// Collects the worlds below a folder, up to limits: beyond these it ends without an error, as a list that is
/// not whole is better than none.
class WorldsOfTree
{
public:
    WorldsOfTree(GitWorldLimits const& limits, GitTreeLookup const& lookup) : limits_(limits), lookup_(lookup)
    {}

    /// One level down per call: the limit of the depth also keeps the stack small.
    result<> search(GitObjectId const& tree, std::string const& path, std::size_t depth)
    {
        auto const entries = entries_of(tree, lookup_);
        if (!entries)
            return entries.error();
        // All at once, before their own folders are read: what was read of those above is still in memory.
        seen_ += entries->size();
        if (seen_ > limits_.entries)
            return {};
        bool const has_worlds = last_name(path) == worlds_folder;
        for (auto const& entry : *entries) {
            if (seen_ > limits_.entries || worlds.size() == limits_.worlds)
                return {};
            if (!is_safe_file_name(entry.name))
                continue;
            auto const inner = path.empty() ? entry.name : concat(path, "/", entry.name);
            bool const is_file = entry.kind == Kind::file || entry.kind == Kind::executable;
            if (is_file && has_worlds && is_world_name(entry.name))
                worlds.push_back({inner, entry.id});
            if (entry.kind != Kind::folder || depth == limits_.depth)
                continue;
            if (auto const searched = search(entry.id, inner, depth + 1); !searched)
                return searched;
        }
        return {};
    }

    std::vector<GitWorldFile> worlds;

private:
    GitWorldLimits limits_;
    GitTreeLookup const& lookup_;
    std::size_t seen_ = 0;
};

} // namespace

result<std::vector<GitWorldFile>> find_git_worlds(GitObjectId const& root, std::string_view path,
                                                  GitWorldLimits const& limits, GitTreeLookup const& lookup)
{
    auto tree = root;
    for (auto const part : path.empty() ? std::vector<std::string_view>() : split(path, '/')) {
        auto const entries = entries_of(tree, lookup);
        if (!entries)
            return entries.error();
        auto const found = std::ranges::find_if(*entries, [part](GitTreeEntry const& entry) {
            return entry.kind == Kind::folder && entry.name == part;
        });
        if (found == entries->end())
            return Failure(GitProblem::no_such_folder, printable(path, 200));
        tree = found->id;
    }
    WorldsOfTree search(limits, lookup);
    if (auto const searched = search.search(tree, std::string(path), 0); !searched)
        return searched.error();
    return std::move(search.worlds);
}

} // namespace webots_cloud::core
