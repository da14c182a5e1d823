#include "git_peer.hpp"

#include <algorithm>

namespace webots_cloud::adapters {
namespace {

// Of memory, in bytes, about.
constexpr std::uint64_t memory_of_libgit2 = std::uint64_t{64} << 20; // of 8 MB that a server may list
// A conversation that waits for a download.
constexpr std::uint64_t memory_in_queue = std::uint64_t{256} << 10;

} // namespace

result<std::vector<core::GitRef>> GitPeer::list_refs(core::git_action::ListRefs const& wanted, Limits limits)
{
    if (wanted.version_2) {
        limits.http.bytes = max_git_ref_bytes;
        return GitClient(http_, remote_, limits.http).ls_refs(wanted.prefixes);
    }
    auto const peer = libgit2(limits);
    if (!peer)
        return peer.error();
    return (*peer)->ls_refs();
}

result<core::GitCapabilities> GitPeer::capabilities(Limits limits)
{
    limits.http.bytes = max_git_ref_bytes;
    return GitClient(http_, remote_, limits.http).capabilities();
}

result<> GitPeer::fetch(GitWants const& wants, bool version_2, Limits limits, GitPackReader& pack,
                        GitClient::Progress const& progress)
{
    if (version_2)
        return GitClient(http_, remote_, limits.http).fetch(wants, pack, progress);
    auto const peer = libgit2(limits);
    if (!peer)
        return peer.error();
    return (*peer)->fetch(wants.ids.front(), wants.shallow, pack, progress);
}

void GitPeer::hang_up_if_large() noexcept
{
    if (libgit2_ && libgit2_->memory_of_refs() > memory_in_queue)
        libgit2_.reset();
}

result<Git2Client*> GitPeer::libgit2(Limits limits)
{
    if (!libgit2_) {
        auto scratch = cache_.begin();
        if (!scratch)
            return scratch.error();
        FetchBytes price;
        price.memory = memory_of_libgit2;
        if (auto const taken = limits.share->take(price); !taken)
            return taken.error();
        auto server = remote_;
        server.version_2 = false;
        libgit2_ = std::make_unique<Git2Client>(http_, std::move(server), limits.http, std::move(*scratch));
    }
    return libgit2_.get();
}

} // namespace webots_cloud::adapters
