// The limits of builds: docker builds without any, and takes some for a container that runs.
#pragma once

#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/time.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The arguments of docker that print, as `build_step` reads it, each container that has started since then,
/// or starts from now on, and has this server as a label: our simulations, and steps of their builds.
std::vector<std::string> watch_starts(std::string_view identity, WallTime since);

/// The container of a line, if it is a step of a build: it is none of compose's, whose limits are in its
/// file.
std::optional<std::string> build_step(std::string_view line);

/// The arguments of docker that limit a container as a simulation is limited; empty: there are no limits.
std::vector<std::string> limit_container(ProcessLimits const& limits, std::string_view container);

} // namespace webots_cloud::core
