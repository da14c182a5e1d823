// Parses what the kernel says of the use of graphics processors: "DRM client usage stats" in its
// documentation (drm-usage-stats.rst), since Linux 5.19.
#pragma once

#include <webots_cloud/time.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// An open connection to a graphics processor. Processes may share one, as after a fork.
struct DrmClient
{
    std::string device; ///< Its bus address, or its driver where it has none.
    std::uint64_t id = 0;
    Duration busy{}; ///< Of the engine that it has kept busy longest: rendering, computing, decoding.
};

/// Of a file in `/proc/<pid>/fdinfo`; nothing, if it is of none, or of a driver that does not say.
std::optional<DrmClient> parse_drm_client(std::string_view text);

} // namespace webots_cloud::core
