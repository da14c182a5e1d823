// What simulations reach of the network when they may reach the public internet alone.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Where simulations ask for names: slirp4netns passes that on to the machine's own resolver.
inline constexpr std::string_view sandbox_resolver = "nameserver 10.0.2.3\n";

/// Lines for `ip -batch` in the network that slirp4netns serves: networks that are not public, and `own`, the
/// numeric IPv4 addresses of this machine, are unreachable there (the guard adds those that come later); of
/// the resolver nothing but its port 53 is reached. There is no IPv6.
///
/// slirp4netns itself (`--disable-host-loopback`) keeps its gateway, 10.0.2.2, from being this machine's
/// loopback. Its resolver, 10.0.2.3, would be every port of the machine's resolver, which may well be a
/// loopback address.
std::string internet_only_rules(std::vector<std::string> const& own);

} // namespace webots_cloud::core
