// A download in the making: what has arrived, and how it becomes a folder of the cache.
#pragma once

#include "adapters/files/file_descriptor.hpp"
#include "adapters/git_cache/git_cache.hpp"
#include "adapters/git_cache/git_proof.hpp"
#include "adapters/git_packs/git_index.hpp"
#include "adapters/git_packs/git_parent_files.hpp"
#include "adapters/git_packs/git_staging.hpp"
#include "adapters/git_packs/git_unpack.hpp"
#include "adapters/projects/fetch_budget.hpp"
#include "adapters/projects/fetch_interrupt.hpp"

#include "core/git/git_fetch_plan.hpp"
#include "core/git/git_layout.hpp"
#include "core/git/git_refs.hpp"
#include "core/git/git_worlds.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/listed_world.hpp>
#include <webots_cloud/project_ref.hpp>
#include <webots_cloud/transport/project_source.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

struct GitDownloadOrder
{
    ProjectRef project;
    FetchLimits limits;
    FetchInterrupt interrupt;
};

/// Everything is paid for before it is made, and given back when this is destroyed.
///
/// Lifetime: cache and share must outlive it.   Thread-safety: one thread at a time.
class GitDownload
{
public:
    GitDownload(GitCache& cache, FetchShare& share, GitDownloadOrder order);
    GitDownload(GitDownload const&) = delete;

    /// Makes the folders in which everything arrives, and looks for donors.
    ///
    /// Errors: of the budget, `unavailable` (disk).
    result<> begin();

    bool has_donors() const noexcept { return !donors_.files.empty(); }

    /// Where packs are unpacked.   Precondition: begun.
    GitStaging& staging() noexcept { return *staging_; }

    /// Finds the target's folder in the commit, and decides what it becomes on disk. From now on the files
    /// of the folders above it are watched.
    ///
    /// Errors: `not_a_commit`, `no_such_folder`, `object_missing`, `malformed`, sentences.
    result<> lay_out(core::GitTarget const& target);

    /// Finds the worlds in the target's folder and below it, in place of a layout.
    ///
    /// Errors: the same.
    result<> find_worlds(core::GitTarget const& target);

    /// The files of the first of these worlds: the others are listed without what they say of themselves.
    std::vector<core::GitObjectId> missing_worlds() const;

    /// These worlds, with what their files say as far as they are there. The addresses begin with `base`.
    std::vector<ListedWorld> read_worlds(std::string const& base) const;

    /// The files that the layout lacks.
    std::vector<core::GitObjectId> missing(core::GitFiles files) const;

    /// Prepares for a transfer of these files: which of them may stop it.
    void expect(core::GitFiles files);

    /// The last transfer was stopped by the files of the folders above the project.
    bool parents_stopped() const noexcept { return parents_ && parents_->stopped(); }
    bool parents_too_large() const noexcept { return parents_ && parents_->too_large(); }

    /// Whether the tips lead to the commit, by way of the commits that have arrived.
    ///
    /// Errors: of the budget, the interrupt's.
    result<bool> is_in_history(core::GitObjectId const& commit, std::vector<core::GitObjectId> const& tips);

    /// Puts all files in their places, without those above the project if they are too large or missing.
    ///
    /// Errors: `object_missing`, sentences.
    result<> unpack();

    /// After `unpack`.
    GitIndex& index() noexcept { return index_; }
    int files_folder() const noexcept { return files_.get(); }
    int scratch_folder() const noexcept { return objects_.get(); }

    /// Puts the folder into the cache.   Errors: `unavailable`.
    result<GitSnapshotPtr> publish(std::string const& url, core::GitTarget const& target);

private:
    using Layout = std::vector<core::GitLayoutItem>;

    result<core::GitWay> find_folder(core::GitTarget const& target);
    result<Layout> lay_out_folder(core::GitWay& way);
    result<core::GitObjectId> root_of(core::GitObjectId const& commit);
    result<> take_memory(std::uint64_t bytes);
    result<> pay_for_entries(std::string const& folder, std::uint64_t& taken);
    result<> pay_for_folder(std::string const& folder, std::uint64_t& taken);
    result<> pay_for_files();
    void leave_out_large_parents();

    GitCache& cache_;
    FetchShare& share_;
    GitDownloadOrder order_;
    FetchShare::Loan const loan_; ///< Given back when there is nothing left of what it pays for.
    std::optional<GitIncoming> incoming_;
    FileDescriptor objects_;
    std::optional<GitStaging> staging_;
    std::vector<GitSnapshotPtr> relatives_; ///< In the cache as long as donors are needed.
    std::vector<FileDescriptor> donor_folders_;
    GitDonors donors_;
    std::string folder_; ///< Of the target.
    std::optional<GitProof> proof_;
    Layout layout_;
    std::vector<core::GitWorldFile> worlds_; ///< In place of a layout.
    std::vector<std::string> forbidden_;     ///< As in `core::GitWay`.
    bool left_out_ = false;                  ///< The files of the folders above the project.
    std::optional<GitParentFiles> parents_;
    std::optional<GitStaging::Watching> watching_;
    FileDescriptor files_;
    GitIndex index_;
};

} // namespace webots_cloud::adapters
