// The worlds in a folder of a commit, found in its tree objects alone: no file has to be there.
#pragma once

#include "git_layout.hpp"
#include "git_object_id.hpp"

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

struct GitWorldFile
{
    std::string
        path; ///< Relative to the repository's root: `.../worlds/<file>.wbt`, names that addresses have.
    GitObjectId id;
};

struct GitWorldLimits
{
    std::size_t entries = 50'000; ///< That are looked at, of all folders.
    std::size_t depth = 16;       ///< Folders below the one that is searched.
    std::size_t worlds = 200;
};

/// Those in the folder `path` (empty: all of `root`) and below it, folder by folder; beyond the limits the
/// others are left out.
///
/// Errors: `no_such_folder`, `object_missing`, `malformed`.
result<std::vector<GitWorldFile>> find_git_worlds(GitObjectId const& root, std::string_view path,
                                                  GitWorldLimits const& limits, GitTreeLookup const& lookup);

} // namespace webots_cloud::core
