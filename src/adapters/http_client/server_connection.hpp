// Connections to other servers: where a URL leads, the addresses of a name, TCP and TLS. What the HTTP client
// and the WebSocket client share.
#pragma once

#include "adapters/names/name_resolver.hpp"
#include "adapters/network/watch_reserve.hpp"
#include "adapters/tls/tls_trust.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/network_config.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

using PlainStream = boost::beast::tcp_stream;
using EncryptedStream = boost::beast::ssl_stream<boost::beast::tcp_stream>;

inline constexpr std::uint16_t usual_plain_port = 80;
inline constexpr std::uint16_t usual_tls_port = 443;

/// Where a URL leads.
struct ServerTarget
{
    ServerTarget() = default;

    /// Whether a URL without a port leads there, too.
    bool has_usual_port() const noexcept { return port == (tls ? usual_tls_port : usual_plain_port); }

    bool tls = false;
    std::string host; ///< A name or a numeric address, of IPv6 without brackets.
    std::uint16_t port = 0;
    std::string path;       ///< And query.
    std::string address;    ///< Numeric: where to connect, unless empty, instead of the host's addresses.
    bool elsewhere = false; ///< As in HttpRequest.
};

/// Errors: `invalid_url`.
result<ServerTarget> parse_http_target(std::string const& url);

/// The same of `ws://` and `wss://`.
result<ServerTarget> parse_websocket_target(std::string const& url);

/// What connections to other servers need: names and trust.
///
/// Thread-safety: one executor.
class ServerDirectory
{
public:
    /// `log` as for `TlsTrust`.
    ServerDirectory(boost::asio::any_io_executor const& executor, HttpClientConfig config, Logger log)
        : trust_(std::move(config.authorities), std::move(log)), resolver_(executor)
    {}

    /// Cancellation, errors: as `NameResolver::resolve`.   Lifetime: `target` must outlive the operation.
    boost::asio::awaitable<result<std::vector<boost::asio::ip::tcp::endpoint>>>
    resolve(ServerTarget const& target, TimePoint deadline);

    /// For one connection, which keeps what it needs of it.   Errors: as `TlsTrust::context`.
    result<boost::asio::ssl::context> tls();

    /// Connects `lowest` to one of `addresses` and, unless `encrypted` is null, which is then the stream over
    /// it, shakes hands by TLS with the host of `target`. The deadline is that of `lowest`.
    ///
    /// Lifetime: all but `addresses` must outlive the operation.   Cancellation: terminal.
    /// Errors: `unreachable`, also when not in time; `timed_out`: TLS is not; `operation_aborted`.
    boost::asio::awaitable<result<>> open_connection(PlainStream& lowest, EncryptedStream* encrypted,
                                                     ServerTarget const& target,
                                                     std::vector<boost::asio::ip::tcp::endpoint> addresses);

private:
    TlsTrust trust_;
    NameResolver resolver_;
    WatchReserve watches_;
};

} // namespace webots_cloud::adapters
