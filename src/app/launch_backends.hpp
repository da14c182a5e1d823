// What simulations are on this machine: processes of ours, containers of Docker, or jobs of Slurm; and what
// they have there.
#pragma once

#include "simulation_machine.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/docker_mode.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/slurm_mode.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/host_metrics.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/text_files.hpp>

#include <boost/asio/awaitable.hpp>

#include <memory>

namespace webots_cloud::app {

/// At most one of both modes; without, simulations are processes of this machine.
struct LaunchBackends
{
    LaunchBackends() = default;

    std::unique_ptr<TextFiles> files;
    std::unique_ptr<DockerMode> docker;
    std::unique_ptr<SlurmMode> slurm;
    std::unique_ptr<HostMetrics> partitions; ///< Of Slurm, whose nodes run the simulations.
};

/// Lifetime: `config` must outlive the operation; `machine` and `clock` what is made.
/// Errors: as `DockerMode::open` and `SlurmMode::open`.
boost::asio::awaitable<result<LaunchBackends>>
open_backends(SimulationConfig const& config, SimulationMachine& machine, Clock& clock, Logger log);

/// Runs them until cancelled; where there is none, there is nothing to do until then.
boost::asio::awaitable<result<>> run(LaunchBackends& backends);

/// Tells the operator what does not go as configured.
SimulationLauncherFacts launcher_facts(SimulationConfig const& config, SimulationMachine const& machine,
                                       Logger const& log);

} // namespace webots_cloud::app
