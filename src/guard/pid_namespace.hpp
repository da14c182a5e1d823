// A PID namespace for one program: when its first process goes, for whatever reason, the kernel kills all
// others in it.
#pragma once

#include <csignal>

#include <sys/types.h>

namespace webots_cloud::guard {

/// A started program, seen from the guard.
struct Started
{
    pid_t process =
        -1; ///< Our child: the program, or the first process of its namespace, which passes SIGTERM on to it.
    int report = -1; ///< Not -1: where that process leaves the program's wait status (an int) before it ends.
};

/// What becomes the program in the new process; does not return.
using Become = void (*)(char** argv, sigset_t const& signals);

/// Starts a program in a PID namespace of its own, where that is allowed: to root, and elsewhere within a
/// user namespace that maps nobody but ourselves. Otherwise `process` is -1 and nothing has happened.
///
/// Inside, the program has the number that we have outside: programs name their files after it, and it stays
/// unique.
Started start_in_namespace(char** argv, sigset_t const& signals, Become become);

} // namespace webots_cloud::guard
