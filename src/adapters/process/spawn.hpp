// Starts a program without forking ourselves.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <sys/types.h>

namespace webots_cloud::adapters {

/// A program to be started on a thread that may block until the new program runs, which may take a while when
/// every core is busy.
///
/// Not by the launcher of Boost.Process, which forks: that copies our page tables, tells the io_context,
/// which must not run meanwhile, and (in 1.81) leaks our descriptors to the new program, among them the other
/// end of its standard input.
struct Spawn
{
    std::string program;
    std::vector<std::string> arguments; ///< Without the program's name.
    std::vector<std::string> environment;
    std::string directory; ///< Empty: ours.
    int input = -1;
    int output = -1; ///< Also for errors.

    Spawn() = default;

    /// The errno of a failure or 0, and the number of the new process.
    std::pair<int, pid_t> operator()() const;
};

} // namespace webots_cloud::adapters
