// The network as both configurations describe it.
#pragma once

#include <webots_cloud/adapters.hpp>
#include <webots_cloud/config.hpp>

namespace webots_cloud::app {

inline HttpServerParams server_params(std::uint16_t port, NetworkConfig const& config)
{
    HttpServerParams params;
    params.port = port;
    params.tls_certificate = config.ssl_certificate;
    params.tls_key = config.ssl_key;
    params.connections_per_address = static_cast<std::size_t>(config.connections_per_address);
    params.trusted_proxies = config.trusted_proxies;
    return params;
}

} // namespace webots_cloud::app
