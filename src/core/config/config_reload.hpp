// What a running server takes over from a configuration that it reads again, on SIGHUP.
#pragma once

#include <webots_cloud/config.hpp>

#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Names of keys whose values have changed.
struct ConfigChanges
{
    std::vector<std::string_view> applied; ///< They have been copied to what is in force.
    std::vector<std::string_view> waiting; ///< They take effect at the next start.
};

/// Copies what SIGHUP applies from `next` to `in_force`, as the table of keys says.
ConfigChanges take_reloaded(SessionConfig& in_force, SessionConfig const& next);
ConfigChanges take_reloaded(SimulationConfig& in_force, SimulationConfig const& next);

} // namespace webots_cloud::core
