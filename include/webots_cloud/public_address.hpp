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
    std::uint16_t port = 0;         ///< The server's own.
    bool ssl = true;                ///< `https://` and `wss://` instead of `http://` and `ws://`.
    bool port_rewrite = true;       ///< `/` instead of `:` before a port: a proxy in front looks there.

    bool operator==(PublicAddress const&) const = default;
};

} // namespace webots_cloud
