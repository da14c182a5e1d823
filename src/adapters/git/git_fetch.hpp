// Fetches a folder of a repository into the cache: carries out what the plan of it says.
#pragma once

#include "adapters/git_cache/git_cache.hpp"
#include "adapters/http_client/curl_http.hpp"
#include "adapters/projects/fetch_budget.hpp"
#include "adapters/projects/fetch_deadline.hpp"
#include "git_download.hpp"
#include "git_lfs.hpp"
#include "git_peer.hpp"
#include "git_progress.hpp"
#include "git_servers.hpp"

#include "core/git/git_fetch_plan.hpp"

#include <webots_cloud/adapters/projects.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/project_ref.hpp>
#include <webots_cloud/transport/project_source.hpp>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

struct GitFetchOrder
{
    ProjectRef project;
    core::GitPurpose purpose = core::GitPurpose::folder;
    FetchLimits limits;
    std::atomic<bool> const* aborted = nullptr; ///< Outlives the fetch.
    GitProgress* progress = nullptr;            ///< Outlives the fetch.
};

struct GitFetched
{
    GitSnapshotPtr snapshot;
    std::string notice;              ///< For the log: why it is not from the server.
    std::vector<ListedWorld> worlds; ///< In place of a snapshot, where these were wanted.
};

/// Makes sure that a folder is in the cache, or lists the worlds of one. Blocks.   Thread-safety: any thread.
///
/// What is requested, and in which order, is decided by `core::GitFetchPlan`.
class GitFetch
{
public:
    GitFetch(CurlHttp& http, GitCache& cache, GitServers& servers, GitSourceConfig const& config,
             std::shared_ptr<FetchBudget> budget, GitFetchOrder order);

    /// Resolves the address, and looks for the commit in the cache. Nothing: it has to be downloaded.
    ///
    /// Errors: as `ProjectSource::fetch`, less those about worlds.
    std::optional<result<GitFetched>> look_up();

    /// After `look_up`, once.   Errors: as there.
    result<GitFetched> download();

    GitFetch(GitFetch const&) = delete; // what it shares asks it whether it may go on

private:
    using Ids = std::vector<core::GitObjectId>;

    core::GitAction run(core::GitAction action);
    result<GitFetched> end(core::GitAction const& action);

    /// Nothing: the action is not for this to carry out.
    std::optional<core::GitOutcome> carry_out(core::GitAction const& action);
    core::GitOutcome carry_out(core::git_action::FindCommit const& action);
    core::GitOutcome carry_out(core::git_action::ListRefs const& action);
    core::GitOutcome carry_out(core::git_action::AskCapabilities const& action);
    core::GitOutcome carry_out(core::git_action::RememberCapabilities const& action);
    core::GitOutcome carry_out(core::git_action::RememberMissing const& action);
    core::GitOutcome carry_out(core::git_action::ForgetTarget const& action);
    core::GitOutcome carry_out(core::git_action::FindFolder const& action);
    core::GitOutcome carry_out(core::git_action::FindLastFolder const& action);
    core::GitOutcome carry_out(core::git_action::BeginDownload const& action);
    core::GitOutcome carry_out(core::git_action::FetchHistory const& action);
    core::GitOutcome carry_out(core::git_action::SearchHistory const& action);
    core::GitOutcome carry_out(core::git_action::FetchCommit const& action);
    core::GitOutcome carry_out(core::git_action::LayOut const& action);
    core::GitOutcome carry_out(core::git_action::FetchFiles const& action);
    core::GitOutcome carry_out(core::git_action::ReadWorlds const& action);
    core::GitOutcome carry_out(core::git_action::Unpack const& action);
    core::GitOutcome carry_out(core::git_action::FindLargeFiles const& action);
    core::GitOutcome carry_out(core::git_action::FetchLargeFiles const& action);
    core::GitOutcome carry_out(core::git_action::Publish const& action);
    core::GitOutcome carry_out(core::git_action::MakeRoom const& action);

    bool is_for_worlds() const noexcept { return order_.purpose == core::GitPurpose::worlds; }
    void drop_download();
    Ids missing(core::GitFiles files) const;
    core::GitOutcome fetch_in_parts(GitWants wants, Ids const& ids, bool parents_may_stop);
    core::GitOutcome fetch_pack(GitWants const& wants);
    void report(GitWants const& wants, GitPackReader const& pack);

    GitPeer::Limits peer_limits(std::uint64_t bytes);

    CurlHttp& http_;
    GitCache& cache_;
    GitServers& servers_;
    GitSourceConfig const& config_;
    GitFetchOrder order_;
    std::string url_;
    core::GitFetchPlan plan_;
    GitPeer peer_;
    FetchDeadline deadline_;
    FetchShare share_;                         ///< Outlives all that it pays for.
    std::unique_ptr<GitDownload> download_;    ///< While there is one.
    std::optional<GitLargeFiles> large_files_; ///< Of the download, once they are looked for.
    core::GitCapabilities capabilities_;       ///< That the download makes use of.
    GitSnapshotPtr snapshot_;                  ///< Once it was found or made.
    std::vector<ListedWorld> worlds_;          ///< Once they were read.
    std::uint64_t received_ = 0;               ///< Bytes of packs, of all requests.
    std::uint64_t unpacked_ = 0;               ///< Bytes of objects.
    std::uint64_t given_up_ = 0;               ///< Bytes received in vain, which a browser has seen.
    std::uint32_t files_missing_ = 0;          ///< That the layout lacked first.
    std::uint32_t files_wanted_ = 0;           ///< That were asked for by name.
    std::uint32_t files_read_ = 0;
};

} // namespace webots_cloud::adapters
