// The operator's order to drain a machine while the session server runs.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The query of `POST /api/drain`.
struct DrainOrder
{
    std::string machine; ///< Its address, as in its ServerSpec.
    bool off = false;    ///< It is to get sessions again.

    bool operator==(DrainOrder const&) const = default;
};

/// Reads `machine=sim1:2000`, with `off` before or behind it; the address may be percent-encoded.
std::optional<DrainOrder> parse_drain_order(std::string_view query);

} // namespace webots_cloud::core
