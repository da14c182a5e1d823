// Where browsers reach a server: the address before the path of a request.
#pragma once

#include <webots_cloud/public_address.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// What the gateway of a session server says to a machine that browsers reach below a path of its own:
/// `wss://sim.example.org/machine/abc`. Only it knows that; the machine tells its browsers.
inline constexpr std::string_view public_address_header = "Webots-Cloud-Address";

/// `ws://host:2000`, `wss://host/2000`, `wss://host/webots`.
std::string public_base(PublicAddress const& address);

/// What that header says, if it makes sense: `ws://` or `wss://`, a host, and a path as `is_site_path` knows
/// it, or none.
std::optional<std::string> parse_public_base(std::string_view text);

} // namespace webots_cloud::core
