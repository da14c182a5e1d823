// What a simulation server makes on its machine while it has all its rights: the folder of its simulations,
// their limits and walls, and what starts programs and looks at them. Nothing here handles what comes from
// outside; what does, is made afterwards, when the server has confined itself.
#pragma once

#include "adapters/projects/instance_root.hpp"
#include "core/simulation/simulator_choice.hpp"
#include "machine_trial.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/host_metrics.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

namespace webots_cloud::app {

struct SimulationMachine
{
    SimulationMachine(core::SimulatorChoice simulator, adapters::InstanceRoot root)
        : simulator(std::move(simulator)), root(std::move(root))
    {}

    std::filesystem::path const& instances() const { return root.path(); }

    core::SimulatorChoice simulator;
    adapters::InstanceRoot root;
    /// What was fetched with git; ours alone. Another source's folder is to lie beside it: simulations can't
    /// change what is there, and the server may write.
    std::filesystem::path cache;
    std::filesystem::path guard; ///< `webots-process-guard`, absolute.
    std::unique_ptr<HostMetrics> metrics;
    ProcessLimits limits;                             ///< Of each simulation.
    std::vector<std::filesystem::path> group_folders; ///< Where control groups are made.
    std::unique_ptr<ProcessHost> processes;
    MachineTrial trial; ///< Its outcome is good.
};

/// Containers have their own Webots.   Errors: as `core::choose_simulator`.
result<core::SimulatorChoice> find_simulator(SimulationConfig const& config,
                                             std::filesystem::path const& programs);

/// Makes all of it, and tells the operator what it has found. `programs`: our own, absolute.
///
/// Lifetime: `config` and `clock` must outlive the operation, `clock` what is made as well.
/// Errors: as `find_simulator`, `InstanceRoot::open` and `MachineTrial::outcome`: the server can't start.
/// Cancellation: terminal.
boost::asio::awaitable<result<std::unique_ptr<SimulationMachine>>>
prepare_machine(boost::asio::any_io_executor executor, SimulationConfig const& config,
                std::filesystem::path programs, Clock& clock, Logger log);

} // namespace webots_cloud::app
