// One second of a simulation server: the line of monitor.csv and the point of the monitor page's charts
// (protocol section 9.2).
#pragma once

#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/host_metrics.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The columns of monitor.csv that follow the timestamp, in their order: that of the Python servers, whose
/// readers know it. So nothing is added here for the page alone: that is a member of `SimulationRow`, or of
/// `SimulationBoard`. Who knows columns by their places: `SimulationBoard::snapshot` and
/// web/monitor/simulation.js.
struct MonitorSample
{
    MonitorSample() = default;

    static constexpr std::size_t columns = 11;
    /// The names of the columns, without the timestamp's.
    static std::array<std::string_view, columns> const& names() noexcept;

    std::vector<float> values() const;

    int running = 0; ///< Simulations that run.
    int idle = 0;    ///< Browsers whose simulation does not run: paused, being started, or not asked for yet.
    double cpu = 0;  ///< Percent, as the next six.
    double memory = 0;
    double gpu_compute = 0;
    double gpu_memory_controller = 0;
    double gpu_memory = 0;
    double swap = 0;
    double disk = 0;
    double sent = 0; ///< Megabytes (10^6) a second.
    double received = 0;

    bool operator==(MonitorSample const&) const = default;
};

/// The figures of the machine, from two looks `between` apart. `running` and `idle` are the caller's to fill
/// in.
MonitorSample machine_figures(HostSample const& before, HostSample const& after, Duration between);

/// The first line of monitor.csv, with its end.
std::string monitor_csv_header();

/// A line of monitor.csv, with its end: whole seconds since 1970, counts, percentages with one decimal, MB/s
/// with three.
std::string monitor_csv_line(WallTime time, MonitorSample const& sample);

/// From `now` to the next whole second of the calendar, and never so near that a second would be looked at
/// twice.
Duration until_next_second(WallTime now) noexcept;

} // namespace webots_cloud::core
