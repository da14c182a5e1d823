// The host that is reached through a proxy: libcurl shows the proxy's address alone, so only the name of the
// host says it.
#pragma once

#include "core/access/ip_address.hpp"

#include <string>
#include <vector>

namespace webots_cloud::adapters {

/// The environment names a proxy that libcurl may use. (Hosts of `no_proxy` are reached without it.)
bool has_proxy();

/// The addresses that a name means on this machine, or that it spells; empty: none. Blocks as long as
/// the system's resolver does, which its configuration bounds.
std::vector<core::IpAddress> addresses_of(std::string const& host);

} // namespace webots_cloud::adapters
