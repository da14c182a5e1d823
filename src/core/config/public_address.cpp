// The keys of a configuration that say where the world outside reaches the server.
#include <webots_cloud/config.hpp>

namespace webots_cloud {
namespace {

template<class Config>
PublicAddress address_of(Config const& config)
{
    PublicAddress address;
    address.host = config.server;
    address.port = config.port;
    address.ssl = config.ssl;
    address.port_rewrite = config.port_rewrite;
    return address;
}

} // namespace

PublicAddress public_address(SessionConfig const& config)
{
    return address_of(config);
}

PublicAddress public_address(SimulationConfig const& config)
{
    return address_of(config);
}

} // namespace webots_cloud
