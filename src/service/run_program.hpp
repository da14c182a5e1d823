// Runs a program to its end, for its output.
#pragma once

#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>

namespace webots_cloud {

/// Runs a program.   Returns: what it printed, at most 4 MiB, when it has exited with status 0.
///
/// Cancellation: terminal; the program is killed.
/// Errors: `start_failed`, also when it exits with another status: the detail is the last line of its output;
/// `timed_out`: it was killed after `limit`.
boost::asio::awaitable<result<std::string>> run_program(ProcessHost& processes, Clock& clock,
                                                        ProcessSpec spec, Duration limit);

} // namespace webots_cloud
