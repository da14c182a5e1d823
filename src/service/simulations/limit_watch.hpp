// Looks after the limits of running simulations, and ends those that overrun them.
#pragma once

#include "simulation_session.hpp"
#include "status_endpoints.hpp"

#include <webots_cloud/transport/folder_meter.hpp>

namespace webots_cloud {

/// Looks once a second at the memory and the processes of all simulations, one after the other.
///
/// Lifetime: `context` and `sessions` must outlive the operation.
/// Cancellation: terminal.
boost::asio::awaitable<result<>> watch_processes(SessionContext& context, SimulationSessions const& sessions);

/// Looks at what lies in the folders of all simulations, one after the other: once a second, but less often
/// where that takes long, unless the disk is nearly full.
///
/// Lifetime: everything passed by reference must outlive the operation.
/// Cancellation: terminal.
boost::asio::awaitable<result<>> watch_folders(SessionContext& context, SimulationSessions const& sessions,
                                               FolderMeter& meter);

} // namespace webots_cloud
