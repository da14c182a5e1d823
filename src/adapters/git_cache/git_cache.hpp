// The cache of fetched folders on disk.
#pragma once

#include "adapters/files/file_descriptor.hpp"
#include "adapters/git_packs/git_index.hpp"
#include "adapters/projects/fetch_budget.hpp"
#include "git_verify.hpp"

#include "core/git/git_refs.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

namespace webots_cloud::adapters {

/// One folder of one commit, unpacked, and the files of the folders above it. Never written to once it is in
/// the cache.
///
/// It stays in the cache while there are pointers to it.
struct GitSnapshot
{
    std::filesystem::path files; ///< The repository's root, as far as it was fetched.
    core::GitTarget target;
    GitIndex index;
    FetchGrant grant; ///< For the index, which is in memory as long as somebody uses the folder.
};

using GitSnapshotPtr = std::shared_ptr<GitSnapshot const>;

/// A new, incomplete folder; removed unless it is published.
class GitIncoming
{
public:
    explicit GitIncoming(std::filesystem::path folder) : folder_(std::move(folder)) {}
    GitIncoming(GitIncoming&& other) noexcept : folder_(std::move(other.folder_)) { other.folder_.clear(); }
    GitIncoming& operator=(GitIncoming&&) = delete;
    ~GitIncoming();

    std::filesystem::path const& folder() const noexcept { return folder_; }

private:
    std::filesystem::path folder_;
};

/// The `project_key` of a project.
std::uint32_t project_key_of(std::string const& clone_url, std::string const& ref_and_folder);

/// Layout: `repositories/<digest of the url>/<commit>-<digest of the folder>/{index,proof,files/}`,
/// `.../refs/<digest>` for what a ref last meant, and `incoming/` for what is not complete.
///
/// Complete folders appear by one rename, so that a crash leaves at most something in `incoming`, which the
/// next start removes. With the last folder of a repository its stored refs are removed. A folder whose
/// files do not match its index is dropped when it is requested; simulations that use it keep it. Its files
/// are read for that once, and again when their metadata has changed. If the whole cache is removed while we
/// run, it is created again.   Thread-safety: any thread.
class GitCache
{
public:
    /// Uses `folder`, or a sibling when another process uses it. `budget`, which may be null, accounts for
    /// the memory that folders in use need.
    GitCache(std::filesystem::path folder, GitSourceConfig config,
             std::shared_ptr<FetchBudget> budget = nullptr);
    ~GitCache();

    /// The folder that is used.
    std::filesystem::path const& folder() const noexcept { return folder_; }

    /// Why the cache can't be used, if so.
    result<> const& usable() const noexcept { return usable_; }

    /// The projects that were there when it was made, by their `project_key`, as far as they are of branches
    /// and tags; those asked for last first, at most as many as a LoadReport has.
    std::vector<std::uint32_t> const& projects_at_start() const noexcept { return projects_at_start_; }

    /// The folder if it is there and as it should be; counts as used now. Nothing, too, soon after `aborted`
    /// becomes true.
    GitSnapshotPtr find(std::string const& url, core::GitTarget const& target,
                        std::atomic<bool> const* aborted = nullptr);

    /// True when a folder of the commit is here: then the commit is known to belong to the repository.
    bool knows(std::string const& url, core::GitObjectId const& commit) const;

    /// Other folders of the repository, the newest first: donors of unchanged files.
    std::vector<GitSnapshotPtr> relatives(std::string const& url);

    /// A fresh folder on the cache's file system.   Errors: `unavailable`.
    result<GitIncoming> begin();

    /// Makes `files` (inside an incoming folder) the folder of `target`; `proof` is the text of a `GitProof`.
    ///
    /// Errors: `unavailable`.
    result<GitSnapshotPtr> publish(GitIncoming const& incoming, std::string const& url,
                                   core::GitTarget const& target, GitIndex index, std::string const& proof);

    /// Removes what is too much and not in use, the least recently used first.   False: there was nothing.
    bool trim();

    /// Removes all that is not in use, for a disk that is full.   False: there was nothing.
    bool make_room();

    /// Notes what `ref_and_folder` means now.
    void remember(std::string const& url, std::string const& ref_and_folder, core::GitTarget const& target);

    /// It means nothing any more.
    void forget(std::string const& url, std::string const& ref_and_folder);

    /// What it meant last, for when the server can't be asked.
    std::optional<core::GitTarget> recall(std::string const& url, std::string const& ref_and_folder) const;

    /// Adds to the notices.
    void note(std::string sentence);

    /// Messages for the operator since the last call: what was renamed, had been changed or was left out.
    std::vector<std::string> take_notices();

private:
    /// How a folder is to look.
    struct Known
    {
        std::optional<core::GitObjectId> index; ///< Digest of its text.
        core::GitTarget target;                 ///< What it is, once the index is known.
        std::optional<core::GitObjectId> look;  ///< When its content was checked.
    };

    struct Stored
    {
        Known known;
        std::uint64_t bytes = 0; ///< Of the disk, about.
        std::filesystem::file_time_type used;
        std::weak_ptr<GitSnapshot const> open;
    };

    void open(std::filesystem::path const& folder);
    void scan();
    void list_projects();
    bool make_folders();
    bool restore_folders();
    void drop(std::filesystem::path const& folder);
    void remove_unused();
    bool trim_to(std::uint64_t max_bytes);
    void forget_empty(std::filesystem::path const& repository);
    std::filesystem::path repository(std::string const& url) const;
    std::filesystem::path fresh_path() const;
    GitSnapshotPtr open_stored(std::string const& url, std::filesystem::path const& folder,
                               std::atomic<bool> const* aborted);
    void complain_of(std::string const& url);
    static GitContent load(std::filesystem::path const& folder, GitSnapshot& snapshot, Known& known,
                           std::atomic<bool> const* aborted);
    void pay_for_index(GitSnapshot& snapshot);

    std::filesystem::path folder_;
    GitSourceConfig config_;
    std::shared_ptr<FetchBudget> budget_;
    FileDescriptor lock_;
    result<> usable_;
    std::vector<std::uint32_t> projects_at_start_;
    mutable std::mutex mutex_;
    std::unordered_map<std::string, Stored> stored_; ///< By path.
    std::vector<std::string> notices_;
    /// Folders that are no longer good, and the snapshots that still use them.
    std::vector<std::pair<std::filesystem::path, std::weak_ptr<GitSnapshot const>>> dropped_;
};

} // namespace webots_cloud::adapters
