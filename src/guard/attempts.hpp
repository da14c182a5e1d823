// What a simulation must not be able to do, tried.
#pragma once

namespace webots_cloud::guard {

/// Tries to read a file, to connect to a port of the loopback, to signal a process, and to change the
/// system's files and the kernel's settings. Prints `tried`, followed by what was possible: `file`, `port`,
/// `process`, `write`, `kernel`.
/// Returns 0.
int try_forbidden_things(char const* file, int port, int process);

} // namespace webots_cloud::guard
