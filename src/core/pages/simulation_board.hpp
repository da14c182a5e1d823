// What the simulation server's monitor page shows, and what of it changes every second: texts for browsers
// that watch.
#pragma once

#include "day_history.hpp"
#include "load_history.hpp"
#include "monitor_sample.hpp"

#include <webots_cloud/time.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// One simulation on the page.
struct SimulationRow
{
    SimulationRow() = default;

    std::uint64_t id = 0;
    std::string world; ///< Where the browser found it; made short for the page.
    std::string state;
    bool staged = false; ///< It is ready, and no browser has it yet.
    Duration age{};
    std::string log;           ///< Where the operator finds what the simulator printed; empty: nowhere.
    int process = 0;           ///< 0 while there is none.
    std::optional<double> cpu; ///< Percent of one processor, over the last look or, at first, its whole life.
    bool more = false;         ///< It has more processes than are looked at: `cpu` and `memory` are too low.
    std::optional<double> memory;           ///< Megabytes (10^6) that its processes have in memory.
    std::optional<std::uint64_t> processes; ///< And threads.
    double graphics = 0;                    ///< Percent of one graphics processor, with `cpu`.
};

/// What the page shows of the machine beside the columns of monitor.csv: a member of the JSON.
struct MachineFigure
{
    std::string_view name;
    double value = 0;
    int decimals = 0;
};

/// Percent of one processor that was used between two looks at the time that a process tree has consumed.
double process_cpu_percent(Duration used_before, Duration used_after, Duration between) noexcept;

/// How many of them are staged and ready.
std::size_t staged(std::vector<SimulationRow> const& rows);

/// A world's URL in at most 200 bytes, its end preferred: there is the file's name.
std::string short_world(std::string_view url);

/// Ten minutes and a day of figures, and the texts, in JSON and of bounded size, that carry them to browsers.
class SimulationBoard
{
public:
    /// Rows beyond these are counted only.
    static constexpr std::size_t max_rows = 200;

    SimulationBoard();

    /// What never changes while somebody watches: JSON, for the member `about` of snapshots.
    void describe(std::string about) { about_ = std::move(about); }

    /// Takes the figures of this second.
    void take(MonitorSample const& sample, double load, TimePoint now, WallTime wall);

    MonitorSample const& sample() const noexcept { return sample_; }

    /// The complete state as of the last `take`, for a new browser.
    std::string snapshot(std::vector<SimulationRow> const& rows, std::vector<MachineFigure> const& machine,
                         bool is_draining = false) const;

    /// The last point, and the simulations.
    std::string update(std::vector<SimulationRow> const& rows, std::vector<MachineFigure> const& machine,
                       bool is_draining = false) const;

private:
    std::string begin(std::vector<SimulationRow> const& rows, std::vector<MachineFigure> const& machine,
                      bool is_draining) const;

    LoadHistory history_;
    DayHistory day_{MonitorSample::names()};
    bool has_new_minute_ = false;
    std::string about_;
    std::array<LoadHistory::Series, MonitorSample::columns> series_;
    MonitorSample sample_;
    double load_ = 0;
    TimePoint now_{};
    WallTime wall_{};
};

} // namespace webots_cloud::core
