// The smart protocol of git, version 2, as far as a reader of one commit needs it.
#pragma once

#include "adapters/git_packs/git_pack_reader.hpp"
#include "adapters/http_client/curl_http.hpp"

#include "core/git/git_fetch_plan.hpp"
#include "core/git/git_object_id.hpp"
#include "core/git/git_refs.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::adapters {

constexpr std::uint64_t max_git_ref_bytes = std::uint64_t{8} << 20; ///< What a server may list.

/// A repository on a server.
struct GitRemote
{
    std::string base;      ///< The forge's address.
    std::string url;       ///< Of the repository, `https://github.com/owner/repository.git`.
    bool version_2 = true; ///< Asked for; a server may answer in an older one all the same.
};

/// Servers report refusals as a line `ERR <text>`.   Errors: as `core::git_server_error` if `line` is one.
result<> check_for_git_error(std::string_view line);

/// What to fetch.
struct GitWants
{
    std::vector<core::GitObjectId> ids;
    bool shallow = false;    ///< Without history.
    std::string_view filter; ///< What to leave out, as git says it; empty: nothing.
};

constexpr std::string_view git_filter_files = "blob:none";
constexpr std::string_view git_filter_files_and_folders = "tree:0"; ///< Leaves commits.

/// A client of one server.   Thread-safety: one thread at a time.
class GitClient
{
public:
    /// `progress` is called after each piece that arrives, with the bytes of the answer so far.
    using Progress = std::function<void(GitPackReader const& pack, std::uint64_t received)>;
    using Sink = std::function<result<>(std::string_view)>;

    GitClient(CurlHttp& http, GitRemote remote, CurlLimits limits)
        : http_(http), remote_(std::move(remote)), limits_(limits)
    {}

    /// The refs whose names begin with one of `prefixes`. One round trip.
    ///
    /// Errors: each a `core::GitProblem`, unless the sink or somebody else has ended it.
    result<std::vector<core::GitRef>> ls_refs(std::vector<std::string> const& prefixes);

    /// The capabilities that the server announces. One round trip.   Errors: as `ls_refs`.
    result<core::GitCapabilities> capabilities();

    /// Fetches objects into `pack`. One round trip.   Errors: as `ls_refs`, as `GitPackReader`.
    result<> fetch(GitWants const& wants, GitPackReader& pack, Progress const& progress);

    /// The two requests of the protocol, for other implementations of it: a GET of the server's offer,
    /// and a POST to git-upload-pack.   Errors: as `ls_refs`, what the sink returned.
    result<> advertise(Sink sink);
    result<> post(std::string body, Sink sink);

private:
    result<> ask(std::string url, std::string body, Sink sink);

    CurlHttp& http_;
    GitRemote remote_;
    CurlLimits limits_;
};

} // namespace webots_cloud::adapters
