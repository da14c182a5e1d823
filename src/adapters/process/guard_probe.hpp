// What a guard can do on this machine, for the start of a server.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/clock.hpp>

#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

/// What that guard can do here, as its option `--probe` prints it: one line, which is no stable format. Not
/// empty: the guard can be run.
///
/// Errors: `start_failed`, `timed_out` after 15 seconds.
/// Cancellation: terminal.
boost::asio::awaitable<result<std::string>>
probe_guard(std::filesystem::path guard, std::vector<std::filesystem::path> read_only, Clock& clock);

} // namespace webots_cloud::adapters
