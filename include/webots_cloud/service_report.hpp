// Tells the service manager that we are ready, alive and stopping.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/service_manager.hpp>

#include <boost/asio/awaitable.hpp>

namespace webots_cloud {

/// Call it when everything is ready. The signs of life come from the caller's executor, so that they stop
/// when that stands still.
///
/// Ends when cancelled.
/// Errors: `operation_aborted`.
boost::asio::awaitable<result<>> report_to(ServiceManager& manager, Clock& clock);

} // namespace webots_cloud
