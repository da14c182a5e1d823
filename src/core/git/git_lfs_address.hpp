// Where large files may be fetched from: the addresses come from a server, and name any host.
#pragma once

#include <webots_cloud/error.hpp>

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The part of a URL before its path, as it is written there: `https://host`.
std::string_view base_of(std::string_view url) noexcept;

/// Its host, in small letters, IPv6 without brackets; empty: none of HTTP.
std::string host_of_lfs_address(std::string_view url);

/// Whether a file of the repository on `forge` may come from `url`: HTTPS, or HTTP where the forge speaks
/// that; no name or address that only means something here, unless the forge has one too. Numbers behind
/// names are `is_public_address`'s.
///
/// Errors: `refused`, the detail being words about the server.
result<> check_lfs_address(std::string_view url, std::string_view forge);

} // namespace webots_cloud::core
