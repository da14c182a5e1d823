// This machine's place in its networks, and its ports.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::site {

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

/// Those where the other machines of our networks find us: neither of this machine alone, nor of containers
/// and virtual machines.
std::vector<std::string> shared_addresses(std::vector<InterfaceAddress> const& all);

/// Of the interfaces that are up.
std::vector<InterfaceAddress> interface_addresses();

/// Whether somebody listens on the port, so that a server with this address to listen on would not get it,
/// or would not get its visitors: those that call this machine localhost ask `::1` first.
bool is_taken(std::string const& listen_address, std::uint16_t port);

} // namespace webots_cloud::site
