// Starts servers that go on without us and without the terminal, and ends them.
#pragma once

#include "servers.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <string>
#include <vector>

namespace webots_cloud::site {

/// From now on SIGINT and SIGTERM do not end us: `is_interrupted` says that one has come. A terminal that is
/// closed, and an output that nobody reads, are nothing to us.
void take_signals();
bool is_interrupted() noexcept;

/// Standard input, output and errors that are closed are opened, on /dev/null: no file of ours may get their
/// numbers, and with them what is said to people.
void open_standard_files();

/// `command` begins with the path of the program. It gets a session of its own, no input, and `console` for
/// its outputs, which is closed here.
/// Errors: `start_failed`.
result<pid_t> start_detached(std::vector<std::string> const& command, int console);

/// Sends SIGTERM and waits.   Errors: `refused`: it belongs to another user; `timed_out`.
result<> end_process(Process const& process, Duration limit);

/// Between two looks at something.
void pause_a_moment();

} // namespace webots_cloud::site
