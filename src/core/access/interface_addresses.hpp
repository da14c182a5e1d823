// Where the other machines of our networks find this one.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// An address of IPv4 of one of this machine's interfaces.
struct InterfaceAddress
{
    InterfaceAddress() = default;
    InterfaceAddress(std::string interface, std::string address)
        : interface(std::move(interface)), address(std::move(address))
    {}

    std::string interface; ///< As `eth0`.
    std::string address;
};

/// Those where others find us: neither of this machine alone, nor of containers and virtual machines.
std::vector<std::string> shared_addresses(std::vector<InterfaceAddress> const& all);

} // namespace webots_cloud::core
