// A program that is run to its end for what it says.
#pragma once

#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>

namespace webots_cloud {

/// What the program printed, at most 4 MiB of it, once it has succeeded.
///
/// Cancellation: terminal; the program is killed.   Errors: `start_failed`, also when it does not exit with
/// 0: the detail is its last line; `timed_out`: it was killed after `limit`.
boost::asio::awaitable<result<std::string>> run_program(ProcessHost& processes, Clock& clock,
                                                        ProcessSpec spec, Duration limit);

} // namespace webots_cloud
