#include <webots_cloud/adapters/host.hpp>

#include <arpa/inet.h>
#include <ifaddrs.h>
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

std::vector<std::string> own_addresses_of(int family)
{
    ifaddrs* first = nullptr;
    if (::getifaddrs(&first) != 0)
        return {};
    std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> const all(first, ::freeifaddrs);
    std::vector<std::string> addresses;
    for (auto const* each = first; each; each = each->ifa_next)
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

} // namespace webots_cloud
