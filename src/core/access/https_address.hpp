// What a port without TLS answers where the server speaks TLS on another one.
#pragma once

#include "site_access.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The address of a request by https. `host`: the Host header, which is kept if it names this server;
/// otherwise `server`, its public name, perhaps with a port. `port`: where it speaks TLS. `target`: path and
/// query.
std::string https_address(std::string_view host, SiteAccess const& site, std::string_view server,
                          std::uint16_t port, std::string_view target);

/// The name of the file in `/.well-known/acme-challenge/<name>` (RFC 8555, section 8.3); empty: another path.
std::string_view challenge_in(std::string_view path) noexcept;

} // namespace webots_cloud::core
