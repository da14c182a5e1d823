// What a folder of a commit becomes on disk: decided completely before the first byte is written.
#pragma once

#include "git_object_id.hpp"
#include "git_tree.hpp"

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// A folder, file or link to make; a folder comes before what is in it.
struct GitLayoutItem
{
    GitTreeEntry::Kind kind = GitTreeEntry::Kind::file; ///< Never `submodule`.
    std::string path; ///< Relative to the repository's root; every part is harmless.
    GitObjectId id;
    bool of_parent = false; ///< It lies in a folder above the project: optional.

    /// How many folders the item lies below the repository's root.
    std::size_t depth() const noexcept;
};

struct GitLayoutLimits
{
    std::uint32_t items = 50'000; ///< Submodules count too.
    std::size_t path_length = 1024;
    std::size_t path_bytes = std::size_t{16} << 20;    ///< Of all paths together.
    std::size_t depth = 64;                            ///< Below the project's root.
    std::uint32_t parent_files = 1'000;                ///< If there are more, none of them is in the layout.
    std::size_t parent_bytes = std::size_t{256} << 10; ///< Of a parent's tree object; the same.
};

/// The folder of a project and what leads to it.
struct GitWay
{
    GitWay() = default;

    GitObjectId tree;                 ///< Of the project's folder.
    std::string path;                 ///< To the project's folder; empty: it is the root.
    std::vector<GitLayoutItem> items; ///< The folders of the path, and the files and links beside them.
    bool left_out = false;            ///< There were too many of these: none is among the items.
    /// Files and folders that are left out for their names, as they may be shown: the first of them.
    std::vector<std::string> forbidden;

    /// A file or folder of this name, in the folder at `path`, is left out.
    void forbid(std::string_view path, std::string_view name);

    /// Removes the optional items.
    void leave_out_parent_files();
};

/// Finds a tree object; null when it is not there.
using GitTreeLookup = std::function<std::string const*(GitObjectId const&)>;

/// Walks from the tree `root` to the folder `path` (empty: `root` itself). On the way it collects what git's
/// sparse checkout of that folder ("cone") has besides: the files of the folders that it lies in. Files
/// with names that are not harmless are left out.
///
/// Errors: `no_such_folder`, `object_missing`, `malformed`, `invalid_url` (a folder that can't be made).
result<GitWay> find_git_folder(GitObjectId const& root, std::string_view path, GitLayoutLimits const& limits,
                               GitTreeLookup const& lookup);

/// A project: the items of the path, which are moved into it, and everything in its folder, without
/// submodules. If that is too much together with the files above the project, these are left out. What has a
/// name that is not harmless is left out, with all that is in it: `way` has its paths.
///
/// Errors: `protocol_error` for names that occur twice; `too_large`; the detail is a sentence.
result<std::vector<GitLayoutItem>> lay_out_git_folder(GitWay& way, GitLayoutLimits const& limits,
                                                      GitTreeLookup const& lookup);

} // namespace webots_cloud::core
