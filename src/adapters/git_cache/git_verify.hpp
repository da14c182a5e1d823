// Whether a folder of the cache still has what was fetched: simulations run as the same user, and may have
// written there.
#pragma once

#include "adapters/git_packs/git_index.hpp"

#include <atomic>
#include <filesystem>
#include <optional>

namespace webots_cloud::adapters {

/// The metadata of a whole folder: inodes, sizes, modes and times of change (ctime) of its files and
/// folders. Only the kernel sets ctime, so that any later change makes a difference.
struct GitLook
{
    core::GitObjectId digest;
    /// False: something was changed just now, and a change that comes now could look the same.
    bool settled = false;
};

/// Nothing where something is missing, or is not of the type and size that the index says.   Blocks.
std::optional<GitLook> look_at(GitIndex const& index, std::filesystem::path const& files);

enum class GitContent
{
    intact,
    changed,
    unknown ///< `aborted` became true.
};

/// Reads everything: each file and link has to have the content that its identifier names, with no other
/// right than those of the index, and nothing else may lie there.   Blocks.
GitContent check_content(GitIndex const& index, std::filesystem::path const& files,
                         std::atomic<bool> const* aborted);

} // namespace webots_cloud::adapters
