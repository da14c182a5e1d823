// Entries of "simulationServers" that stand for the machines of a name.
#pragma once

#include "core/access/ip_address.hpp"

#include <webots_cloud/server_spec.hpp>

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

/// The entry that says how machines are treated that announce themselves. It stands for no machine itself.
inline constexpr std::string_view announced_entry = "announced";

/// Whether an entry stands for machines that are found: `announced`, or a name.
bool stands_for_found(std::string_view entry) noexcept;

/// What the key `internal` says of machines that are found: browsers reach them through the session server
/// alone, and the session server reaches them
struct WayInside
{
    WayInside() = default;

    bool tls = false; ///< by `https`, or by `http`.
    std::string name; ///< `https://<name>`: what their certificates are for, unless empty.
};

std::optional<WayInside> parse_way_inside(std::string_view text);

/// Of a found machine, which is treated as its entry says: where it is reached from inside, if that is what
/// the entry says. By `http` only at an address: a name could lead anywhere by the time that it is looked up.
/// False: the entry wants it to be reached inside, and that is not possible.
bool reach_inside(ServerSpec& machine, std::optional<MachineName> const& name);

/// How the machine at a numeric address is called: `10.0.0.2:2000`, `[2001:db8::2]:2000`.
std::string machine_at(IpAddress const& address, std::uint16_t port);

/// What has no machine behind it that browsers could be sent to, whatever a name server or an announcement
/// says: unspecified, link-local, multicast and reserved addresses; and, but for `loopback`, this machine's
/// own. Addresses that lead to one of IPv4 (`ipv4_behind`) are judged as that one.
bool is_machine_address(IpAddress const& address, bool loopback);

/// The same of a name: `localhost`, and what is below it, is the loopback.
bool is_machine_host(std::string_view host, bool loopback);

} // namespace webots_cloud::core
