#include "moved_ports.hpp"

#include "core/access/ip_address.hpp"
#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr int last_port = 65'535;

result<> move_number(std::uint16_t& port, int distance)
{
    if (port == 0) // there is none
        return {};
    // Neither can overflow: a number far beyond the last port says the same as any other beyond it.
    int const moved = port + std::clamp(distance, -2 * last_port, 2 * last_port);
    if (moved < 1 || moved > last_port)
        return Failure(errc::invalid_argument, concat("port ", std::to_string(port), " can't be moved by ",
                                                      std::to_string(distance), ": ports end at 65535"));
    port = static_cast<std::uint16_t>(moved);
    return {};
}

/// `host`: as in an address, with brackets where it is IPv6.
bool is_this_machine(std::string_view host)
{
    if (host == "localhost" || host == "*")
        return true;
    if (host.starts_with('[') && host.ends_with(']'))
        host = host.substr(1, host.size() - 2);
    static auto const loopback = IpNetwork::parse("127.0.0.0/8");
    auto const address = IpAddress::parse(host);
    return address && (loopback->contains(*address) || *address == IpAddress::parse("::1"));
}

result<> move_network(PublicAddress& address, NetworkConfig& network, int distance)
{
    if (auto const moved = move_number(address.port, distance); !moved)
        return moved;
    return move_number(network.redirect_port, distance);
}

result<> move_machine(ServerSpec& server, int distance)
{
    auto const was = server.internal_address;
    if (auto const moved = move_port(server.internal_address, distance); !moved)
        return moved;
    bool const is_elsewhere = !was.empty() && was == server.internal_address;
    if (is_elsewhere || distance == 0)
        return {};
    if (server.first_port != 0)
        for (auto* const port : {&server.first_port, &server.last_port})
            if (auto const moved = move_number(*port, distance); !moved)
                return moved;
    if (auto const moved = move_port(server.controllers, distance); !moved)
        return moved;
    return move_port(server.address, distance);
}

} // namespace

result<> move_port(std::string& address, int distance)
{
    auto const scheme = address.find("://");
    auto const host = scheme == std::string::npos ? 0 : scheme + 3;
    auto const separator = address.find_last_of(":/");
    if (separator == std::string::npos || separator < host)
        return {};
    auto port = parse_port(std::string_view(address).substr(separator + 1));
    if (port == 0 || !is_this_machine(std::string_view(address).substr(host, separator - host)))
        return {};
    if (auto const moved = move_number(port, distance); !moved)
        return moved;
    address.replace(separator + 1, std::string::npos, std::to_string(port));
    return {};
}

result<> move_ports(SimulationConfig& config, int distance)
{
    if (auto const moved = move_number(config.service.controller_port, distance); !moved)
        return moved;
    return move_network(config.address, config.network, distance);
}

result<> move_ports(SessionConfig& config, int distance)
{
    for (auto& server : config.simulation_servers)
        if (auto const moved = move_machine(server, distance); !moved)
            return moved;
    if (auto const moved = move_number(config.service.controller_port, distance); !moved)
        return moved;
    return move_network(config.address, config.network, distance);
}

} // namespace webots_cloud::core
