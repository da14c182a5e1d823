// The pages at /monitor (protocol sections 2.4 and 9.3): one shell for both servers, which scripts in
// src/web/monitor fill with the snapshot that stands in it.
#pragma once

#include "page_parts.hpp"

#include <webots_cloud/server_load.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/host_metrics.hpp>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

struct MonitorPage
{
    MonitorPage() = default;

    std::string_view title;
    std::string heading;  ///< Empty: the title.
    std::string words;    ///< For who reads it without scripts, as HTML.
    std::string snapshot; ///< JSON, as watchers get it; empty: scripts ask for it.
    PageAssets assets;
};

std::string monitor_page(MonitorPage const& page);

/// What the pages but the monitors say in one language: a JSON object.
struct LanguageTexts
{
    std::string_view language;
    std::string_view texts;
};

/// For scripts of the page: `{"en":{"monitor.live":"Live",...}...}`. `own`: what the monitors alone say, each
/// text with all languages, `{"monitor.live":{"en":"Live",...}...}`; of the others they say what a site is,
/// and why people wait.
std::string monitor_texts(std::string_view own, std::vector<LanguageTexts> const& others);

/// `Started on ...`, `Managing 3 simulation servers:` and `average: 12.5%`, the words of old pages.
std::string session_words(WallTime started, std::size_t machines, LoadTotals const& totals);

/// `Current load: 12.5%`, likewise.
std::string simulation_words(double load);

/// What a session server tells of itself in its snapshots.
struct SessionAbout
{
    SessionAbout() = default;

    WallTime started;
    bool is_tls = true;           ///< Machines that it does not pass on to are reached by https.
    bool is_gateway = false;      ///< Machines `host/port` are reached below this server.
    bool shows_decisions = false; ///< To everybody.
};

std::string about_json(SessionAbout const& about);

/// What a simulation server tells of itself and its machine in its snapshots.
struct SimulationAbout
{
    SimulationAbout() = default;

    std::string title;
    std::string description;
    std::vector<std::string> notices; ///< Empty ones are left out.
    std::string sandbox;              ///< How simulations are confined; empty: not shown.
    std::string display;              ///< What they draw on; empty: not shown.
    HostDescription host;
    std::vector<std::string> allowed;    ///< Repositories.
    std::vector<std::string> blocked;    ///< Repositories.
    std::vector<std::string> registries; ///< URLs of those that share our idle time.
    double share_idle_time = 50;
};

std::string about_json(SimulationAbout const& about);

/// The mean load of the servers that are up, as `GET /load` of the session server answers it: `-1` without
/// any.
std::string mean_load(LoadTotals const& totals);

} // namespace webots_cloud::core
