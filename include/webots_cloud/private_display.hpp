// A virtual X display for each simulator, which no other program sees.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/sandbox.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <filesystem>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Which program makes the display, an X server without a screen.
struct PrivateDisplay
{
    PrivateDisplay() = default;

    std::filesystem::path server; ///< `Xvfb`, absolute. Empty: there are no private displays.
    std::filesystem::path guard;  ///< `webots-process-guard`, absolute, which starts it.
};

/// Starts a display, in the sandbox if there is one, in the working directory `instance`, and ends it.
///
/// Errors: `start_failed`, with a detail that says why it can't be made here; `timed_out`.
/// Cancellation: terminal.
/// Lifetime: `processes` and `clock` must outlive the operation.
boost::asio::awaitable<result<>> check_private_display(ProcessHost& processes, Clock& clock,
                                                       PrivateDisplay display, SandboxParams sandbox,
                                                       std::filesystem::path instance);

} // namespace webots_cloud
