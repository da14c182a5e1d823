// A PID namespace for one program: when its first process goes, for whatever reason, the kernel kills all
// others in it.
#pragma once

#include <csignal>

#include <sys/types.h>

namespace webots_cloud::guard {

/// The program to start, and what it gets.
struct Program
{
    char** argv = nullptr;
    sigset_t signals{}; ///< Its signal mask.
    /// Folders that it must not change; where there is no mount namespace it can.
    char const* const* read_only = nullptr;
    int read_only_count = 0;
    bool set_user_id = false; ///< Programs that run as somebody else have to work in it.
};

/// A started program, seen from the guard.
struct Started
{
    /// Our child: the program, or the first process of its namespace, which passes SIGTERM on to it.
    pid_t process = -1;
    int report = -1; ///< Not -1: where that process leaves the program's wait status (an int) before it ends.
    bool own_proc = false;  ///< It has a `/proc` of its own, which shows nobody else's processes.
    bool read_only = false; ///< It can't change any of the folders that were to be read-only.
    int error = 0;          ///< `errno`, where there is no namespace.
};

/// What becomes the program in the new process; does not return.
using Become = void (*)(Program const& program);

/// Starts a program in a PID namespace of its own, where that is allowed: to root, and elsewhere within a
/// user namespace that maps nobody but ourselves. Otherwise `process` is -1 and nothing has happened.
///
/// Where a mount namespace is allowed as well, the read-only folders are so, and `/proc` is its own.
///
/// Inside, the program has the number that we have outside: programs name their files after it, and it stays
/// unique.
Started start_in_namespace(Program const& program, Become become);

} // namespace webots_cloud::guard
