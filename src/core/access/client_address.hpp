// Finds the client of a request that came through proxies.
#pragma once

#include "ip_address.hpp"

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::core {

using HeaderFields = std::span<std::pair<std::string_view, std::string_view> const>;

/// The client of a request that a trusted proxy passed on: of the entries of X-Forwarded-For, over all its
/// fields, the rightmost that is not a trusted proxy; entries left of it may be forged by the client. When
/// all are trusted, or the next one is malformed: the last valid one. Nothing when there is none.
///
/// Forwarded (RFC 7239) is used only without X-Forwarded-For, because a proxy that writes one of them
/// passes on the other as its client sent it.
std::optional<IpAddress> forwarded_client(HeaderFields fields, IpNetworks const& proxies);

} // namespace webots_cloud::core
