// The two servers, assembled: every part made from a configuration, connected, and run. What the programs are
// made of. What concerns a whole process is left to the program: which signals end it, that SIGPIPE does not,
// and, where simulations run as its user, that they can't trace it. examples/05_embed_both.cpp does all that.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <functional>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Reads a configuration again, on SIGHUP; empty: SIGHUP is left alone.
///
/// Called on a thread of the server, never twice at a time, and never after the server has ended, which waits
/// for it. Must not throw.
template<class Config>
using Reload = std::function<result<Configured<Config>>()>;

/// Runs a session server until cancelled.
///
/// SIGHUP applies the keys that docs/configuration.md marks so; browsers stay connected.
///
/// Errors: `operation_aborted` when cancelled; `unavailable` when the port is in use; `invalid_argument`.
/// Thread-safety: one executor, on one thread.
boost::asio::awaitable<result<>> serve_sessions(boost::asio::any_io_executor executor, SessionConfig config,
                                                Reload<SessionConfig> reload, Logger log);

/// Runs a simulation server until cancelled; then every simulation is ended first.
///
/// SIGHUP applies the keys that docs/configuration.md marks so; simulations go on, and registries are told of
/// a new `allowedRepositories` and `shareIdleTime`.
///
/// `programs` is the folder of `webots-process-guard` and `webots-demo-simulator`.
///
/// `config_file` is for programs that do nothing else: it is where the configuration comes from, and once
/// everything is set up the calling thread, and those that it starts from then on, can open only the files
/// that such a server needs (Landlock, where the kernel has it), and mount and execute nothing, until the
/// program ends. Empty: the thread stays as it is.
///
/// Errors: as `serve_sessions`; `not_found` when there is neither Webots nor the demo simulator.
boost::asio::awaitable<result<>> serve_simulations(boost::asio::any_io_executor executor,
                                                   SimulationConfig config, Reload<SimulationConfig> reload,
                                                   std::filesystem::path programs, Logger log,
                                                   std::filesystem::path config_file = {});

} // namespace webots_cloud
