// From objects that have arrived to a folder of files.
#pragma once

#include "adapters/projects/fetch_interrupt.hpp"
#include "git_index.hpp"
#include "git_staging.hpp"

#include "core/git/git_layout.hpp"

#include <webots_cloud/error.hpp>

#include <string>
#include <unordered_map>
#include <vector>

namespace webots_cloud::adapters {

/// Files that an older folder of the cache already has. Links are not among them.
struct GitDonors
{
    struct File
    {
        int folder = -1; ///< Open; the donor's root.
        std::string path;
        core::GitTreeEntry::Kind kind = core::GitTreeEntry::Kind::file;
        std::uint64_t size = 0;
        std::string pointer; ///< As in the donor's index.
    };

    std::unordered_map<core::GitObjectId, File, core::GitObjectIdHash> files;
};

/// Makes everything in `layout` below the open, empty folder `root`: files are moved there from the staging
/// area or linked from donors. Symbolic links that could lead out of the repository are left out.
///
/// Errors: `object_missing`, `unavailable` (disk), the interrupt's.
result<GitIndex> unpack_git_folder(std::vector<core::GitLayoutItem> const& layout, GitStaging const& staging,
                                   GitDonors const& donors, int root, FetchInterrupt const& interrupt = {});

} // namespace webots_cloud::adapters
