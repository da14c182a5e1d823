// A PID namespace for one program: when its first process ends, for whatever reason, the kernel kills all
// others in it.
#pragma once

#include "limits.hpp"
#include "network.hpp"
#include "user.hpp"

#include <csignal>

#include <sys/types.h>

namespace webots_cloud::guard {

/// A container of compose's.
struct Container
{
    char const* docker = nullptr; ///< The program, absolute.
    char const* label = nullptr;  ///< `<key>=<value>`, which no other container has.
};

/// The program to start.
struct Program
{
    char** argv = nullptr;
    sigset_t signals{}; ///< Its signal mask.
    /// Folders that it must not change; this needs a mount namespace.
    char const* const* read_only = nullptr;
    int read_only_count = 0;
    bool set_user_id = false; ///< Set-user-ID programs must work in it.
    /// Not null: it makes a sandbox with a PID namespace itself, and keeps its files in this folder, which is
    /// empty and in memory for it. Needs root.
    char const* own_sandbox = nullptr;
    /// The sockets of X servers outside and inside are hidden from each other. Needs a mount namespace:
    /// without one the program is not started.
    bool own_displays = false;
    /// Pairs of a descriptor and a file that it gets open there, or, where that is impossible, an empty one.
    char const* const* opened = nullptr;
    int opened_count = 0;
    /// Files and folders that it gets as standard input, packed by `tar`; absolute.
    char const* const* sent = nullptr;
    int sent_count = 0;
    int end_signal = SIGTERM; ///< Asks it to end.
    bool is_job = false;      ///< Our standard error is ours alone: it gets our output in place of it.
    User user;                ///< Who runs it; another one only where we are root.
    Limits limits;
    Network network; ///< Needs namespaces: without them the program is not started.
    Container
        container; ///< With a program `docker`: the network is the container\'s, see container_network.hpp.
};

/// A started program, as seen by the guard.
struct Started
{
    /// Our child: the program, or the first process of its namespace, which passes SIGTERM on to it.
    pid_t process = -1;
    /// Not -1: a pipe to which that process writes the program's wait status (an int) before it ends.
    int report = -1;
    /// Not -1: a pipe in which one byte comes when the program's port can be reached from outside.
    int listening = -1;
    bool own_proc = false;  ///< It has a `/proc` of its own, which shows only processes of the namespace.
    bool read_only = false; ///< It can change none of the folders that must be read-only.
    int error = 0;          ///< `errno`, where there is no namespace.
    NetworkFailure network_failure = NetworkFailure::nothing; ///< Why, where it is the network's fault.
};

/// Executes the program in the new process; does not return.
using Execute = void (*)(Program const& program);

/// Starts a program in a PID namespace of its own, where that is allowed: as root, or within a user namespace
/// that maps only our own user. Otherwise `process` is -1 and nothing has been started.
///
/// Where a mount namespace is allowed as well, the read-only folders are mounted read-only, and `/proc` shows
/// the namespace only.
///
/// A program that makes a sandbox itself gets a mount namespace without a PID namespace.
///
/// Inside, the program has the process number that the guard has outside: programs name files after it, and
/// so it stays unique.
Started start_in_namespace(Program const& program, Execute execute);

} // namespace webots_cloud::guard
