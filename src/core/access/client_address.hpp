// Who sent a request that came through proxies.
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

/// Who sent a request that a trusted proxy passed on: of the entries of X-Forwarded-For, over all its fields,
/// the rightmost that is no trusted proxy; what stands left of it is what the client claims. When all are
/// trusted, or the next one can't be read: the last one that could. Nothing when there is none.
///
/// Forwarded (RFC 7239) counts only where X-Forwarded-For says nothing, for a proxy that writes the one
/// passes on what its client sent of the other.
std::optional<IpAddress> forwarded_client(HeaderFields fields, IpNetworks const& proxies);

} // namespace webots_cloud::core
