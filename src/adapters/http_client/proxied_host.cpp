#include "proxied_host.hpp"

#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>

namespace webots_cloud::adapters {

bool has_proxy()
{
    // https://everything.curl.dev/usingcurl/proxies/env.html
    constexpr std::array names{"http_proxy", "https_proxy", "HTTPS_PROXY", "all_proxy", "ALL_PROXY"};
    return std::any_of(names.begin(), names.end(), [](char const* name) {
        auto const* const value = std::getenv(name);
        return value && *value;
    });
}

std::vector<core::IpAddress> addresses_of(std::string const& host)
{
    ::addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    ::addrinfo* found = nullptr;
    if (::getaddrinfo(host.c_str(), nullptr, &hints, &found) != 0)
        return {};
    std::unique_ptr<::addrinfo, decltype(&::freeaddrinfo)> const all(found, ::freeaddrinfo);
    std::vector<core::IpAddress> addresses;
    for (auto const* each = found; each; each = each->ai_next) {
        std::array<char, NI_MAXHOST> text{};
        if (::getnameinfo(each->ai_addr, each->ai_addrlen, text.data(), text.size(), nullptr, 0,
                          NI_NUMERICHOST) != 0)
            continue;
        if (auto const address = core::IpAddress::parse(text.data()))
            addresses.push_back(*address);
    }
    return addresses;
}

} // namespace webots_cloud::adapters
