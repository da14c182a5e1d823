// Where the world outside reaches a server.
#pragma once

#include <webots_cloud/export.hpp>

#include <cstdint>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// The configuration keys `server`, `port`, `ssl` and `portRewrite`, which both servers have.
struct PublicAddress
{
    PublicAddress() = default;

    std::string host = "localhost"; ///< As browsers know it; `*`: as each of them calls it.
    /// `/webots` of the name `sim.example.org/webots`: below it a proxy in front has this server. Empty: it
    /// is found by its port.
    std::string path;
    std::uint16_t port = 0;   ///< The server's own.
    bool ssl = true;          ///< `https://` and `wss://` instead of `http://` and `ws://`.
    bool port_rewrite = true; ///< `/` instead of `:` before a port: a proxy in front looks there.

    bool operator==(PublicAddress const&) const = default;
};

/// Where a browser has asked for a server, as its request says, and the trusted proxies that it came through.
struct AskedAddress
{
    AskedAddress() = default;

    std::string host; ///< The Host header, as it came; without a port, with that of `X-Forwarded-Port`.
    std::string path; ///< `X-Forwarded-Prefix`: as in PublicAddress. Empty: none, or none that makes sense.
    bool tls = false; ///< `X-Forwarded-Proto` is `https`.

    bool operator==(AskedAddress const&) const = default;
};

} // namespace webots_cloud
