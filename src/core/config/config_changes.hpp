// Which changed keys of a reloaded configuration need a restart.
#pragma once

#include <webots_cloud/config.hpp>

#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The keys whose values differ and that take effect at the next start only.
std::vector<std::string_view> keys_for_restart(SessionConfig const& running, SessionConfig const& next);
std::vector<std::string_view> keys_for_restart(SimulationConfig const& running, SimulationConfig const& next);

} // namespace webots_cloud::core
