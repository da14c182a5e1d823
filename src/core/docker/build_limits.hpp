// The limits of builds: docker builds without any, and takes some for a container that runs.
#pragma once

#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/time.hpp>

#include <cstdint>
#include <map>
#include <optional>
#include <set>
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

/// The arguments of docker that list those of the containers that run, and what each has written, as
/// `read_step_sizes` reads it.
std::vector<std::string> list_step_sizes(std::set<std::string> const& containers);

/// The bytes that each container of the listing has written.
std::map<std::string, std::uint64_t> read_step_sizes(std::string_view listing);

} // namespace webots_cloud::core
