// What the session server has learned about the costs of worlds, kept over restarts.
#pragma once

#include "adapters/logs/kept_file.hpp"

#include <webots_cloud/scheduler.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/awaitable.hpp>

namespace webots_cloud::app {

/// Bytes: more than Scheduler::save_costs() writes.
inline constexpr std::size_t max_kept_costs = 1 << 20;

/// One line of the log says so where there is nothing that can be used.
void load_costs(Scheduler& scheduler, adapters::KeptFile const& file, Clock const& clock, Logger const& log);

/// Writes them every 10 minutes, and when it is cancelled. A failure is logged.
boost::asio::awaitable<result<>> keep_costs(Scheduler& scheduler, adapters::KeptFile& file, Clock& clock,
                                            Logger log);

} // namespace webots_cloud::app
