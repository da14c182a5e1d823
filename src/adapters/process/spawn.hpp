// Starts programs without copying our own process.
#pragma once

#include <chrono>
#include <cstddef>
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

/// How a started program has ended.
struct SpawnEnd
{
    SpawnEnd() = default;

    bool in_time = false; ///< Else it was killed.
    int status = 0;       ///< As `waitpid` says.
    std::string output;   ///< The first of it.
};

/// Reads what a program prints, at most `most` bytes, and waits for its end, also where it closes its output
/// before: until `limit` is over, when it is killed. For a thread that may wait.
SpawnEnd await_end(pid_t process, int output, std::size_t most, std::chrono::milliseconds limit);

} // namespace webots_cloud::adapters
