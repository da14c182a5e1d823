// Moves a site to other ports, all by the same distance: what `--move-ports` does.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>

#include <cstdint>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The server's own ports. Errors: `invalid_argument`: one of them would be no port.
result<> move_ports(SimulationConfig& config, int distance);

/// The same, and those of the entries of `simulationServers` on this machine: `localhost`, an address of the
/// loopback, or `*`. Others stay where they are.
result<> move_ports(SessionConfig& config, int distance);

/// `localhost:2000`, `*/2000`, `https://localhost:2000`: another port, where the host is this machine.
/// Errors: `invalid_argument`: that would be no port.
result<> move_port(std::string& address, int distance);

} // namespace webots_cloud::core
