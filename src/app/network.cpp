// The network parameters of both configurations.
#include "https_redirect.hpp"

#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/config.hpp>
#include <webots_cloud/servers.hpp>

namespace webots_cloud {

HttpServerParams http_server_params(std::uint16_t port, NetworkConfig const& config)
{
    HttpServerParams params;
    params.network = config;
    params.port = port;
    if (config.redirect_port != 0)
        params.spare_descriptors += app::max_redirected;
    return params;
}

} // namespace webots_cloud
