// A simulation server keeps to its own files.
#pragma once

#include "core/config/simulation_files.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>

namespace webots_cloud::app {

/// From now on this thread, and every one that it starts, can open only the files that a simulation server
/// needs. Its parts that start programs, look at them, or mount, must exist already. Of `context` the socket
/// is found out, and paths may be relative.
///
/// Errors: `unavailable`: the kernel can't do that; everything goes on as before.
result<> confine_simulation_server(SimulationConfig config, core::SimulationFilesContext context);

} // namespace webots_cloud::app
