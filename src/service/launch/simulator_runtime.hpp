// How simulators run: as processes of this machine, or in containers. The launcher treats both alike.
#pragma once

#include "core/docker/compose_output.hpp"

#include <webots_cloud/docker_mode.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/slurm_mode.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud {

/// A line that the started program printed.
struct PrintedLine
{
    PrintedLine() = default;

    core::ComposeLine line;   ///< Its origin and its text.
    bool is_progress = false; ///< To be shown to a browser that waits.
};

/// Lifetime: must outlive the simulations.
/// Thread-safety: one executor.
class SimulatorRuntime
{
public:
    virtual ~SimulatorRuntime() = default;

    /// How to start a simulator that listens on `port`.
    ///
    /// Errors: those of `DockerMode::prepare`.
    virtual boost::asio::awaitable<result<LaunchPlan>> plan(LaunchSpec const& spec, std::uint16_t port) = 0;

    /// Forgets a plan whose program could not be started.
    virtual void forget(LaunchPlan const& plan) noexcept = 0;

    /// Whether something may be left when the program has ended, so that `clear` is needed.
    virtual bool leaves_something() const noexcept = 0;

    /// Removes what is left of a plan whose program has ended.
    ///
    /// Cancellation: none.
    virtual boost::asio::awaitable<void> clear(LaunchPlan const& plan) = 0;

    /// What was written outside of the instance directory.
    ///
    /// Cancellation: none.
    virtual boost::asio::awaitable<WrittenElsewhere> written_elsewhere(LaunchPlan const&)
    {
        co_return WrittenElsewhere();
    }

    /// Puts a file of the project, absolute, into the copies that containers have of it.
    ///
    /// Errors: those of `DockerMode::put_back`.
    virtual boost::asio::awaitable<result<>> put_into_containers(LaunchPlan const&,
                                                                 std::filesystem::path /*file*/)
    {
        co_return result<>();
    }

    /// What compiles a controller in `instance`, for a simulation of this plan; without arguments: nothing.
    virtual ProcessSpec compiler(LaunchPlan const&, std::filesystem::path const& /*instance*/,
                                 ControllerSources const&)
    {
        return {};
    }

    virtual PrintedLine read(std::string_view line, LaunchPlan const& plan) = 0;

    /// Whether a simulator that has loaded its world certainly listens on its own port, so that it need not
    /// be looked for.
    virtual bool keeps_its_port() const noexcept = 0;

    // For plans with a job:

    /// What somebody who waits for the job is told: a sentence, or nothing.
    virtual std::string news_of(LaunchPlan const&) const { return {}; }

    /// How to put a file of the project, absolute, back into the copy that the job with this number of
    /// Slurm's has; without arguments: there is no copy.
    virtual ProcessSpec put_back(LaunchPlan const&, std::string_view /*number*/,
                                 std::filesystem::path const& /*file*/)
    {
        return {};
    }

    /// The numeric address of the node that it runs on.
    ///
    /// Errors: those of `SlurmMode::address_of`.
    virtual boost::asio::awaitable<result<std::string>> address_of(std::string node) { co_return node; }
};

/// A command line as people read it.
std::string in_one_line(std::vector<std::string> const& argv);

/// Processes of this machine.
///
/// Lifetime: `config` and `facts` must outlive it.
std::unique_ptr<SimulatorRuntime> make_native_runtime(SimulationLauncherConfig const& config,
                                                      SimulationLauncherFacts const& facts);

/// Containers.
///
/// Lifetime: `docker` must outlive it.
std::unique_ptr<SimulatorRuntime> make_docker_runtime(DockerMode& docker);

/// Jobs of a Slurm cluster.
///
/// Lifetime: everything passed by reference must outlive it.
std::unique_ptr<SimulatorRuntime> make_slurm_runtime(SimulationLauncherConfig const& config,
                                                     SimulationLauncherFacts const& facts, SlurmMode& slurm);

} // namespace webots_cloud
