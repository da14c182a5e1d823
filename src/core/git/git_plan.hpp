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
struct GitPlanItem
{
    GitTreeEntry::Kind kind = GitTreeEntry::Kind::file; ///< Never `submodule`.
    std::string path; ///< Relative to the project's root; every part is safe.
    GitObjectId id;

    /// How many folders the item lies below the project's root.
    std::size_t depth() const noexcept;
};

struct GitPlanLimits
{
    std::uint32_t items = 50'000; ///< Submodules count too.
    std::size_t path_length = 1024;
    std::size_t path_bytes = std::size_t{16} << 20; ///< Of all paths together.
    std::size_t depth = 64;
};

/// Finds a tree object; null when it is not there.
using GitTreeLookup = std::function<std::string const*(GitObjectId const&)>;

/// The tree of the folder `path` (empty: `root` itself).   Errors: `not_found`, `protocol_error`.
result<GitObjectId> find_git_folder(GitObjectId const& root, std::string_view path,
                                    GitTreeLookup const& lookup);

/// Everything in the folder `tree`, without submodules.
///
/// Errors: `protocol_error` for names that are not safe or occur twice; `too_large`; the detail is a
/// sentence.
result<std::vector<GitPlanItem>> plan_git_folder(GitObjectId const& tree, GitPlanLimits const& limits,
                                                 GitTreeLookup const& lookup);

} // namespace webots_cloud::core
