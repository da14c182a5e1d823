// Servers without version 2 of git's protocol, spoken to by libgit2.
#pragma once

#include "adapters/git_cache/git_cache.hpp"
#include "git2_transport.hpp"
#include "git_client.hpp"

#include "core/git/git_object_id.hpp"
#include "core/git/git_refs.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

/// A client of one server in version 0 or 1 of the protocol, by libgit2. The requests are
/// `CurlHttp`'s, and the pack goes to a `GitPackReader`: libgit2 sees neither the network nor the disk, so
/// that every limit holds here too.   Thread-safety: one thread at a time.
class Git2Client
{
public:
    /// `scratch`: for the bare repository that libgit2 requires; it stays empty.
    Git2Client(CurlHttp& http, GitRemote remote, CurlLimits limits, GitIncoming scratch);
    ~Git2Client();

    /// All refs of the repository. One round trip, the first time.   Errors: as `GitClient::ls_refs`.
    result<std::vector<core::GitRef>> ls_refs();

    /// Roughly the memory of all listed refs.
    std::uint64_t memory_of_refs() const noexcept;

    /// Fetches a commit that a ref points to into `pack`. One round trip, after `ls_refs`.
    ///
    /// `shallow`: without its history.   Errors: `no_such_commit` where no ref does; as `GitClient::fetch`.
    result<> fetch(core::GitObjectId const& commit, bool shallow, GitPackReader& pack,
                   GitClient::Progress const& progress);

private:
    class Session;

    result<> connect();

    GitIncoming scratch_;
    Git2Transport transport_;
    std::vector<core::GitRef> refs_;
    std::unique_ptr<Session> session_; ///< Uses everything above.
};

} // namespace webots_cloud::adapters
