// The git server of one fetch, spoken to by our own client or, where that must be, by libgit2.
#pragma once

#include "adapters/git_cache/git_cache.hpp"
#include "adapters/git_packs/git_pack_reader.hpp"
#include "adapters/http_client/curl_http.hpp"
#include "adapters/projects/fetch_budget.hpp"
#include "git2_client.hpp"
#include "git_client.hpp"

#include "core/git/git_fetch_plan.hpp"

#include <webots_cloud/error.hpp>

#include <memory>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

/// Errors of all requests: `core::GitProblem`s, sentences of the budget and of the disk, `operation_aborted`.
///
/// Lifetime: client and cache must outlive it.   Thread-safety: one thread at a time.
class GitPeer
{
public:
    /// Of one request.
    struct Limits
    {
        CurlLimits http;
        FetchShare* share = nullptr; ///< Pays for libgit2.
    };

    GitPeer(CurlHttp& http, GitCache& cache, GitRemote remote)
        : http_(http), cache_(cache), remote_(std::move(remote))
    {}

    result<std::vector<core::GitRef>> list_refs(core::git_action::ListRefs const& wanted, Limits limits);
    result<core::GitCapabilities> capabilities(Limits limits);

    /// Fetches objects into `pack`; without `version_2` the whole of the one commit that is wanted.
    result<> fetch(GitWants const& wants, bool version_2, Limits limits, GitPackReader& pack,
                   GitClient::Progress const& progress);

    /// Ends a conversation by libgit2, if there is one.
    void hang_up() noexcept { libgit2_.reset(); }

    /// The same, if it needs much memory.
    void hang_up_if_large() noexcept;

private:
    result<Git2Client*> libgit2(Limits limits);

    CurlHttp& http_;
    GitCache& cache_;
    GitRemote remote_;
    std::unique_ptr<Git2Client> libgit2_; ///< Once it was needed.
};

} // namespace webots_cloud::adapters
