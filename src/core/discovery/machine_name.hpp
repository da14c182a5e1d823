// Entries of "simulationServers" that stand for the machines of a name.
#pragma once

#include "core/access/ip_address.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// `dns:<name>:<port>`: every address of the name, at that port; or `srv:<service>`: the machines of the
/// service's records SRV (RFC 2782).
struct MachineName
{
    MachineName() = default;

    bool is_service = false;
    std::string name;
    std::uint16_t port = 0; ///< Of a service: 0.
};

/// Whether an entry begins as one of these: if it is none, it is wrong.
bool is_machine_name(std::string_view entry) noexcept;

std::optional<MachineName> parse_machine_name(std::string_view entry);

/// How the machine at a numeric address is called: `10.0.0.2:2000`, `[2001:db8::2]:2000`.
std::string machine_at(IpAddress const& address, std::uint16_t port);

/// What has no machine behind it that browsers could be sent to, whatever a name server or an announcement
/// says: unspecified, link-local, multicast and reserved addresses; and, but for `loopback`, this machine's
/// own.
bool is_machine_address(IpAddress const& address, bool loopback);

/// The same of a name: `localhost`, and what is below it, is the loopback.
bool is_machine_host(std::string_view host, bool loopback);

} // namespace webots_cloud::core
