// Walks down to the wanted folder, and lists what becomes of each entry: names that are harmless, links that
// stay inside, files of the folders above within a limit. Nothing is written before all of it is known.
#include "git_layout.hpp"

#include "core/refusals.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"
#include "git_problem.hpp"

#include <algorithm>
#include <iterator>
#include <unordered_set>
#include <utility>

namespace webots_cloud::core {
namespace {

using Kind = GitTreeEntry::Kind;

result<std::vector<GitTreeEntry>> read_tree(std::string const* object)
{
    if (!object)
        return Failure(GitProblem::object_missing, "the git server left out a folder");
    return parse_git_tree(*object);
}

std::string inside(std::string const& folder, std::string_view name)
{
    return folder.empty() ? std::string(name) : concat(folder, "/", name);
}

/// The files and links in `entries`, the content of the folder at `path` in which the way goes on with
/// `next`. That name is the folder's, whatever else has it.
std::vector<GitLayoutItem> files_beside(std::string_view next, std::vector<GitTreeEntry> const& entries,
                                        GitWay& way, GitLayoutLimits const& limits)
{
    auto const& path = way.path;
    std::vector<GitLayoutItem> items;
    std::unordered_set<std::string_view> names{next};
    for (auto const& entry : entries) {
        if (items.size() > limits.parent_files)
            break;
        if (entry.kind == Kind::folder || entry.kind == Kind::submodule)
            continue;
        if (!is_harmless_file_name(entry.name)) {
            way.forbid(path, entry.name);
            continue;
        }
        if (path.size() + 1 + entry.name.size() > limits.path_length || !names.insert(entry.name).second)
            continue;
        GitLayoutItem item;
        item.kind = entry.kind;
        item.path = inside(path, entry.name);
        item.id = entry.id;
        item.of_parent = true;
        items.push_back(std::move(item));
    }
    return items;
}

/// Walks down one level per call: the limit of the depth also keeps the stack small.
class LayoutMaker
{
public:
    LayoutMaker(GitWay& way, GitLayoutLimits const& limits, GitTreeLookup const& lookup)
        : way_(way), limits_(limits), lookup_(lookup)
    {}

    result<> add_folder(GitObjectId const& tree, std::string const& path, std::size_t depth)
    {
        if (depth > limits_.depth)
            return refused(Refused::folders_too_deep);
        auto const entries = read_tree(lookup_(tree));
        if (!entries)
            return entries.error();
        // Also what is left out: folders that hold nothing else may be shown again and again. All at once,
        // before their own folders are read: what was read of those above is still in memory.
        entries_ += entries->size();
        if (entries_ > limits_.items)
            return refused(Refused::too_many_files, {{"max", std::to_string(limits_.items)}});
        std::unordered_set<std::string_view> names;
        for (auto const& entry : *entries) {
            if (!names.insert(entry.name).second)
                return refused(Refused::forbidden_name, {{"name", printable(entry.name, 100)}});
            if (entry.kind == Kind::submodule)
                continue;
            if (!is_harmless_file_name(entry.name)) {
                way_.forbid(path, entry.name);
                continue;
            }
            if (auto const added = add(entry, path, depth); !added)
                return added.error();
        }
        return {};
    }

    std::vector<GitLayoutItem> items;

    /// Of everything that was looked at.
    std::size_t entries() const noexcept { return entries_; }

private:
    result<> add(GitTreeEntry const& entry, std::string const& path, std::size_t depth)
    {
        GitLayoutItem item;
        item.kind = entry.kind;
        item.path = inside(path, entry.name);
        item.id = entry.id;
        if (item.path.size() > limits_.path_length)
            return refused(Refused::path_too_long);
        path_bytes_ += item.path.size();
        if (path_bytes_ > limits_.path_bytes)
            return refused(Refused::too_many_long_paths);
        items.push_back(item);
        return entry.kind == Kind::folder ? add_folder(entry.id, item.path, depth + 1) : result<>();
    }

    GitWay& way_;
    GitLayoutLimits limits_;
    std::size_t entries_ = 0;
    std::size_t path_bytes_ = 0;
    GitTreeLookup const& lookup_;
};

} // namespace

std::size_t GitLayoutItem::depth() const noexcept
{
    return static_cast<std::size_t>(std::count(path.begin(), path.end(), '/'));
}

void GitWay::leave_out_parent_files()
{
    left_out = std::erase_if(items, [](GitLayoutItem const& item) { return item.of_parent; }) > 0 || left_out;
}

void GitWay::forbid(std::string_view folder, std::string_view name)
{
    tell_forbidden(forbidden, inside(std::string(folder), name));
}

result<GitWay> find_git_folder(GitObjectId const& root, std::string_view path, GitLayoutLimits const& limits,
                               GitTreeLookup const& lookup)
{
    GitWay way;
    way.tree = root;
    if (path.empty())
        return way;
    std::size_t files = 0;
    for (auto const part : split(path, '/')) {
        auto const* const object = lookup(way.tree);
        auto const entries = read_tree(object);
        if (!entries)
            return entries.error();
        auto const found = std::find_if(entries->begin(), entries->end(), [&](GitTreeEntry const& entry) {
            return entry.kind == Kind::folder && entry.name == part;
        });
        if (found == entries->end())
            return Failure(GitProblem::no_such_folder, printable(path, 200));
        if (!is_safe_file_name(part))
            return refused(Refused::forbidden_folder, {{"name", printable(part, 60)}});
        // A folder as large as that is not even searched for files beside the way.
        if (object->size() <= limits.parent_bytes) {
            auto beside = files_beside(part, *entries, way, limits);
            files += beside.size();
            std::move(beside.begin(), beside.end(), std::back_inserter(way.items));
        } else {
            way.left_out = true;
        }
        // All of them or none, on whichever level they are.
        if (way.left_out || files > limits.parent_files)
            way.leave_out_parent_files();
        GitLayoutItem folder;
        folder.kind = Kind::folder;
        folder.path = inside(way.path, part);
        folder.id = found->id;
        way.path = folder.path;
        way.tree = found->id;
        way.items.push_back(std::move(folder));
    }
    return way;
}

result<std::vector<GitLayoutItem>> lay_out_git_folder(GitWay& way, GitLayoutLimits const& limits,
                                                      GitTreeLookup const& lookup)
{
    LayoutMaker maker(way, limits, lookup);
    if (auto const added = maker.add_folder(way.tree, way.path, 0); !added)
        return added.error();
    // The project's own files come first: those above go where all together would be too many.
    if (maker.entries() + way.items.size() > limits.items)
        way.leave_out_parent_files();
    auto items = std::move(way.items);
    std::move(maker.items.begin(), maker.items.end(), std::back_inserter(items));
    return items;
}

} // namespace webots_cloud::core
