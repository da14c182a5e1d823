// Where browsers are sent, by where they have asked: the name `*` of a server, for a class, whose machines
// know the teacher's by an address that changes; and the path and the scheme of a proxy in front.
#pragma once

#include "client_address.hpp"

#include <webots_cloud/public_address.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// `server` of a configuration.
inline constexpr std::string_view asked_name = "*";

/// Where a request has asked for us. Only what a trusted proxy writes is believed of path and scheme, and of
/// several fields the last, which is its own.
AskedAddress asked_address(HeaderFields fields, bool is_from_proxy);

/// The port of the page at `origin` that has asked for `host`, which is its own without that port: a proxy
/// has left it out, or the page is another site's on that host. Empty: neither.
std::string_view port_left_out(std::string_view origin, std::string_view host) noexcept;

/// Where a browser reaches us: with the name `*` at the host it asked; where a port is part of the path
/// (`port_rewrite`), with the port that it asked. A missing or malformed header: `localhost`. A proxy that
/// names a path, or says that it speaks TLS, is right about itself; one that says nothing of TLS may have
/// another before it.
PublicAddress reached_at(PublicAddress address, AskedAddress const& asked);

/// Where it reaches an entry of `simulationServers` without us, `ws://...`: `*/2000` and `*:2000` at the host
/// that it asked, others as they are.
std::string machine_reached_at(std::string_view machine, PublicAddress const& own, AskedAddress const& asked);

/// `/2000` of the entry `sim.example.org/2000` where that is our own name and browsers reach us at a port of
/// our own, without a proxy: there they find the machine too, rather than at the usual port, which is
/// somebody else's. Empty: the entry is an address as it stands. A view into `machine`.
std::string_view path_at_own_port(PublicAddress const& own, std::string_view machine) noexcept;

/// Whether a proxy has us below a path, or speaks TLS of which the configuration does not know.
bool is_placed_by_proxy(PublicAddress const& own, AskedAddress const& asked) noexcept;

/// `/2000` of the same entry where a proxy has placed us so: what we pass on is found there as well. Empty:
/// the entry is an address as it stands, or not at one of our names. A view into `machine`.
std::string_view path_behind_proxy(PublicAddress const& own, std::vector<std::string> const& names,
                                   AskedAddress const& asked, std::string_view machine);

/// Where this server is, `ws://...`, for a browser that has asked so: the host as it asked, where that is the
/// server's name or one of `names`, or where the server has no name but `localhost`. Others have come through
/// a proxy that puts a name of its own there.
std::string own_base(PublicAddress const& address, std::vector<std::string> const& names,
                     AskedAddress const& asked);

} // namespace webots_cloud::core
