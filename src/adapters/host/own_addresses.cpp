#include "core/access/interface_addresses.hpp"

#include <webots_cloud/adapters/host.hpp>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <algorithm>
#include <memory>

namespace webots_cloud {
namespace {

/// Of one family; empty: of another one.
std::string text_of(sockaddr const* address, int family)
{
    if (!address || address->sa_family != family)
        return {};
    void const* bytes = nullptr;
    if (family == AF_INET)
        bytes = &reinterpret_cast<sockaddr_in const*>(address)->sin_addr;
    else
        bytes = &reinterpret_cast<sockaddr_in6 const*>(address)->sin6_addr;
    char text[INET6_ADDRSTRLEN] = "";
    return ::inet_ntop(family, bytes, text, sizeof text) ? text : "";
}

using Interfaces = std::unique_ptr<ifaddrs, void (*)(ifaddrs*)>; // the first of a list; null: none is known

Interfaces interfaces()
{
    ifaddrs* first = nullptr;
    if (::getifaddrs(&first) != 0)
        first = nullptr;
    return {first, ::freeifaddrs};
}

std::vector<std::string> own_addresses_of(int family)
{
    auto const all = interfaces();
    std::vector<std::string> addresses;
    for (auto const* each = all.get(); each; each = each->ifa_next)
        if (auto text = text_of(each->ifa_addr, family); !text.empty())
            addresses.push_back(std::move(text));
    std::sort(addresses.begin(), addresses.end());
    addresses.erase(std::unique(addresses.begin(), addresses.end()), addresses.end());
    return addresses;
}

} // namespace

std::vector<std::string> own_ipv4_addresses()
{
    return own_addresses_of(AF_INET);
}

std::vector<std::string> own_ipv6_addresses()
{
    return own_addresses_of(AF_INET6);
}

std::vector<std::string> shared_ipv4_addresses()
{
    auto const all = interfaces();
    std::vector<core::InterfaceAddress> addresses;
    for (auto const* each = all.get(); each; each = each->ifa_next)
        if (auto text = text_of(each->ifa_addr, AF_INET); !text.empty() && (each->ifa_flags & IFF_UP) != 0)
            addresses.emplace_back(each->ifa_name, std::move(text));
    return core::shared_addresses(addresses);
}

} // namespace webots_cloud
