// The last steps before a program runs, in the process that then is the program.
#pragma once

#include "pid_namespace.hpp"

namespace webots_cloud::guard {

/// Executes a program of the server's, within its limits.
[[noreturn]] void execute(Program const& program);

/// The same for programs that we do not trust: as their user, and without privileges.
[[noreturn]] void execute_confined(Program const& program);

/// The same where there is no PID namespace.
[[noreturn]] void execute_confined_without_namespace(Program const& program);

} // namespace webots_cloud::guard
