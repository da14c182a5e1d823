// Copies files and whole folders of the cache.
#pragma once

#include "adapters/threads/blocking_pool.hpp"
#include "git_index.hpp"

#include <webots_cloud/error.hpp>

#include <atomic>
#include <cstdint>

#include <sys/types.h>

namespace webots_cloud::adapters {

/// How the bytes of a file get from the cache into a project.
enum class GitCopyWay
{
    clone, ///< The file system shares them until one side writes (FICLONE).
    copy
};

/// Copies the regular file `from_name`, which must have `size` bytes, to the new file `to_name`.
///
/// Errors: `protocol_error` when the source is not such a file; `unavailable` (disk).
result<> copy_file(int from, char const* from_name, int to, char const* to_name, std::uint64_t size,
                   mode_t mode, GitCopyWay way = GitCopyWay::copy);

/// Copies everything that the index names from the open folder `from` into the open, empty folder `to`. Runs
/// on a thread of `pool`; others that are free help.
///
/// Errors: as `copy_file`; `operation_aborted` soon after `aborted` becomes true.
result<> copy_folder(GitIndex const& index, int from, int to, GitCopyWay way, BlockingPool& pool,
                     std::atomic<bool> const& aborted);

} // namespace webots_cloud::adapters
