// The pages at /monitor (protocol sections 2.4 and 9.3), from values to HTML that needs no script to be read.
#pragma once

#include "core/site_state.hpp"
#include "monitor_sample.hpp"
#include "page_parts.hpp"
#include "session_board.hpp"
#include "simulation_board.hpp"

#include <webots_cloud/server_load.hpp>
#include <webots_cloud/transport/host_metrics.hpp>

#include <optional>
#include <string>
#include <vector>

namespace webots_cloud::core {

/// What the session server's page shows.
struct SessionMonitorView
{
    SessionMonitorView() = default;

    WallTime started;
    TimePoint now;
    bool ssl = true;
    bool gateway = false; ///< Machines `host/port` are reached below this server.
    double threshold = 95;
    std::vector<SessionRow> servers;
    SiteState state = SiteState::unknown;
    std::optional<WaitingFigures> waiting; ///< Of a server that relays.
    PageAssets assets;
};

std::string session_monitor_page(SessionMonitorView const& view);

/// What the simulation server's page shows.
struct SimulationMonitorView
{
    SimulationMonitorView() = default;

    std::string title;
    std::string description;
    std::string notice;
    std::string warning;
    std::string limits_warning;
    std::string sandbox; ///< How simulations are confined; empty: not shown.
    std::string display; ///< What they draw on; empty: not shown.
    double load = 0;
    HostDescription host;
    MonitorSample sample;
    std::vector<std::string> allowed;
    std::vector<std::string> blocked;
    std::vector<std::string> notify; ///< URLs of the registries that share our idle time.
    double share_idle_time = 50;
    int capacity = 0;
    bool draining = false; ///< No new simulations are taken.
    std::vector<SimulationRow> simulations;
    PageAssets assets;
};

std::string simulation_monitor_page(SimulationMonitorView const& view);

/// The mean load of the servers that are up, as `GET /load` of the session server answers it: `-1` without
/// any.
std::string mean_load(LoadTotals const& totals);

} // namespace webots_cloud::core
