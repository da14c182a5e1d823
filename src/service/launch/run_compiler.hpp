// Runs a compiler for a simulation, and keeps what it prints.
#pragma once

#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>

namespace webots_cloud {

/// See `Simulation::compile`. `controller`: its name, for messages.
///
/// Lifetime: `processes` and `clock` must outlive the operation.
/// Cancellation: terminal; the compiler has ended when this has.
boost::asio::awaitable<Compilation> run_compiler(ProcessHost& processes, Clock& clock, ProcessSpec spec,
                                                 std::string controller);

} // namespace webots_cloud
