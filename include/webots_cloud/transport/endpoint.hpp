// What a network server adapter serves: an Endpoint answers requests and talks on WebSockets, without knowing
// about sockets.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/public_address.hpp>
#include <webots_cloud/transport/http.hpp>
#include <webots_cloud/transport/tunnel_group.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

namespace WEBOTS_CLOUD_API webots_cloud {

/// A request as it came from the network: views into the adapter's buffer.
///
/// Lifetime: the call that it is passed to.
struct IncomingRequest
{
    IncomingRequest() = default;

    /// The value of the first header of that name, or empty.
    std::string_view header(std::string_view name) const noexcept
    {
        for (auto const& [field, value] : headers)
            if (field.size() == name.size() && equal_ignoring_case(field, name))
                return value;
        return {};
    }

    std::string_view method;
    std::string_view path;  ///< Starts with `/`; as sent, not percent-decoded.
    std::string_view query; ///< What follows the first `?`, without it.
    std::span<std::pair<std::string_view, std::string_view> const> headers;
    std::string_view peer;   ///< Numeric address of the other end of the connection, without port.
    std::string_view client; ///< Numeric address of the client: the peer, or the one whose request a trusted
                             ///< proxy forwards.
    /// The key by which limits for each client are counted: its address, or its /64 network with IPv6, whose
    /// wider networks have limits, too. Empty: it has no limits, as a trusted proxy itself.
    std::string_view quota_key;
    std::string_view body;      ///< Empty but in `Endpoint::respond_to_body`.
    bool upgrade = false;       ///< A well-formed WebSocket handshake (its path is not checked).
    bool is_from_proxy = false; ///< The peer is a trusted proxy.
    /// Whether it is the operator's: it came over the operator's socket, or with the operator's token. Its
    /// address proves nothing: web pages and simulations on this machine send requests too, and proxies
    /// forward those of everybody.
    bool is_operator = false;
};

/// An open WebSocket, seen from either side: a server serves browsers on it (`Endpoint::serve_websocket`),
/// and what a `WebSocketClient` has opened leads to another server. The peer is the program at its other end.
///
/// Lifetime: a server's, while `Endpoint::serve_websocket` runs; a client's is destroyed by its owner.
/// Thread-safety: one executor.
class Channel
{
public:
    virtual ~Channel() = default;

    /// Queues a text message and returns at once. Messages arrive in order.
    ///
    /// Errors: `closed`; `too_large` when the peer has not read and the queue is full: the channel is then
    /// dropped.
    virtual result<> send(std::string text) = 0;

    /// The same for several messages, which may go out together.
    virtual result<> send_all(std::span<std::string const> texts)
    {
        for (auto const& text : texts)
            if (auto const sent = send(text); !sent)
                return sent;
        return {};
    }

    /// The next message of the peer, text or binary.
    /// Cancellation: terminal, nothing is lost.
    ///
    /// Errors: `closed` properly by either side; `unreachable`: the connection was lost without a close
    /// frame.
    virtual boost::asio::awaitable<result<std::string>> receive() = 0;

    /// Starts to close: queued messages are sent first. `code` 0 sends an empty close frame. A second call
    /// does nothing.
    virtual void close(std::uint16_t code = 0, std::string reason = {}) = 0;

    /// About how many bytes wait because the peer, or its network, does not take them as fast as they are
    /// sent: for messages that are better left out than late.
    virtual std::size_t queued() noexcept { return 0; }

    /// The code with which the peer has closed it; 0: none, or it has not.
    virtual std::uint16_t farewell() const noexcept { return 0; }
};

/// Accept the WebSocket handshake, then call `Endpoint::serve_websocket`.
struct AcceptWebSocket
{
    AcceptWebSocket() = default;
};

/// Another server, to which requests are passed on.
struct Upstream
{
    Upstream() = default;
    Upstream(std::string host, std::uint16_t port) : host(std::move(host)), port(port) {}

    std::string host; ///< A numeric address; with `tls` a name, too.
    std::uint16_t port = 0;
    /// By TLS: only to a server whose certificate is for `host`, or for `name`, and from an authority that
    /// the adapter trusts.
    bool tls = false;
    std::string name;       ///< Empty: as `host`.
    bool elsewhere = false; ///< As in HttpRequest.
    /// Instead of all these, unless empty: a Unix socket that answers each connection with one connected
    /// socket (SCM_RIGHTS and a byte), or closes it where the server can't be reached.
    std::filesystem::path broker;
};

/// Pass the request on to another server, and its answer to the browser.
///
/// A WebSocket handshake (`request.upgrade`) that the other server accepts becomes a tunnel: from then on
/// both sides are sent what the other one says, as it is. Other answers go to the browser as they come; its
/// connection lives on where they tell their length. The adapter answers 502 or 504 itself where the other
/// server can't be reached or is late. Of the header fields those pass, in both directions, that are meant
/// for this kind of server: neither passwords, cookies and addresses of visitors, nor what would concern the
/// rest of the site.
struct Forward
{
    Forward() = default;

    Upstream upstream;
    UpstreamKind kind = UpstreamKind::simulation; ///< Which header fields pass.
    std::string target;         ///< The path, and the query, that the other server is asked for.
    HttpHeaders headers;        ///< Replace the request's headers of these names; empty ones are left out.
    HttpHeaders answer_headers; ///< Of the answer, where the other server sends none of these names.
    /// Of the answer, in addition to what the other server sends; not where it accepts a WebSocket handshake.
    HttpHeaders added_answer_headers;
    std::shared_ptr<TunnelGroup> group; ///< Null: of none.
    /// The request is a WebSocket handshake, and the other server knows nothing of that: it is asked with a
    /// plain GET, and the body of its answer is sent to the browser in binary messages, cut anywhere.
    /// Whatever the browser says ends it. Other answers than 200, and bodies in chunks, are not passed on:
    /// 502.
    bool in_messages = false;
};

/// What to do with a request.
using Answer = std::variant<HttpResponse, AcceptWebSocket, Forward>;

/// The client that opened a channel; owned copies, unlike `IncomingRequest`.
struct ChannelInfo
{
    ChannelInfo() = default;

    std::string path;
    std::string query;
    AskedAddress asked;
    std::string peer;      ///< Numeric address of the browser or its proxy.
    std::string client;    ///< As in `IncomingRequest`.
    std::string quota_key; ///< As in `IncomingRequest`.
    /// Where the browser reaches this server, as a session server says whose gateway it came through
    /// (`Webots-Cloud-Address`); empty: it came through none.
    std::string public_address;
    bool is_from_proxy = false; ///< As in `IncomingRequest`.
};

/// The server side of a protocol.
///
/// Lifetime: must outlive the `run()` of the adapter that serves it.
/// Thread-safety: called on the adapter's executor only.
class Endpoint
{
public:
    virtual ~Endpoint() = default;

    /// Answers at once, from memory: a request never waits for anything here. `AcceptWebSocket` is only for
    /// `request.upgrade`.
    virtual Answer respond(IncomingRequest const& request) = 0;

    /// Asked when the head of a request says that a body follows: the longest one that is taken here, in
    /// bytes. A longer one is answered 413 before it is read; so is every body by default.
    virtual std::uint64_t max_body(IncomingRequest const& /*request*/) { return 0; }

    /// Answers a request whose body `max_body` has let in; the whole body has come. `respond` is not called
    /// for it. This may wait.
    ///
    /// Lifetime: `request` and what it shows stay until the operation ends.
    /// Cancellation: none: it has to end by itself, and soon, since a server that stops waits for it.
    virtual boost::asio::awaitable<HttpResponse> respond_to_body(IncomingRequest const& /*request*/)
    {
        co_return HttpResponse(500, {}, {});
    }

    /// Serves a browser until either side ends the conversation; the adapter closes the channel when this
    /// returns.
    ///
    /// Cancellation: none. When the server stops, `channel.receive()` reports `closed`, and this cleans up
    /// and returns.
    virtual boost::asio::awaitable<void> serve_websocket(ChannelInfo info, Channel& channel) = 0;

    /// The adapter is about to close all channels: last messages can be sent now.
    virtual void stopping() {}

    /// The adapter itself refuses a request, since the server to which it was to be passed on does not
    /// answer, say: this may write another page around the sentence. Status and headers stay.
    virtual void dress(HttpResponse& /*refusal*/, IncomingRequest const& /*request*/) {}
};

} // namespace webots_cloud
