// The network of a container that Docker starts, in place of one of Docker's.
#pragma once

#include "pid_namespace.hpp"

namespace webots_cloud::guard {

/// Executes `program`, which has Docker start a container that has no network (`network_mode: none`), and
/// gives that container the program's network as soon as it runs. Needs root.
///
/// Until then the container reaches nothing; the rules hold before it reaches anything. When its network
/// can't be made, a line says why, and the program is asked to end. Exits with the status of the program.
[[noreturn]] void run_beside_container(Program const& program, Execute execute);

} // namespace webots_cloud::guard
