// How simulators, which run strangers' programs, are confined on this machine.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/simulation_user.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What simulators may see and reach.
struct SandboxParams
{
    SandboxParams() = default;

    std::filesystem::path bubblewrap;             ///< `bwrap`, absolute. Empty: it is not used.
    std::filesystem::path firejail;               ///< `firejail`, absolute. Empty: it is not used.
    std::filesystem::path firejail_profile;       ///< A file, absolute; for firejail.
    ProcessNetwork network;                       ///< But for the port, which is the simulator's.
    std::vector<std::filesystem::path> read_only; ///< Visible besides the system: Webots.
    std::vector<std::filesystem::path> devices;   ///< Visible: those of graphics processors.
    std::filesystem::path x_authority;            ///< Visible: the password of the display; empty: none.
    std::filesystem::path resolver;               ///< Seen as `/etc/resolv.conf`; empty: there is none.
    /// What spares bubblewrap mounts: folders of the system that are links, with where they lead, as `/bin`
    /// to `usr/bin`; and small files of `/etc` that simulations may have copies of.
    std::vector<std::pair<std::filesystem::path, std::filesystem::path>> system_links;
    std::vector<std::filesystem::path> copied;
    std::filesystem::path filter; ///< The guard, which forbids system calls; empty: none are.

    SimulationUser user; ///< The user that runs them, whether they are confined or not.

    /// They are not confined at all.
    bool is_none() const { return bubblewrap.empty() && firejail.empty(); }
};

/// What a program in the sandbox tries, and must not be able to do.
struct SandboxAttempts
{
    SandboxAttempts() = default;

    std::filesystem::path guard; ///< The program that tries, `webots-process-guard`, absolute.
    std::filesystem::path file;  ///< To be read: a file of the server.
    std::uint16_t port = 0;      ///< To be connected to: on the loopback, where somebody listens.
    int process = 0;             ///< To be signalled: the server.
};

/// Starts a program in the sandbox, in the working directory `instance`, and sees what it can do.
///
/// Errors: `refused`: it could do what it must not, and the detail says what; `start_failed`: the sandbox
/// can't be made here; `timed_out` after 15 seconds.
/// Cancellation: terminal.
/// Lifetime: `processes` and `clock` must outlive the operation.
boost::asio::awaitable<result<>> check_sandbox(ProcessHost& processes, Clock& clock, SandboxParams sandbox,
                                               std::filesystem::path instance, SandboxAttempts attempts);

/// Runs a program as `sandbox.user`, but not confined, and sees what it can do; then whether that user can
/// run `simulator`.
///
/// Errors: as of `check_sandbox`; `start_failed` also when the user can't run the simulator.
/// Cancellation: terminal.
/// Lifetime: `processes` and `clock` must outlive the operation.
boost::asio::awaitable<result<>> check_user(ProcessHost& processes, Clock& clock, SandboxParams sandbox,
                                            std::filesystem::path simulator, std::filesystem::path instance,
                                            SandboxAttempts attempts);

} // namespace webots_cloud
