// Starts the configured simulator with an empty world, as a visitor's start would: by the parts of the server
// that fetch a project and start a simulation, with the walls that the trial of the machine has found.
#pragma once

#include "core/doctor/finding.hpp"

#include "app/simulation_machine.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/transport/clock.hpp>

#include <boost/asio/awaitable.hpp>

#include <filesystem>

namespace webots_cloud::app {

/// How long the simulator has to load the empty world.
inline constexpr Duration empty_start_limit = std::chrono::seconds(20);

/// `folder`: an existing one of ours, for the world. Not for containers and jobs of a cluster.
///
/// Lifetime: what is passed by reference must outlive the operation. The trial of `machine` is good.
/// Cancellation: terminal; the simulator is killed.
boost::asio::awaitable<core::Finding> try_start(SimulationConfig const& configured,
                                                SimulationMachine const& machine,
                                                std::filesystem::path const& folder, Clock& clock);

} // namespace webots_cloud::app
