// The hosts that a configuration names, whose addresses a server asks a name server for.
#pragma once

#include <webots_cloud/config.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

struct NamedHost
{
    NamedHost() = default;
    NamedHost(std::string_view key, std::string_view name) : key(key), name(name) {}

    std::string key;  ///< Of the configuration, without quotes.
    std::string name; ///< Without a port.

    bool operator==(NamedHost const&) const = default;
};

/// The host of a URL, of `host:port`, or of `host/port`, without the brackets of IPv6.
std::string_view host_in(std::string_view address) noexcept;

/// Each name once, in the order of the keys; no numeric addresses. Of a machine with an `internal` address,
/// it is that one: nobody here asks for the other.
std::vector<NamedHost> named_hosts(SessionConfig const& config);
std::vector<NamedHost> named_hosts(SimulationConfig const& config);

} // namespace webots_cloud::core
