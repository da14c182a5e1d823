// Programs that are run to their end, without an event loop.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <string>
#include <vector>

namespace webots_cloud::adapters {

/// How a program has ended.
struct ProgramEnd
{
    ProgramEnd() = default;

    int status = 0;     ///< Its exit status; of one that a signal has ended: 128 and the number of that.
    std::string output; ///< On both of its outputs, at most a megabyte.
};

/// Runs a program to its end; `command` begins with its path. It is killed after `limit`. Blocks.
///
/// Errors: `start_failed`; `timed_out`.
/// Thread-safety: any thread.
result<ProgramEnd> run_program(std::vector<std::string> const& command, Duration limit);

/// What such a program prints.
///
/// Errors: `start_failed`, with what it printed, also where it exits with another status than 0; `timed_out`.
/// Thread-safety: any thread.
result<std::string> program_output(std::vector<std::string> const& command, Duration limit);

} // namespace webots_cloud::adapters
