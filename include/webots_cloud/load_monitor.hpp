// Keeps a fresh picture of the load of every simulation server. For session servers, and for dashboards of
// your own. Runs on one executor; does not decide who gets what: that is the Scheduler.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/server_load.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/http_client.hpp>

#include <boost/asio/awaitable.hpp>

#include <memory>
#include <string>
#include <vector>

namespace webots_cloud {

struct LoadMonitorParams
{
    LoadMonitorParams() = default;

    /// From one poll of a server to its next. Default 5 s: browsers have been used to that for years.
    Duration interval = std::chrono::seconds(5);
    /// For one whole poll. Default 5 s. May exceed the interval: a server's next poll waits for its last.
    Duration timeout = std::chrono::seconds(5);
    /// Percent; from here on a server is full. Default 95.
    double threshold = 95;
    /// Polls go to `https://` instead of `http://`.
    bool tls = false;
};

/// Polls `GET /load` of every server, each on its own schedule: one slow machine delays nobody.
///
/// First polls start at once; later ones keep their distance, so that polls of many servers stay spread over
/// the interval. Inert until `run()` is awaited; `run()` ends when cancelled or when the parameters are
/// unusable.
/// Lifetime: `http`, `clock` must outlive the monitor.
/// Thread-safety: one executor.
class LoadMonitor
{
public:
    LoadMonitor(LoadMonitorParams params, HttpClient& http, Clock& clock);
    ~LoadMonitor();

    /// Takes other parameters: each server's next poll obeys them.
    ///
    /// Errors: `invalid_argument`, and the old ones stay: an interval or a timeout that is not positive.
    result<> apply(LoadMonitorParams params);

    /// The servers to watch from now on: added ones are polled at once, removed ones are forgotten, others
    /// stay as they are.
    void set_servers(std::vector<std::string> const& addresses);

    /// Cancellation: terminal; polls in flight are abandoned.
    /// Errors: `invalid_argument`; `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    /// Waits for polls to end and returns their outcomes, oldest first; never empty. For one caller at a
    /// time.
    ///
    /// Outcomes that nobody asks for are dropped, oldest first, beyond 100 000.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<std::vector<LoadEvent>>> next_events();

    /// How many servers are up, and their load. Never waits, copies nothing.
    LoadTotals totals() const noexcept;

    /// What is known of every server, in the order given to `set_servers`. Never waits.
    std::vector<ServerLoad> snapshot() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// The URL of a path on a server: `host:port` or `host/port` as configured, behind `http://` or `https://`.
std::string server_url(std::string_view address, bool tls, std::string_view path);

} // namespace webots_cloud
