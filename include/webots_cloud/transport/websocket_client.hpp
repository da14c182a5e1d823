// WebSockets to other servers as a seam, for a session server that relays.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/http.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <memory>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// A WebSocket to open.
struct WebSocketRequest
{
    WebSocketRequest() = default;
    explicit WebSocketRequest(std::string url) : url(std::move(url)) {}

    std::string url;        ///< `ws://` or `wss://`, absolute.
    std::string address;    ///< As in HttpRequest.
    bool elsewhere = false; ///< Likewise.
    HttpHeaders headers;    ///< Of the handshake; `Host` replaces what the URL says.
    /// For name, connection, TLS and handshake together.
    Duration timeout = std::chrono::seconds(5);
    /// Bytes; the channel is closed when the other side sends a longer message.
    std::size_t max_message = 64 * 1024;
    /// Bytes that wait because the other side does not read; the channel is dropped when there are more.
    std::size_t max_queued = 256 * 1024;
};

/// Opens WebSockets to other servers.
///
/// The channel answers pings. Destroying it drops the connection without a close frame, unless `close` was
/// called before: then what is queued and the close frame still go out, as long as the other side takes them.
/// Nobody may be in `receive()` when it is destroyed.
/// Lifetime: the client must outlive its channels.
/// Cancellation: terminal; the connection is abandoned and `operation_aborted` reported.
/// Errors: `invalid_url`; `unreachable` (name or connection: refused, or not in time; TLS: refused);
/// `timed_out` (TLS, or the handshake); `protocol_error` (the other side accepts no WebSocket: its detail has
/// the status).
/// Thread-safety: one executor.
class WebSocketClient
{
public:
    virtual ~WebSocketClient() = default;
    virtual boost::asio::awaitable<result<std::unique_ptr<Channel>>> connect(WebSocketRequest request) = 0;
};

} // namespace webots_cloud
