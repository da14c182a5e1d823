#include "interface_addresses.hpp"

#include "ip_address.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace webots_cloud::core {
namespace {

/// Of containers and virtual machines.
constexpr std::array<std::string_view, 7> inner_interfaces{"docker", "br-",    "veth", "virbr",
                                                           "lxc",    "podman", "cni"};

} // namespace

std::vector<std::string> shared_addresses(std::vector<InterfaceAddress> const& all)
{
    static auto const loopback = IpNetwork::parse("127.0.0.0/8");
    static auto const link_local = IpNetwork::parse("169.254.0.0/16");
    std::vector<std::string> shared;
    for (auto const& each : all) {
        auto const address = IpAddress::parse(each.address);
        bool const is_inner = std::ranges::any_of(inner_interfaces, [&](std::string_view name) {
            return std::string_view(each.interface).starts_with(name);
        });
        if (address && !is_inner && !loopback->contains(*address) && !link_local->contains(*address))
            shared.push_back(each.address);
    }
    return shared;
}

} // namespace webots_cloud::core
