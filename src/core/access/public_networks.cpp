#include "public_networks.hpp"

#include <algorithm>

namespace webots_cloud::core {

std::optional<IpAddress> ipv4_behind(IpAddress const& address) noexcept
{
    static IpNetwork const nat64 = *IpNetwork::parse("64:ff9b::/96");
    static IpNetwork const six_to_four = *IpNetwork::parse("2002::/16");
    if (!nat64.contains(address) && !six_to_four.contains(address))
        return std::nullopt;
    IpAddress::Bytes v4{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
    std::copy_n(address.bytes().begin() + (nat64.contains(address) ? 12 : 2), 4, v4.begin() + 12);
    return IpAddress(v4);
}

bool is_public_address(IpAddress const& address) noexcept
{
    static IpNetworks const others({non_public_networks.begin(), non_public_networks.end()});
    static IpNetworks const global({"2000::/3"});
    // Those that carry an address of IPv4 (6to4, Teredo), which nobody needs any more, and documentation.
    static IpNetworks const not_global({"2001::/23", "2001:db8::/32", "2002::/16"});
    if (address.is_v4())
        return !others.contains(address);
    if (not_global.contains(address))
        return false;
    if (auto const v4 = ipv4_behind(address)) // NAT64, the only way to IPv4 in some networks
        return is_public_address(*v4);
    return global.contains(address);
}

} // namespace webots_cloud::core
