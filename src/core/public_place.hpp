// The address of a server without its scheme, and the path in it of a server below a path.
#pragma once

#include <webots_cloud/public_address.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// `/webots`, `/sites/webots`: short, of letters, digits, `-`, `_`, `.` and `~`, without a slash at its end.
bool is_site_path(std::string_view text) noexcept;

/// The same of a machine, `/2000`, `/webots`, `/webots/2000`: a number at its end is a port.
bool is_machine_path(std::string_view text) noexcept;

/// `/webots` of `sim.example.org/webots`, as a view; empty: the name has no path.
std::string_view path_in(std::string_view name) noexcept;

/// Where a server is: `host:2000`, `host/2000`; below a path `host/webots`.
std::string public_place(PublicAddress const& address);

/// Where a port beside its own is: `host:2001`, `host/2001`. Whatever is below a path is behind a proxy, as
/// with `port_rewrite`: `host/webots/2001`.
std::string public_place(PublicAddress const& address, std::uint16_t port);

} // namespace webots_cloud::core
