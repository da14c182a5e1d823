// libgit2's smart protocol, carried by our own HTTP.
#pragma once

#include "git_client.hpp"

#include <webots_cloud/error.hpp>

#include <functional>
#include <optional>
#include <string>
#include <string_view>

struct git_remote;
struct git_transport;

namespace webots_cloud::adapters {

/// All traffic of libgit2 goes through `GitClient`, and so obeys its limits, its deadline and its host:
/// libgit2's own HTTP has no time-outs.
///
/// libgit2 1.5 can't ask for a commit without its history. If `shallow` is set, this adds that option to
/// the request, and removes the server's reply to it from the answer.
///
/// Lifetime: outlives every remote that it was given to.   Thread-safety: one thread at a time.
class Git2Transport
{
public:
    Git2Transport(CurlHttp& http, GitRemote remote, CurlLimits limits)
        : http_(http), remote_(std::move(remote)), limits_(limits)
    {}

    /// A `git_transport_cb` of libgit2's; `self` is the transport.
    static int connect(git_transport** out, git_remote* owner, void* self);

    /// Runs `work` for libgit2 and turns its failure, or exception, into libgit2's -1. `failure` keeps the
    /// first.
    int attempt(std::function<result<>()> const& work) noexcept;

    CurlHttp& http() const noexcept { return http_; }
    GitRemote const& remote() const noexcept { return remote_; }
    CurlLimits const& limits() const noexcept { return limits_; }

    bool shallow = false;
    std::optional<Failure> failure; ///< Why libgit2 was told that something failed.

private:
    CurlHttp& http_;
    GitRemote remote_;
    CurlLimits limits_;
};

/// A request of libgit2's for one commit without its history: `deepen 1` after what it wants.
///
/// Errors: `malformed` when it is no request.
result<std::string> make_shallow(std::string_view request);

/// The start of an answer that arrives in pieces: lines `shallow <commit>`, and the flush after them, are
/// taken off, and the server's words are noticed, which libgit2 does not keep.
class GitAnswerStart
{
public:
    /// What libgit2 gets of the next piece.   Errors: as `check_for_git_error`, `malformed`.
    result<std::string> push(std::string_view bytes);

private:
    std::string waiting_;
    bool passed_ = false;
};

} // namespace webots_cloud::adapters
