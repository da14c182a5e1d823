// Which changed keys of a reloaded configuration need a restart. All others must be taken over by the `apply`
// of a service, which src/app calls: tests/hygiene/reloaded_keys.py finds those that are in neither place.
#pragma once

#include <webots_cloud/config.hpp>

#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Of the keys whose values differ those that take effect at the next start only.
std::vector<std::string_view> keys_for_restart(SessionConfig const& running, SessionConfig const& next);
std::vector<std::string_view> keys_for_restart(SimulationConfig const& running, SimulationConfig const& next);

} // namespace webots_cloud::core
