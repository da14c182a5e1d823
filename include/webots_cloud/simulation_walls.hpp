// What stands between simulations and the machine: whether projects of strangers may run on it.
#pragma once

#include <webots_cloud/export.hpp>

#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What shuts simulations in.
struct SimulationWalls
{
    SimulationWalls() = default;

    bool containers = false; ///< They run in containers.
    /// The sandbox that has passed its test on this machine, as the key `sandbox` names it; empty: none.
    std::string sandbox;
    bool by_name = false; ///< The operator has named the sandbox, rather than left the choice to the server.
    bool limits = false;  ///< Each has limits of memory, processes and so on, which hold.
    bool own_displays = false; ///< No two draw on the same display.
};

} // namespace webots_cloud
