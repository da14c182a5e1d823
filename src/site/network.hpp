// The ports of this machine.
#pragma once

#include <cstdint>
#include <string>

namespace webots_cloud::site {

/// Whether somebody listens on the port, so that a server with this address to listen on would not get it,
/// or would not get its visitors: those that call this machine localhost ask `::1` first.
bool is_taken(std::string const& listen_address, std::uint16_t port);

} // namespace webots_cloud::site
