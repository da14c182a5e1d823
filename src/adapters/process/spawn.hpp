// Starts programs without copying our own process.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <sys/types.h>

namespace webots_cloud::adapters {

/// A program to start, by `posix_spawn`, which blocks until the new program runs: call it on a thread that
/// may wait, since that takes a while when every core is busy.
///
/// Not by the launchers of Boost.Process: see docs/decisions/009-boost-process.md.
struct Spawn
{
    std::string program;
    std::vector<std::string> arguments; ///< Without the program's name.
    std::vector<std::string> environment;
    std::string directory; ///< Empty: ours.
    int input = -1;
    int output = -1; ///< Also for errors.
    int users = -1;  ///< Not -1: a user namespace, which the program gets as descriptor 3.

    Spawn() = default;

    /// Returns: 0 or the errno of the failure, and the number of the new process.
    std::pair<int, pid_t> operator()() const;
};

} // namespace webots_cloud::adapters
