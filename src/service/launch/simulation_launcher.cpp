// Starts simulators on ports of a pool; each is a RunningSimulation from then on. What differs between
// programs, containers and jobs is behind SimulatorRuntime.
// Decisions: core/simulation/port_pool, core/simulation/launch_plan.
#include <webots_cloud/simulation_launcher.hpp>

#include "core/refusals.hpp"
#include "core/simulation/launch_plan.hpp"
#include "core/simulation/port_pool.hpp"
#include "core/text.hpp"
#include "running_simulation.hpp"
#include "service/run_program.hpp"
#include "simulator_runtime.hpp"

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

using core::concat;

std::unique_ptr<SimulatorRuntime> make_runtime(SimulationLauncherConfig const& config,
                                               SimulationLauncherFacts const& facts, DockerMode* docker,
                                               SlurmMode* slurm)
{
    if (docker)
        return make_docker_runtime(*docker);
    return slurm ? make_slurm_runtime(config, facts, *slurm) : make_native_runtime(config, facts);
}

} // namespace

struct SimulationLauncher::Impl
{
    Impl(SimulationLauncherConfig wanted, SimulationLauncherFacts found, ProcessHost& host, Clock& time,
         Logger logger, DockerMode* docker, SlurmMode* slurm)
        : config(std::move(wanted)), facts(std::move(found)), processes(host), clock(time),
          log(std::move(logger)), runtime(make_runtime(config, facts, docker, slurm)),
          ports(facts.first_port, config.max_simulations)
    {}

    SimulationLauncherConfig const config;
    SimulationLauncherFacts const facts;
    ProcessHost& processes;
    Clock& clock;
    Logger log;
    std::unique_ptr<SimulatorRuntime> runtime;
    core::PortPool ports;
};

SimulationLauncher::SimulationLauncher(SimulationLauncherConfig config, SimulationLauncherFacts facts,
                                       ProcessHost& processes, Clock& clock, Logger log, DockerMode* docker,
                                       SlurmMode* slurm)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(facts), processes, clock, std::move(log),
                                   docker, slurm))
{}

SimulationLauncher::~SimulationLauncher() = default;

asio::awaitable<result<std::unique_ptr<Simulation>>> SimulationLauncher::launch(LaunchSpec spec)
{
    if (!core::is_known_mode(spec.mode))
        co_return core::refused(core::Refused::wrong_mode, {{"mode", core::printable(spec.mode, 40)}});
    // Held until the start: to make the plan may take minutes, in which some other program could take the
    // port.
    std::unique_ptr<PortHold> hold;
    auto const take = [&](std::uint16_t port) {
        auto taken = impl_->processes.hold_port(port);
        if (!taken) {
            impl_->log.info(LogCause("port in use"),
                            concat("Port ", std::to_string(port), " is already in use."));
            return false;
        }
        hold = std::move(*taken);
        return true;
    };
    auto const port = impl_->ports.acquire(take);
    if (!port)
        co_return port.error();
    PortLease lease(impl_->ports, *port);

    auto plan = co_await impl_->runtime->plan(spec, *port);
    if (!plan)
        co_return plan.error();
    auto const command = plan->command.empty() ? in_one_line(plan->process.argv) : plan->command;

    // In a network of its own it is reached by a socket in a folder of ours, so that no port of this machine
    // leads to it past the gateway.
    if (uses_gateway(impl_->config, impl_->facts, spec) && !impl_->facts.brokers.empty() &&
        plan->process.network.reach != ProcessNetwork::Reach::host)
        plan->process.network.broker = impl_->facts.brokers / std::to_string(*port);
    hold.reset(); // as late as possible: from now on the simulator can take the port
    auto process = plan->process;
    auto started = co_await impl_->processes.start(std::move(process));
    if (!started) {
        impl_->runtime->forget(*plan);
        if (started.error().info()) // a sentence of its own
            co_return started.error();
        co_return core::refused(started.error().code(), core::Refused::not_started,
                                {{"why", started.error().message()}});
    }
    impl_->log.info(LogCause("launch"),
                    concat("[", spec.label, "] Webots [", std::to_string((*started)->id()), "] started: \"",
                           core::printable(command, 1024), "\""));
    co_return std::make_unique<RunningSimulation>(
        impl_->config, impl_->facts, std::move(lease), std::move(*started), impl_->processes, impl_->clock,
        impl_->log, std::move(spec), *impl_->runtime, std::move(*plan));
}

std::size_t SimulationLauncher::running() const noexcept
{
    return impl_->ports.lent();
}

SimulationLauncherConfig const& SimulationLauncher::config() const noexcept
{
    return impl_->config;
}

SimulationLauncherFacts const& SimulationLauncher::facts() const noexcept
{
    return impl_->facts;
}

} // namespace webots_cloud
