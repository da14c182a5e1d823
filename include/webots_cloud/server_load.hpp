// How simulation servers are polled, what is known of them by that, and what one poll changed.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/load_report.hpp>
#include <webots_cloud/time.hpp>

#include <chrono>
#include <cstddef>
#include <string>
#include <utility>

namespace WEBOTS_CLOUD_API webots_cloud {

/// How often LoadMonitor polls the machines, and how long it waits for them.
struct LoadMonitorParams
{
    LoadMonitorParams() = default;

    /// `loadRefresh`: from one poll of a server to its next. Default 5 s. Shorter: fresher loads, and more
    /// requests to the machines. `SchedulerParams::report_lifetime` has to follow it.
    Duration interval = std::chrono::seconds(5);
    /// `loadTimeout`: for one whole poll. Default 5 s. May exceed the interval: a server's next poll waits
    /// for its last.
    Duration timeout = std::chrono::seconds(5);
    /// `loadThreshold`, percent; from here on a server is full. Default 95.
    double threshold = 95;
    /// Polls go to `https://` instead of `http://`.
    bool tls = false;
};

/// What is known of a server: unknown is not idle.
enum class ServerState
{
    unknown, ///< No poll of it has ended since it was added.
    up,      ///< The last poll succeeded.
    down     ///< The last poll failed.
};

/// One server as the monitor sees it.
struct ServerLoad
{
    ServerLoad() = default;
    explicit ServerLoad(std::string address) : address(std::move(address)) {}

    std::string address; ///< `host:port` or `host/port`, as configured.
    ServerState state = ServerState::unknown;
    LoadReport report;   ///< That of the last successful poll.
    TimePoint reported;  ///< When `report` was received.
    std::string problem; ///< Why the last poll failed; empty while up.
};

/// A sum over servers.
struct LoadTotals
{
    LoadTotals() = default;

    std::size_t up = 0;
    std::size_t down = 0;
    std::size_t unknown = 0;
    double load = 0; ///< Percent, of those that are up together.

    bool operator==(LoadTotals const&) const = default;
};

/// What one poll changed (protocol section 3).
enum class LoadTransition
{
    none,
    not_responding,  ///< First failed poll.
    too_slow,        ///< First failed poll, and it ran out of time.
    working_again,   ///< First good poll after a failure.
    reached_maximum, ///< The load crossed the threshold upwards.
    available_again  ///< The load crossed the threshold downwards.
};

/// The outcome of one poll.
struct LoadEvent
{
    LoadEvent() = default;

    ServerLoad server; ///< As it is known after the poll.
    LoadTransition transition = LoadTransition::none;
    bool is_repeated = false; ///< It failed like the poll before: nothing that is known has changed.
    bool is_late = false;     ///< It failed since there was no answer in time.
};

} // namespace webots_cloud
