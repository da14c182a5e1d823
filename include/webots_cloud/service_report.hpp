// Tells the service manager (systemd) that the server is ready, alive and stopping.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/service_manager.hpp>

#include <boost/asio/awaitable.hpp>

namespace WEBOTS_CLOUD_API webots_cloud {

/// To be called when the server is ready. Watchdog messages are sent from the caller's executor, so that they
/// stop when the event loop hangs.
///
/// Ends when cancelled.
/// Errors: `operation_aborted`.
boost::asio::awaitable<result<>> report_to(ServiceManager& manager, Clock& clock);

} // namespace webots_cloud
