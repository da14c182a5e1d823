// Tree and commit objects of git, read.
#pragma once

#include "git_object_id.hpp"

#include <webots_cloud/error.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// One entry of a folder.
struct GitTreeEntry
{
    enum class Kind
    {
        file,
        executable,
        link,
        folder,
        submodule
    };

    Kind kind = Kind::file;
    std::string name; ///< Not checked: see `is_harmless_file_name`.
    GitObjectId id;
};

/// The entries of a tree object.   Errors: `malformed`.
result<std::vector<GitTreeEntry>> parse_git_tree(std::string_view object);

/// The tree of a commit object.   Errors: `malformed`.
result<GitObjectId> tree_of_commit(std::string_view object);

/// The parents of a commit object; none of anything else.
std::vector<GitObjectId> parents_of_commit(std::string_view object);

} // namespace webots_cloud::core
