// Which requests a server accepts: an Endpoint in front of another one that checks where a request comes
// from.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/fleet.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// The server that AccessControl guards.
struct GuardedServer
{
    GuardedServer() = default;
    explicit GuardedServer(std::string name, std::vector<std::string> machine_names = {},
                           bool starts_here = false)
        : name(std::move(name)), machine_names(std::move(machine_names)), starts_here(starts_here)
    {}

    /// Its public name, as in the addresses that browsers get. If the name is one of this machine only
    /// (`localhost`), requests must name a known host.
    std::string name = "localhost";
    /// What the machine calls itself, besides `localhost`.
    std::vector<std::string> machine_names;
    /// Pages that ask `/session` for an address open their WebSocket here, as with a session server that
    /// relays. Those that may not are told so in a sentence, instead of the address. Where others answer, it
    /// is for them to say.
    bool starts_here = false;
};

/// Whether a token is the operator's. Empty: there are no operator requests over the network.
using OperatorTokenCheck = std::function<bool(std::string_view token)>;

/// Lets requests through to another endpoint, or answers in its place.
///
/// - Operator requests (below `/api/`) are passed on with `IncomingRequest::is_operator` set when they carry
///   the operator's token (`Authorization: Bearer <token>`) and name a known host.
/// - WebSockets of foreign pages are answered 403, and on a server of this machine requests to foreign names
///   421.
/// - Pages get the headers that browsers need to protect them.
/// - Wrong passwords and tokens are answered 429 when there are many, and so are right ones then.
///
/// Lifetime: `endpoint` and `clock` must outlive it.
/// Thread-safety: one executor.
class AccessControl final : public Endpoint
{
public:
    AccessControl(AccessConfig config, GuardedServer server, Endpoint& endpoint, Clock& clock, Logger log,
                  OperatorTokenCheck is_operator_token = OperatorTokenCheck());
    ~AccessControl() override;

    /// Obeys another configuration from the next request on. Connections stay.
    void apply(AccessConfig config, GuardedServer server, OperatorTokenCheck is_operator_token);

    /// The machines of the fleet belong to the site, from the next request on: if `GuardedServer::name` is
    /// one of this machine only, the reach of the site (this machine, a network, everybody) is the widest of
    /// theirs.
    /// Lifetime: either may end first.
    void follow(Fleet& fleet);

    Answer respond(IncomingRequest const& request) override;
    /// Those of `endpoint`. Whoever may not ask is told so when the body has come.
    std::uint64_t max_body(IncomingRequest const& request) override;
    boost::asio::awaitable<HttpResponse> respond_to_body(IncomingRequest const& request) override;
    boost::asio::awaitable<void> serve_websocket(ChannelInfo info, Channel& channel) override;
    void stopping() override;
    void dress(HttpResponse& refusal, IncomingRequest const& request) override;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
