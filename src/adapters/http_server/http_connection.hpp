// One connection of the HTTP server, until it ends or becomes a WebSocket.
#pragma once

#include "adapters/gateway/forwarding.hpp"
#include "adapters/gateway/tunnels.hpp"
#include "adapters/messages/http_request_reader.hpp"
#include "adapters/network/connection_limit.hpp"
#include "adapters/network/handshakes.hpp"
#include "adapters/network/network_stream.hpp"
#include "adapters/network/peer.hpp"
#include "body_memory.hpp"

#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/time.hpp>

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace webots_cloud::adapters {

/// What all connections of a server share; must outlive them.
struct HttpConnectionContext
{
    HttpServerParams const& params;
    Endpoint* endpoint; ///< Given when the server runs; before, there is no connection.
    Logger const& log;
    HttpServerStatistics& statistics;
    core::IpNetworks const& proxies;
    ConnectionLimit& limit;
    Handshakes& handshakes;
    Tunnels& tunnels;
    Upstreams& upstreams;
    std::size_t& forwardings; ///< How many requests are being passed on.
    BodyMemory& bodies;
    std::function<bool()> has_room; ///< For one more connection; may make some.
};

/// Reads requests and answers them in order, with a deadline for everything that the client does.
///
/// Lifetime: both coroutines run one after the other, and it must outlive them.   Thread-safety: one
/// executor.
class HttpConnection
{
public:
    enum class Outcome
    {
        over,
        websocket,
        tunnel
    };

    HttpConnection(NetworkStream stream, Peer peer, ConnectionLimit::Ticket ticket,
                   HttpConnectionContext const& context);

    /// The TLS handshake, where there is one, and the first request; false when the connection is to be
    /// closed.
    boost::asio::awaitable<bool> await_first_request();

    /// Answers the request that has been read, and those that follow, and says what the last one has made of
    /// the connection.
    boost::asio::awaitable<Outcome> answer_requests();

    /// Waits for a request between two of them.
    bool is_idle() const noexcept { return awaiting_request_ && !reader_.has_begun(); }

    /// Ends it at once.
    void cut();
    bool is_cut() const noexcept { return is_cut_; }

    /// Ends it when nothing is on its way.
    void stop();

    /// Ends it when the client took too long.
    void check(TimePoint now);

    /// Once the outcome was `tunnel`.
    TunnelPlan take_tunnel();

    // What a WebSocket takes over, once the outcome was `websocket`.
    ChannelInfo channel_info() const;
    std::string_view rest() const noexcept { return reader_.rest(); }
    NetworkStream&& take_stream() noexcept { return std::move(stream_); }
    ConnectionLimit::Ticket&& take_ticket() noexcept { return std::move(ticket_); }

private:
    enum class Next
    {
        request,
        close,
        websocket,
        forward,
        tunnel
    };

    boost::asio::awaitable<bool> read_request(Duration patience);
    boost::asio::awaitable<bool> read_body();
    bool flush_at_once();
    boost::asio::awaitable<bool> flush();
    boost::asio::awaitable<void> refuse(int status, std::string_view what, std::string_view advice = {});
    Next answer();
    boost::asio::awaitable<Next> answer_to_body();
    bool admit_client();
    void name_client(IncomingRequest& request);
    void read_forwarded(core::HeaderFields fields);
    std::string const& client() const noexcept { return client_.empty() ? peer_.address : client_; }
    Next give(HttpResponse const& response, IncomingRequest const& request);
    Next refuse_connection(int status, IncomingRequest const& request);
    boost::asio::awaitable<Next> forward();
    Next fail_to_forward(Failure const& why);
    Next begin_answer();
    Next begin_messages();
    void count_forwarded(std::size_t received, std::size_t sent);
    void keep_upstream(Upstream upstream, NetworkStream::Released connection);
    TunnelPlan plan_tunnel();
    /// By what the client is counted.
    std::string const& quota_key() const noexcept
    {
        return peer_.is_proxy() ? client_quota_key_ : peer_.quota_key;
    }
    void set_deadline(Duration from_now);

    NetworkStream stream_;
    ConnectionLimit::Ticket ticket_;
    HttpConnectionContext const& context_;
    Peer peer_;
    // Of a request that a trusted proxy has passed on; else empty.
    std::string client_;
    std::string client_quota_key_;
    bool awaiting_request_ = true;
    bool awaiting_answer_ = false; ///< Of another server.
    bool stopping_ = false;
    bool is_cut_ = false;
    HttpRequestReader reader_;
    std::unique_ptr<RequestBody> request_body_; ///< Null where the current request has none.
    std::string out_;
    std::shared_ptr<SharedBody const> body_;      ///< Follows `out_`; null: nothing does.
    std::string_view body_rest_;                  ///< What is still to be sent of it.
    std::unique_ptr<Forwarding> forwarding_;      ///< Null most of the time.
    std::unique_ptr<KeptUpstream> kept_upstream_; ///< Null: none.
    std::uint64_t rest_of_answer_ = 0;            ///< Of the other server, still to be relayed.
    std::optional<core::ChunkedBody> chunks_;     ///< How far its body has come, if it comes in chunks.
    Tunnels::Tunnel* relay_ = nullptr;            ///< Has our stream meanwhile.
    TimePoint deadline_ = TimePoint::max();
};

} // namespace webots_cloud::adapters
