// The network parameters of both configurations.
#include "https_redirect.hpp"

#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/config.hpp>
#include <webots_cloud/servers.hpp>

#include <algorithm>

namespace webots_cloud {

HttpServerParams http_server_params(std::uint16_t port, NetworkConfig const& config)
{
    HttpServerParams params;
    params.address = config.listen_address;
    params.port = port;
    params.tls_certificate = config.ssl_certificate;
    params.tls_key = config.ssl_key;
    params.connections_per_address = static_cast<std::size_t>(config.connections_per_address);
    params.trusted_proxies = config.trusted_proxies;
    if (config.redirect_port != 0)
        params.spare_descriptors += app::max_redirected;
    params.ping_after = config.ping_interval;
    if (config.ping_timeout > Duration::zero()) {
        params.ping_after = std::min(params.ping_after, config.ping_timeout / 2);
        params.pong_timeout = config.ping_timeout - params.ping_after;
    } else { // no browser is given up, but pings still keep proxies from closing the connection
        params.pong_timeout = Duration::zero();
    }
    return params;
}

} // namespace webots_cloud
