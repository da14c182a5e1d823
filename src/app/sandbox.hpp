// Which sandbox simulations get on this machine.
#pragma once

#include "remarks.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/sandbox.hpp>
#include <webots_cloud/simulation_walls.hpp>

#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <string>

namespace webots_cloud::app {

/// What the sandbox has to do with.
struct SandboxContext
{
    SandboxContext() = default;

    std::filesystem::path simulator; ///< Webots, absolute.
    std::filesystem::path guard;     ///< `webots-process-guard`, absolute.
    SimulationUser user;             ///< Who runs simulations.
    std::filesystem::path state;     ///< An existing folder of ours, for files of the sandbox.
};

struct ChosenSandbox
{
    ChosenSandbox() = default;

    SandboxParams params;
    SimulationWalls walls;   ///< But for limits and displays.
    std::string description; ///< For the monitor page, as in "bubblewrap, public internet only".
    std::string warning;     ///< A sentence: simulations are not confined, although nobody asked for that.
};

/// The network of simulations in containers, as the key `network` says.
struct ContainerNetwork
{
    ContainerNetwork() = default;

    ProcessNetwork network;  ///< `host` is what Docker's own networks reach.
    std::string name_server; ///< For `internet`.
    std::string description; ///< For the monitor page, as in "Docker, public internet only".
};

/// `state` is an existing folder of ours. Where the network can't be made, it is Docker's, with a warning.
ContainerNetwork choose_container_network(SimulationConfig const& config, std::filesystem::path const& state,
                                          Remarks& remarks);

/// Does what the keys `sandbox` and `network` say, and tries whether it holds.
/// Lifetime: all but `context` must outlive the operation.
/// Errors: `start_failed`: the sandbox that the operator asked for by name does not work here.
boost::asio::awaitable<result<ChosenSandbox>> choose_sandbox(SimulationConfig const& config,
                                                             SandboxContext context, ProcessHost& processes,
                                                             Clock& clock, Remarks& remarks);

} // namespace webots_cloud::app
