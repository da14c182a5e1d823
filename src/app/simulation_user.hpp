// Which user simulations run as on this machine.
#pragma once

#include "sandbox.hpp"

#include <webots_cloud/simulation_user.hpp>

namespace webots_cloud::app {

/// Does what the key `simulationUser` says, and tries whether it works: the user must reach Webots, and be
/// kept from the server. Where nobody asked for a user and it does not work, simulations run as the server's,
/// with a warning.
/// Errors: `start_failed`: the user that the operator asked for can't be had.
boost::asio::awaitable<result<SimulationUser>> choose_simulation_user(SimulationConfig const& config,
                                                                      SandboxContext context,
                                                                      ProcessHost& processes, Clock& clock,
                                                                      Logger log);

/// Writes into the log who runs simulations, where it is not the server's user.
void tell_user(SimulationUser const& user, Logger const& log);

} // namespace webots_cloud::app
