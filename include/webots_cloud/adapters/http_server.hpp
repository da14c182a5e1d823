// The HTTP server: where it listens, what it grants its clients, what it has seen of them.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/network_config.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/picture_taker.hpp>
#include <webots_cloud/transport/simulator_talk.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Where an HTTP server listens, and what it grants its clients.
struct HttpServerParams
{
    HttpServerParams() = default;
    explicit HttpServerParams(NetworkConfig network, std::uint16_t port = 0)
        : network(std::move(network)), port(port)
    {}

    NetworkConfig network;  ///< All but the port that leads to the one with TLS.
    std::uint16_t port = 0; ///< 0: any free one, see `HttpServer::port`.
    /// PEM file of certificates that are trusted besides the system's authorities, where requests are passed
    /// on by TLS (`Upstream::tls`). It is read again when it changes.
    std::filesystem::path tls_authorities;
    std::size_t queue_bytes =
        256 * 1024; ///< Waiting for a browser that does not read; more, and it is dropped.
    std::size_t message_bytes =
        64 * 1024; ///< The longest message of a browser; a longer one closes with 1009.
    /// How many bytes the bodies of all requests may have in memory together; each client a quarter of that.
    /// What is beyond is answered 503.
    std::size_t body_bytes = std::size_t{64} << 20;
    std::size_t max_connections = SIZE_MAX; ///< Fewer where the limit of open files is lower.
    std::size_t spare_descriptors =
        64; ///< Of the limit of open files, kept for everything that is no connection.
    /// Some watches of epoll are kept for connections: for servers that share their user with programs of
    /// strangers, who may take all others.
    bool keeps_watches = false;
    Duration header_timeout =
        std::chrono::seconds(10); ///< For a TLS handshake, a request's headers, an answer to our close.
    Duration body_timeout = std::chrono::seconds(30);  ///< For a whole body.
    Duration idle_timeout = std::chrono::seconds(75);  ///< Between two requests of one connection.
    Duration write_timeout = std::chrono::seconds(30); ///< To take an answer.
    Duration stop_timeout =
        std::chrono::seconds(1); ///< For browsers to answer our close when the server stops.
    // Of requests that are passed on (`Forward`)
    Duration connect_timeout = std::chrono::seconds(5); ///< To reach the other server.
    Duration answer_timeout = std::chrono::seconds(30); ///< For it to begin its answer.
    /// A tunnel on which nobody says anything for that long is closed. A peer that has vanished is found out
    /// within two minutes without it (TCP keepalive); and a side that does not take what it is sent, or
    /// waits for the other one to end, has `write_timeout`.
    Duration tunnel_idle_timeout = std::chrono::hours(1);
};

/// What a server has seen of the network. All but the first three are counts since it was made.
struct HttpServerStatistics
{
    HttpServerStatistics() = default;

    std::uint64_t connections = 0; ///< Open now, WebSockets and tunnels included.
    std::uint64_t websockets = 0;  ///< Open now.
    std::uint64_t tunnels = 0;     ///< Open now: browsers that are relayed to other servers.
    std::uint64_t accepted = 0;
    std::uint64_t requests = 0; ///< Whose headers were complete and good; WebSocket handshakes too.
    // Connections refused or ended by us
    std::uint64_t refused_address = 0; ///< Too many from one address.
    std::uint64_t refused_no_room = 0; ///< No descriptor or watch was left, and no connection made room.
    std::uint64_t made_room = 0;       ///< Silent ones closed so that others find a descriptor.
    std::uint64_t timed_out = 0;       ///< A deadline passed: silent, slow to ask or slow to take the answer.
    std::uint64_t tls_failures = 0;    ///< Handshakes that failed.
    std::uint64_t slow_readers = 0;    ///< WebSockets whose queue was full.
    std::uint64_t dead_peers = 0;      ///< WebSockets that did not answer a ping.
    // Requests and messages refused
    std::uint64_t bad_requests = 0;       ///< 400 and 505
    std::uint64_t refused_bodies = 0;     ///< 413
    std::uint64_t long_request_lines = 0; ///< 414
    std::uint64_t long_headers = 0;       ///< 431
    std::uint64_t bad_handshakes = 0;     ///< 400 and 426 to those who want a WebSocket.
    std::uint64_t bad_frames = 0;         ///< WebSockets closed with 1002, 1007 or 1009.
    // Passed on to other servers
    std::uint64_t forwarded = 0;             ///< Requests.
    std::uint64_t tunnel_bytes_received = 0; ///< From browsers, requests included.
    std::uint64_t tunnel_bytes_sent = 0;     ///< To browsers, answers included.
    std::uint64_t bad_gateways = 0;          ///< 502: the other server was not reached, or made no sense.
    std::uint64_t late_gateways = 0;         ///< 504: it was too slow.
    // TLS handshakes with other servers
    std::uint64_t upstream_tls_full = 0;     ///< Their certificate was verified.
    std::uint64_t upstream_tls_resumed = 0;  ///< It had been, for an earlier connection.
    std::uint64_t upstream_tls_failures = 0; ///< It is not to be trusted, or they speak no TLS.
    /// When our certificate expires; none without TLS.
    std::optional<WallTime> certificate_expires;
};

/// Serves an endpoint to the network.
///
/// Lifetime: must outlive its operations: await their end before it is destroyed.
class HttpServer
{
public:
    virtual ~HttpServer() = default;

    /// Listens and has `endpoint` answer until cancelled, then closes every WebSocket with 1001 and waits for
    /// the conversations to end. Once.
    ///
    /// Lifetime: `endpoint` must outlive the operation.
    /// Errors: as `listen`; `operation_aborted` when cancelled.
    virtual boost::asio::awaitable<result<>> run(Endpoint& endpoint) = 0;

    /// Opens the port; `run` does so itself if need be.
    ///
    /// Errors: `unavailable`, naming the port: it is in use, or this machine does not have `listen_address`
    /// now; `invalid_argument`: `listen_address` is no numeric address, or the port is one that we may not
    /// open; `invalid_config`, naming a file of the certificate, or an entry of `trusted_proxies`, that is
    /// unusable.
    virtual result<> listen() = 0;

    /// The port that is listened on.
    /// Precondition: `listen` succeeded.
    virtual std::uint16_t port() const = 0;

    virtual HttpServerStatistics statistics() const = 0;
};

/// HTTP/1.1 and WebSocket, plain or with TLS 1.2 and 1.3.
std::unique_ptr<HttpServer> make_http_server(boost::asio::any_io_executor executor, HttpServerParams params,
                                             Logger log);

/// Whether a server could show a certificate (its chain after it) with its key, both PEM files.
///
/// Errors: `invalid_config`, naming the file that is unusable.
result<> check_certificate(std::filesystem::path const& certificate, std::filesystem::path const& key);

/// Takes pictures of simulators as requests are passed on to them, brokers included.
std::unique_ptr<PictureTaker> make_picture_taker(boost::asio::any_io_executor executor, Logger log);

/// Speaks with simulators that are reached in the same way.
std::unique_ptr<SimulatorTalk> make_simulator_talk(boost::asio::any_io_executor executor, Logger log);

} // namespace webots_cloud
