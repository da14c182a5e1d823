// The files of the folders above a project, which come along as long as they are small.
#pragma once

#include "git_staging.hpp"
#include "git_unpack.hpp"

#include "core/git/git_layout.hpp"
#include "core/git/git_object_id.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <unordered_set>
#include <vector>

namespace webots_cloud::adapters {

/// Of all of them together, unpacked: if they are larger, none is kept.
constexpr std::uint64_t max_parent_bytes = std::uint64_t{8} << 20;

/// What neither came with the folders nor lies in another folder of the cache, each once, in the order of the
/// layout. `parents`: with the files of the folders above the project, which come first.
std::vector<core::GitObjectId> missing_files(std::vector<core::GitLayoutItem> const& layout,
                                             GitStaging const& staging, GitDonors const& donors,
                                             bool parents = true);

/// Watches the files that arrive in a staging area: the sizes of those in the folders above are unknown
/// until they arrive, and a project must not wait for them if they are large.
///
/// Thread-safety: that of the staging area.
class GitParentFiles final : public GitBlobWatch
{
public:
    GitParentFiles(std::vector<core::GitLayoutItem> const& layout, GitStaging const& staging,
                   GitDonors const& donors)
    {
        expect(layout, staging, donors);
    }

    /// From now on it waits for what `layout` lacks and only its items of parents need.
    void expect(std::vector<core::GitLayoutItem> const& layout, GitStaging const& staging,
                GitDonors const& donors);

    /// From now on it stops no transfer.
    void ignore() noexcept { expected_.clear(); }

    result<> begins(std::uint64_t size) override;
    result<> arrived(core::GitObjectId const& id, std::uint64_t size) override;

    /// True when it has stopped the transfer.
    bool stopped() const noexcept { return stopped_; }

    /// True when they are known to be too large; false, though it has stopped: a large file came, and it
    /// could have been one of them.
    bool too_large() const noexcept { return bytes_ > max_parent_bytes; }

private:
    result<> stop();

    std::unordered_set<core::GitObjectId, core::GitObjectIdHash> expected_;
    std::uint64_t bytes_ = 0;
    bool stopped_ = false;
};

/// Whether all of them are there, small enough, and leave the project below `max_bytes`.
bool may_keep_parent_files(std::vector<core::GitLayoutItem> const& layout, GitStaging const& staging,
                           GitDonors const& donors, std::uint64_t max_bytes);

/// Takes them out of the layout.   False: there were none.
bool leave_out_parent_files(std::vector<core::GitLayoutItem>& layout);

} // namespace webots_cloud::adapters
