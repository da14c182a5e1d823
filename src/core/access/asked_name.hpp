// The name `*` of a server: browsers are sent to the host that they asked, whatever they call it. For a
// class, whose machines know the teacher's by an address that changes.
#pragma once

#include <webots_cloud/public_address.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// `server` of a configuration.
inline constexpr std::string_view asked_name = "*";

/// Where a browser reaches us whose request had this `Host`: with the name `*` the host it asked; where a
/// port is part of the path (`port_rewrite`), with the port that it asked. A missing or malformed header:
/// `localhost`.
PublicAddress reached_at(PublicAddress address, std::string_view host);

/// The same for an entry of `simulationServers`: `*/2000` or `*:2000`. Others are returned as they are.
std::string machine_reached_at(std::string_view machine, std::string_view host);

/// `/2000` of the entry `sim.example.org/2000` where that is our own name and browsers reach us at a port of
/// our own, without a proxy: there they find the machine too, rather than at the usual port, which is
/// somebody else's. Empty: the entry is an address as it stands. A view into `machine`.
std::string_view path_at_own_port(PublicAddress const& own, std::string_view machine) noexcept;

/// What follows `ws://` in the address of this server, for a browser whose request had this `Host`: as it
/// asked, where that is the server's name or one of `names`, or where the server has no name but `localhost`.
/// Others have come through a proxy that puts a name of its own there.
std::string own_authority(PublicAddress const& address, std::vector<std::string> const& names,
                          std::string_view host);

} // namespace webots_cloud::core
