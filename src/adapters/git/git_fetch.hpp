// Fetches a folder of a repository into the cache: which requests are sent to the server, in which order.
#pragma once

#include "adapters/http/curl_http.hpp"
#include "adapters/projects/fetch_budget.hpp"
#include "git2_client.hpp"
#include "git_cache.hpp"
#include "git_client.hpp"
#include "git_progress.hpp"
#include "git_proof.hpp"
#include "git_servers.hpp"
#include "git_unpack.hpp"

#include <webots_cloud/adapters.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/project_ref.hpp>
#include <webots_cloud/transport/project_source.hpp>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::adapters {

struct GitFetchOrder
{
    ProjectRef project;
    FetchLimits limits;
    std::atomic<bool> const* aborted = nullptr; ///< Outlives the fetch.
    GitProgress* progress = nullptr;            ///< Outlives the fetch.
};

struct GitFetched
{
    GitSnapshotPtr snapshot;
    std::string notice; ///< For the log: why it is not from the server.
};

/// Makes sure that a folder is in the cache. Blocks.   Thread-safety: any thread.
///
/// One round trip when the commit is known, two for a whole repository, three for a folder of one or for a
/// commit that is requested by its hash. If a server turns out not to speak version 2 of git's protocol,
/// libgit2 is used for it.
class GitFetch
{
public:
    GitFetch(CurlHttp& http, GitCache& cache, GitServers& servers, GitSourceParams const& params,
             std::shared_ptr<FetchBudget> budget, GitFetchOrder order);

    /// Resolves the address, and looks for the commit in the cache. Nothing: it has to be downloaded.
    ///
    /// Errors: as `ProjectSource::fetch`, less those about worlds.
    std::optional<result<GitFetched>> look_up();

    /// After `look_up`, once.   Errors: as there.
    result<GitFetched> download();

    GitFetch(GitFetch const&) = delete; // what it shares asks it whether it may go on

private:
    struct Download;

    using Refs = std::vector<core::GitRef>;
    using Ids = std::vector<core::GitObjectId>;

    result<core::GitTarget> resolve();
    void start_clock();
    result<> take_memory(std::uint64_t bytes);
    result<core::GitTarget> resolve_commit();
    result<Refs> list_refs(std::vector<std::string> const& prefixes);
    result<Refs> list_refs_with_libgit2();
    result<Refs> ask_again(Failure const& failure);
    result<> can_check_history(GitCapabilities const& capabilities, core::GitObjectId const& commit) const;
    result<> check_history(Download& state, core::GitObjectId const& commit, Ids const& files);
    result<> fetch_history(Download& state, Ids const& files);
    Failure about_commit(errc code, std::string_view what, core::GitObjectId const& commit) const;
    result<Download> begin_download(GitCapabilities const& capabilities);
    result<GitSnapshotPtr> download_target();
    result<GitSnapshotPtr> download_with(GitCapabilities const& capabilities, core::GitTarget const& target);
    result<GitSnapshotPtr> download_once(GitCapabilities const& capabilities, core::GitTarget const& target);
    result<GitFetched> fall_back(Failure const& failure);
    result<core::GitWay> way_to_folder(Download& state, core::GitTarget const& target, GitProof& proof);
    result<> fetch_rest(Download& state, core::GitObjectId const& commit,
                        std::vector<core::GitLayoutItem> const& plan, GitDonors const& donors);
    result<> fetch_plan(Download& state, std::vector<core::GitLayoutItem> const& plan,
                        GitDonors const& donors, std::size_t wanted, bool parents);
    void note_lack_of_parents();
    result<> pay_for_folder(std::string const& folder, std::uint64_t& taken);
    result<> pay_for_entries(std::string const& folder, std::uint64_t& taken);
    result<> pay_for_files(std::vector<core::GitLayoutItem> const& plan, GitStaging const& staging,
                           GitDonors const& donors);
    result<> fetch_files(Download& state, Ids const& files);
    result<> fetch_large_files(Download const& state, GitIndex& index, int files);
    void give_up(std::uint64_t received, std::uint64_t unpacked);
    result<> fetch_pack(Download& state, GitWants const& wants);
    result<> fetch_pack_with_libgit2(Download& state, GitWants const& wants, GitPackReader& pack,
                                     GitClient::Progress const& progress);
    void report(Download const& state, GitWants const& wants, GitPackReader const& pack);
    result<> may_go_on() const;
    CurlLimits http_limits(std::uint64_t bytes) const;
    GitRemote remote() const;
    GitClient client(std::uint64_t bytes);
    GitClient client_for_refs();
    result<Git2Client*> libgit2();
    std::string not_reached(Failure const& failure) const;
    Failure explain(Failure const& failure) const;

    CurlHttp& http_;
    GitCache& cache_;
    GitServers& servers_;
    GitSourceParams const& params_;
    std::shared_ptr<FetchBudget> budget_;
    GitFetchOrder order_;
    std::string url_;
    TimePoint deadline_;
    core::GitTarget target_;              ///< Once it was looked up.
    std::unique_ptr<FetchShare> share_;   ///< Outlives all that it pays for.
    std::unique_ptr<Git2Client> libgit2_; ///< Once it was needed.
    std::uint64_t received_ = 0;          ///< Bytes of packs, of all requests.
    std::uint64_t unpacked_ = 0;          ///< Bytes of objects.
    std::uint64_t given_up_ = 0;          ///< Bytes received in vain, which a browser has seen.
    std::optional<Ids> may_be_from_;      ///< The tips that may lead to the commit, while that is not known.
    bool answered_ = true; ///< The last request for a pack was understood, whatever became of it.
};

} // namespace webots_cloud::adapters
