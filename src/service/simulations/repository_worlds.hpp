// The worlds of a repository, or of a folder in one, for people who paste its address: `POST /worlds/list`.
#pragma once

#include "core/access/token_buckets.hpp"
#include "local_worlds.hpp"
#include "session_context.hpp"

#include "async/interruptible.hpp"

#include <webots_cloud/listed_world.hpp>
#include <webots_cloud/project_ref.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud {

/// Has the project's source list them, under the rules of a start: tickets, the operator's repositories,
/// limits on what is fetched, and how often one client may ask. A list is kept for a while, so that a class
/// that pastes one address has it fetched once.
///
/// Lifetime: what it is made with must outlive it.   Thread-safety: one executor.
class RepositoryWorlds
{
public:
    RepositoryWorlds(SessionContext& context, LocalWorlds const& local) : context_(context), local_(local) {}

    static constexpr std::string_view path = "/worlds/list"; ///< Also after that of a ticket.
    static constexpr std::uint64_t longest_body = 4096;
    static bool serves(IncomingRequest const& request) noexcept;

    /// `request.body` is the address. 200: the list, or why there can't be one; 503: why there is none here,
    /// or now.
    ///
    /// Lifetime, Cancellation: as `Endpoint::respond_to_body`; it ends within 20 s, and when `stop` is
    /// called.
    boost::asio::awaitable<HttpResponse> answer(IncomingRequest const& request);

    /// The server stops.
    void stop() { looks_.interrupt(); }

private:
    using Worlds = std::vector<ListedWorld>;

    struct Kept
    {
        TimePoint made;
        Worlds worlds;
    };

    boost::asio::awaitable<result<Worlds>> list(std::string_view asked_path, std::string url,
                                                std::string quota_key);
    boost::asio::awaitable<result<Worlds>> look(ProjectRef folder);
    result<> may_look(std::string_view quota_key);
    void keep(std::string const& address, Worlds const& worlds);

    SessionContext& context_;
    LocalWorlds const& local_;
    core::TokenBuckets asked_{20, 0.5};
    async::Interruptible looks_;
    std::map<std::string, Kept, std::less<>> kept_;
};

} // namespace webots_cloud
