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
/// Errors: `operation_aborted` when cancelled. Of a start that fails:
/// - `unavailable`: a port is in use, or this machine does not have `listen_address` now;
/// - `invalid_config`: a file is missing or can't be used that the configuration needs (a certificate,
///   `session_secret`, the operator's token, the teachers' password), or an entry of `trusted_proxies`; or
///   mails are configured, and there is no libcurl;
/// - `invalid_argument`: `listen_address` is no numeric address, a port is one that we may not open, a number
///   or a policy makes no sense, or the name of the mail server or an address does not.
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
/// Errors: as `serve_sessions`. Of a start that fails, also:
/// - `not_found`: there is neither Webots nor the demo simulator; or no docker, compose or Slurm, where the
///   configuration wants that;
/// - `invalid_config`: no Webots is in `webots_home`; `sandbox` or `network_reach` has an unknown value;
/// - `start_failed`: `programs` lacks `webots-process-guard`, or the sandbox, the display or the
///   `simulation_user` that is asked for by name does not work here; nor does a user that does not exist;
/// - `unavailable`: another simulation server with this port uses `state_dir`; docker or Slurm do not answer;
/// - `invalid_argument`: others could change what is in `state_dir`;
/// - codes of the system: `state_dir` can't be used, as on a full disk.
boost::asio::awaitable<result<>> serve_simulations(boost::asio::any_io_executor executor,
                                                   SimulationConfig config, Reload<SimulationConfig> reload,
                                                   std::filesystem::path programs, Logger log,
                                                   std::filesystem::path config_file = {});

} // namespace webots_cloud
