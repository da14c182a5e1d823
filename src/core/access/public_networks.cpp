#include "public_networks.hpp"

#include <algorithm>

namespace webots_cloud::core {

bool is_public_address(IpAddress const& address) noexcept
{
    static IpNetworks const others({non_public_networks.begin(), non_public_networks.end()});
    static IpNetworks const global({"2000::/3"});
    static IpNetworks const from_ipv4({"64:ff9b::/96"});
    // Those that carry an address of IPv4 (6to4, Teredo), which nobody needs any more, and documentation.
    static IpNetworks const not_global({"2001::/23", "2001:db8::/32", "2002::/16"});
    if (from_ipv4.contains(address)) { // the only way to IPv4 in some networks (NAT64)
        IpAddress::Bytes v4{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
        std::copy(address.bytes().begin() + 12, address.bytes().end(), v4.begin() + 12);
        return is_public_address(IpAddress(v4));
    }
    if (address.is_v4())
        return !others.contains(address);
    return global.contains(address) && !not_global.contains(address);
}

} // namespace webots_cloud::core
