// What one simulation uses of the machine, and its end where that is more than its limits allow.
#pragma once

#include "core/pages/simulation_board.hpp"
#include "core/simulation/simulation_life.hpp"
#include "session_context.hpp"

#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/folder_meter.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <memory>
#include <optional>

namespace webots_cloud {

/// Looks at a simulation when it is asked to. What it found last stays when the simulation has ended.
///
/// Lifetime: everything passed by reference must outlive it.
class SimulationUsage
{
public:
    /// `simulation` and `life`: those of the session, which change while it measures.
    SimulationUsage(SessionContext const& context, std::unique_ptr<Simulation> const& simulation,
                    core::SimulationLife const& life)
        : context_(context), simulation_(simulation), life_(life)
    {}

    /// The simulator was started; `folder`: of its project.
    void begin(TimePoint now, std::filesystem::path folder);

    /// Measures what the simulator consumes.
    boost::asio::awaitable<void> look_at_processes();

    /// Ends the simulation if it had overrun the limit of memory or processes when it was last looked at.
    void keep_process_limits();

    /// Measures its folder, if that is due, and ends it if it has overrun the limit of disk.
    boost::asio::awaitable<void> look_at_folder(FolderMeter& meter);

    /// What it consumed when it was last looked at; nothing before that.
    ProcessUsage const& last() const noexcept { return used_; }
    double processors() const noexcept { return cpu_.value_or(0) / 100; }
    double graphics_processors() const noexcept { return graphics_; }
    bool is_measured() const noexcept { return cpu_.has_value(); }

    void describe(core::SimulationRow& row) const;

private:
    bool is_running() const noexcept;

    SessionContext const& context_;
    std::unique_ptr<Simulation> const& simulation_;
    core::SimulationLife const& life_;
    std::filesystem::path folder_;
    ProcessUsage used_;         ///< When it was last measured.
    TimePoint measured_;        ///< When that was; at first when the simulator was started.
    TimePoint folder_due_{};    ///< When its folder is to be measured again.
    std::optional<double> cpu_; ///< Percent of one processor, between the last two measurements.
    double graphics_ = 0;       ///< Graphics processors, then.
};

} // namespace webots_cloud
