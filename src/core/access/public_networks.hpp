// Which numeric addresses belong to the public internet.
#pragma once

#include "ip_address.hpp"

#include <array>
#include <optional>

namespace webots_cloud::core {

/// Networks of IPv4 that are not: the machine itself, private, link-local and shared networks, and those
/// without hosts (RFC 6890).
inline constexpr std::array<char const*, 13> non_public_networks{
    "0.0.0.0/8",       "10.0.0.0/8",     "100.64.0.0/10", "127.0.0.0/8",    "169.254.0.0/16",
    "172.16.0.0/12",   "192.0.0.0/24",   "192.0.2.0/24",  "192.168.0.0/16", "198.18.0.0/15",
    "198.51.100.0/24", "203.0.113.0/24", "224.0.0.0/3"};

/// The address of IPv4 that one of IPv6 leads to: through NAT64 (64:ff9b::/96, RFC 6052) or 6to4 (2002::/16,
/// RFC 3056). It is to be judged as that one.
std::optional<IpAddress> ipv4_behind(IpAddress const& address) noexcept;

/// False for addresses of those networks, and for their like in IPv6.
bool is_public_address(IpAddress const& address) noexcept;

} // namespace webots_cloud::core
