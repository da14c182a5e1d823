// How a server meets the network: keys that both configurations have, as the adapters obey them.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// The keys that the HTTP server obeys.
struct NetworkConfig
{
    NetworkConfig() = default;

    /// How long a WebSocket may be silent before it is pinged, again and again.
    Duration ping_after() const
    {
        return ping_timeout > Duration::zero() ? std::min(ping_interval, ping_timeout / 2) : ping_interval;
    }

    /// From the first ping to being lost. 0: never.
    Duration pong_timeout() const
    {
        return ping_timeout > Duration::zero() ? ping_timeout - ping_after() : Duration::zero();
    }

    /// `sslCertificate` and `sslKey`: PEM files, both or neither. Empty: plain HTTP, usually behind a proxy.
    /// They are read again when they change; connections that exist keep the certificate that they were made
    /// with.
    std::filesystem::path ssl_certificate;
    std::filesystem::path ssl_key;
    /// `redirectPort`: a port without TLS that leads to the one with TLS. 0: none.
    std::uint16_t redirect_port = 0;
    /// `challengeFolder`: what `certbot --webroot` writes into, for that port. Empty: none.
    std::filesystem::path challenge_folder;
    std::string listen_address = "::"; ///< `listenAddress`: `::` is every address, of IPv4 too.
    /// `connectionsPerAddress`: more are answered 503 (or just closed, with TLS). Three quarters of all
    /// connections that the limit of open files allows, if that is less. Trusted proxies have no limit.
    int connections_per_address = 1000;
    /// `pingTimeout`, in seconds: a WebSocket that was silent for this time, although it was pinged, is
    /// lost. 0: never, but pings still keep proxies from closing the connection.
    Duration ping_timeout = std::chrono::seconds(60);
    /// `pingInterval`, in seconds: a WebSocket that was silent for this time is pinged. Many proxies cut
    /// what is silent for 30 s.
    Duration ping_interval = std::chrono::seconds(20);
    /// `trustedProxies`: addresses and networks, as in `10.0.0.0/8`, of proxies that are believed about who
    /// their clients are. Default: this computer.
    std::vector<std::string> trusted_proxies{"127.0.0.0/8", "::1"};
};

/// The keys that clients of other servers obey: of HTTP and WebSockets, and those that get projects.
struct HttpClientConfig
{
    HttpClientConfig() = default;
    explicit HttpClientConfig(std::filesystem::path authorities) : authorities(std::move(authorities)) {}

    /// `caFile`: PEM file of certificates that are trusted besides the system's authorities; empty: none.
    std::filesystem::path authorities;
};

/// How slow the download of a project may be: a server that stays below is given up. No key sets it.
struct LowSpeed
{
    LowSpeed() = default;
    LowSpeed(std::uint64_t bytes, Duration time) : bytes(bytes), time(time) {}

    std::uint64_t bytes = 1'000;              ///< Per second; 0: it may be as slow as it likes.
    Duration time = std::chrono::seconds(60); ///< For how long it may.
};

} // namespace webots_cloud
