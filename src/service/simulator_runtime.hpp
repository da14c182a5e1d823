// Where simulators run: as programs of this machine, or in containers. The launcher knows no difference.
#pragma once

#include "core/docker/compose_output.hpp"

#include <webots_cloud/docker_mode.hpp>
#include <webots_cloud/simulation_launcher.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <memory>
#include <string_view>

namespace webots_cloud {

/// What a line is that the started program printed.
struct PrintedLine
{
    PrintedLine() = default;

    core::ComposeLine line;   ///< Whose it is, and what it says.
    bool is_progress = false; ///< A browser that waits may see it.
};

/// Lifetime: must outlive the simulations.   Thread-safety: one executor.
class SimulatorRuntime
{
public:
    virtual ~SimulatorRuntime() = default;

    /// What is to be started for a simulator that listens on `port`.   Errors: those of
    /// `DockerMode::prepare`.
    virtual boost::asio::awaitable<result<ContainerPlan>> plan(LaunchSpec const& spec,
                                                               std::uint16_t port) = 0;

    /// Of a plan whose program could not be started.
    virtual void forget(ContainerPlan const& plan) noexcept = 0;

    /// Whether a program that has ended may leave something: then `clear` it.
    virtual bool leaves_something() const noexcept = 0;

    /// Removes what is left of a plan whose program has ended.   Not to be cancelled.
    virtual boost::asio::awaitable<void> clear(ContainerPlan const& plan) = 0;

    virtual PrintedLine read(std::string_view line, ContainerPlan const& plan) const = 0;

    /// Once the world is loaded, somebody listens on the simulator's port, and it can be no other port: it
    /// need not be looked for.
    virtual bool keeps_its_port() const noexcept = 0;
};

/// As programs of this machine.   Lifetime: `params` must outlive it.
std::unique_ptr<SimulatorRuntime> make_native_runtime(SimulationLauncherParams const& params);

/// In containers.   Lifetime: `docker` must outlive it.
std::unique_ptr<SimulatorRuntime> make_docker_runtime(DockerMode& docker);

} // namespace webots_cloud
