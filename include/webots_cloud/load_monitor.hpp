// Polls the load of simulation servers and keeps what they answered. For session servers, and for dashboards
// of your own. Which machine a browser gets is decided by the Scheduler.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/fleet.hpp>
#include <webots_cloud/server_load.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/http_client.hpp>

#include <boost/asio/awaitable.hpp>

#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Polls `GET /load` of every server, each on its own schedule: a slow server does not delay the polls of
/// others.
///
/// First polls start at once; later ones are spread over the interval. Nothing is polled until `run()` is
/// awaited. What is known of the servers is kept here alone: others look at `servers()` and `totals()`.
/// Lifetime: `http` and `clock` must outlive the monitor, and the monitor must outlive its operations: await
/// their end before it is destroyed.
/// Thread-safety: one executor.
class LoadMonitor
{
public:
    /// With the default parameters.
    LoadMonitor(HttpClient& http, Clock& clock);

    /// Errors: `invalid_argument`: an interval, a timeout or a threshold that is not positive.
    static result<LoadMonitor> make(LoadMonitorParams params, HttpClient& http, Clock& clock);

    ~LoadMonitor();
    LoadMonitor(LoadMonitor&&) noexcept;
    LoadMonitor& operator=(LoadMonitor&&) noexcept;

    /// Takes other parameters, from each server's next poll on.
    ///
    /// Errors: as make(), and the old ones stay.
    result<> apply(LoadMonitorParams params);

    LoadMonitorParams const& params() const noexcept;

    /// It polls the machines of the fleet, from now on, instead of those of `set_servers`: a new one at once,
    /// each at its internal address if it has one. A changed one is polled as said there from its next poll
    /// on, and what is known of it stays. Of one with a path of its own only a report with the counters of
    /// our simulation servers will do: what answers otherwise is taken for another service.
    ///
    /// Lifetime: either may end first.
    void follow(Fleet& fleet);

    /// The servers to poll from now on: added ones are polled at once, removed ones are forgotten, what is
    /// known of the others stays. Of equal addresses the first counts.
    void set_servers(std::vector<std::string> const& addresses);

    /// One more poll of that server at once, unless one is in flight, or it is not in the list, or `run()` is
    /// not awaited. For callers that have reason to think that something has changed there.
    void poll_now(std::string_view address);

    /// Cancellation: terminal; polls in flight are abandoned.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    /// Waits for a poll to end and returns the outcomes since the last call, oldest first; never empty. For
    /// one caller at a time.
    ///
    /// Of outcomes that nobody has taken, the last 100 000 are kept.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<std::vector<LoadEvent>>> next_events();

    /// How many servers are up, and their load.
    LoadTotals totals() const noexcept;

    /// What is known of every server, in the order of the list.
    /// Lifetime: a server is where it is until it leaves the list; each poll changes it.
    std::list<ServerLoad> const& servers() const noexcept;

    /// What is known of one. Null: it is not in the list.
    /// Lifetime: as of `servers`.
    ServerLoad const* find(std::string_view address) const;

private:
    struct Impl;
    explicit LoadMonitor(std::unique_ptr<Impl> impl);

    std::unique_ptr<Impl> impl_;
};

/// The URL of a path on a server: `host:port` or `host/port` as configured, behind `http://` or `https://`.
std::string server_url(std::string_view address, bool tls, std::string_view path);

} // namespace webots_cloud
