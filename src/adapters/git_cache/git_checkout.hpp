// Checks out a folder of the cache as a project that a simulation may write into.
#pragma once

#include "adapters/git_packs/git_copy.hpp"
#include "git_cache.hpp"

#include <webots_cloud/error.hpp>

#include <atomic>
#include <filesystem>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

/// With every method, changes by a simulation to its project do not affect the cache. `remove_tree` removes a
/// project.
///
/// Thread-safety: any thread.
class GitCheckout
{
public:
    /// Finds the fastest method that works between the cache and `instances`, an existing folder (empty:
    /// copying).
    GitCheckout(std::filesystem::path const& cache, std::filesystem::path const& instances);

    /// The method, for the log.
    std::string_view describe() const noexcept;

    /// On a thread of `pool`: makes `directory` (which does not exist) and in it `<repository>` with the
    /// files of the snapshot, which must stay in the cache until the project is removed. Returns the
    /// project's root, `<repository>[/<folder>]`.
    ///
    /// Errors: `invalid_url`, `unavailable`, `protocol_error` (the cache is damaged), `operation_aborted`.
    result<std::filesystem::path> check_out(GitSnapshot const& snapshot,
                                            std::filesystem::path const& directory,
                                            std::string const& repository, BlockingPool& pool,
                                            std::atomic<bool> const& aborted) const;

private:
    bool overlay_ = false;
    GitCopyWay way_ = GitCopyWay::copy;
};

} // namespace webots_cloud::adapters
