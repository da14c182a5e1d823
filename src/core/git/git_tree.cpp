#include "git_tree.hpp"

#include "core/refusals.hpp"
#include "git_problem.hpp"

#include <algorithm>
#include <optional>

namespace webots_cloud::core {
namespace {

Failure malformed(char const* what)
{
    return {GitProblem::malformed, std::string("the git server sent a malformed ") + what};
}

/// What git calls the mode, in octal; old repositories also have 100664.
std::optional<GitTreeEntry::Kind> kind_of_mode(std::string_view mode) noexcept
{
    if (mode == "40000")
        return GitTreeEntry::Kind::folder;
    if (mode == "100644" || mode == "100664" || mode == "100600" || mode == "100640")
        return GitTreeEntry::Kind::file;
    if (mode == "100755" || mode == "100775" || mode == "100700")
        return GitTreeEntry::Kind::executable;
    if (mode == "120000")
        return GitTreeEntry::Kind::link;
    if (mode == "160000")
        return GitTreeEntry::Kind::submodule;
    return std::nullopt;
}

/// The digest after `key` at the very start of an object.
std::optional<GitObjectId> leading_id(std::string_view object, std::string_view key) noexcept
{
    if (!object.starts_with(key))
        return std::nullopt;
    object.remove_prefix(key.size());
    if (object.size() < 41 || object[40] != '\n')
        return std::nullopt;
    return git_object_id(object.substr(0, 40));
}

} // namespace

result<std::vector<GitTreeEntry>> parse_git_tree(std::string_view object)
{
    constexpr std::size_t max_entries = 100'000;  // of one folder
    constexpr std::size_t max_name_length = 4096; // of any file system
    std::vector<GitTreeEntry> entries;
    while (!object.empty()) {
        auto const space = object.find(' ');
        auto const zero = object.find('\0');
        constexpr std::size_t id_size = sizeof(GitObjectId::bytes);
        if (space == std::string_view::npos || zero == std::string_view::npos || zero < space ||
            object.size() - zero - 1 < id_size || zero - space > max_name_length)
            return malformed("folder");
        if (entries.size() == max_entries)
            return refused(Refused::repository_folder_files);
        auto const kind = kind_of_mode(object.substr(0, space));
        if (!kind)
            return malformed("file mode");
        GitTreeEntry entry;
        entry.kind = *kind;
        entry.name = object.substr(space + 1, zero - space - 1);
        std::copy_n(object.begin() + static_cast<std::ptrdiff_t>(zero) + 1, id_size, entry.id.bytes.begin());
        entries.push_back(std::move(entry));
        object.remove_prefix(zero + 1 + id_size);
    }
    return entries;
}

result<GitObjectId> tree_of_commit(std::string_view object)
{
    if (auto const id = leading_id(object, "tree "))
        return *id;
    return malformed("commit");
}

std::vector<GitObjectId> parents_of_commit(std::string_view object)
{
    constexpr std::string_view tree = "tree ";
    constexpr std::string_view parent = "parent ";
    constexpr std::size_t id_and_newline = 41;
    std::vector<GitObjectId> parents;
    if (!leading_id(object, tree))
        return parents;
    object.remove_prefix(tree.size() + id_and_newline);
    while (auto const id = leading_id(object, parent)) {
        parents.push_back(*id);
        object.remove_prefix(parent.size() + id_and_newline);
    }
    return parents;
}

} // namespace webots_cloud::core
