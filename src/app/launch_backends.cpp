// Finds out what the launcher, and the backend that runs simulations, have on this machine. Where Docker or
// Slurm keeps a limit, we do not keep it as well.
#include "launch_backends.hpp"

#include "async/wakeup.hpp"
#include "core/docker/docker_leftovers.hpp"
#include "core/simulation/controller_compiler.hpp"
#include "core/simulation/simulator_environment.hpp"
#include "core/slurm/job_command.hpp"
#include "core/text.hpp"
#include "environment.hpp"

#include <webots_cloud/adapters/files.hpp>
#include <webots_cloud/adapters/secrets.hpp>

#include <unistd.h>

#include <string>
#include <utility>

namespace webots_cloud::app {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using core::concat;

std::string host_name()
{
    char name[256] = "";
    (void)::gethostname(name, sizeof name - 1);
    return name;
}

DockerFacts docker_facts(SimulationConfig const& config, SimulationMachine const& machine)
{
    auto const& network = machine.trial.container_network;
    DockerFacts facts;
    facts.limits = machine.limits;
    facts.docker = find_program("docker");
    facts.docker_compose = find_program("docker-compose");
    facts.identity = core::docker_identity(host_name(), config.address.port, machine.instances());
    facts.environment = current_environment();
    std::error_code failed;
    if (fs::exists("/dev/dri", failed))
        facts.graphics_device = "/dev/dri";
    facts.network = network.network;
    facts.name_server = network.name_server;
    facts.own_displays = config.display == "private";
    if (facts.own_displays || config.display == "none") {
        facts.display.clear();
    } else if (auto const display = wanted_display(config); !display.name.empty()) {
        facts.display = display.name;
        if (display.may_be_opened)
            facts.xhost = find_program("xhost");
    }
    return facts;
}

/// Where simulations are jobs, which are started with the rights of this server's user.
SlurmFacts slurm_facts(SimulationConfig const& config, fs::path guard)
{
    SlurmFacts facts;
    facts.srun = find_program("srun");
    facts.scancel = find_program("scancel");
    facts.squeue = find_program("squeue");
    facts.sinfo = find_program("sinfo");
    facts.getent = find_program("getent");
    facts.tar = find_program("tar");
    facts.guard = std::move(guard);
    facts.identity = core::job_identity(host_name(), config.address.port);
    facts.run = make_token().substr(0, 8);
    facts.environment = current_environment();
    return facts;
}

/// Where the sockets are by which simulations with a network of their own are reached. Empty: nowhere.
fs::path broker_folder(SimulationConfig const& config, adapters::InstanceRoot const& root, Logger const& log)
{
    constexpr std::size_t longest = 100; // names of sockets have 107 bytes, and ports five digits
    if (config.slurm)                    // jobs are on other machines
        return {};
    if (!config.launching.gateway || root.brokers().native().size() <= longest)
        return config.launching.gateway ? root.brokers() : fs::path();
    log.warning(concat("Simulations with a network of their own have open ports on this machine, although "
                       "\"gateway\" is true: the name of ",
                       root.brokers().native(), " is too long for sockets. Choose a shorter \"stateDir\"."));
    return {};
}

/// Tells the operator which variables of this server's environment simulators do not get. Simulators in
/// containers get the environment of their image.
void tell_environment(core::Environment const& environment, SimulationLauncherConfig const& config,
                      Logger const& log)
{
    auto const remarks = core::environment_remarks(environment, config.simulator_environment);
    for (auto const& notice : remarks.notices)
        log.info(notice);
    for (auto const& warning : remarks.warnings)
        log.warning(warning);
}

/// Programs of containers and jobs are not compiled: these have tools of their own, or none.
ControllerCompiler find_compiler(SimulationConfig const& config, core::SimulatorChoice const& simulator)
{
    ControllerCompiler found;
    bool const can_be = !config.docker && !config.slurm && !find_program("cc").empty();
    std::error_code failed;
    if (!can_be || !fs::exists(core::common_makefile(simulator.home), failed))
        return found;
    found.make = find_program("make");
    found.home = simulator.home;
    return found;
}

} // namespace

asio::awaitable<result<LaunchBackends>> open_backends(SimulationConfig const& config,
                                                      SimulationMachine& machine, Clock& clock, Logger log)
{
    LaunchBackends backends;
    if (config.docker) {
        backends.files = make_text_files();
        DockerModeHooks hooks;
        hooks.exists = [](fs::path const& path) {
            std::error_code ignored;
            return fs::exists(path, ignored);
        };
        hooks.new_token = make_token;
        auto containers = config.containers;
        std::error_code failed;
        containers.directory = fs::weakly_canonical(containers.directory, failed);
        backends.docker = std::make_unique<DockerMode>(std::move(containers), config.launching,
                                                       docker_facts(config, machine), *machine.processes,
                                                       *backends.files, clock, log, hooks);
        auto const opened = co_await backends.docker->open();
        if (!opened)
            co_return opened.error();
    }
    if (config.slurm) {
        backends.slurm = std::make_unique<SlurmMode>(*config.slurm, slurm_facts(config, machine.guard),
                                                     *machine.processes, clock, log);
        auto const opened = co_await backends.slurm->open();
        if (!opened)
            co_return opened.error();
        backends.partitions = backends.slurm->metrics(*machine.metrics);
    }
    co_return backends;
}

asio::awaitable<result<>> run(LaunchBackends& backends)
{
    if (backends.slurm)
        co_return co_await backends.slurm->run();
    if (backends.docker)
        co_return co_await backends.docker->run();
    co_return co_await async::until_cancelled();
}

SimulationLauncherFacts launcher_facts(SimulationConfig const& config, SimulationMachine const& machine,
                                       Logger const& log)
{
    SimulationLauncherFacts facts;
    facts.brokers = broker_folder(config, machine.root, log);
    facts.display = machine.trial.display.name;
    facts.private_display = machine.trial.display.own;
    facts.limits = machine.limits;
    if (config.docker) { // which keeps those of its processes
        facts.limits = ProcessLimits();
        facts.limits.disk = machine.limits.disk;
    }
    if (config.slurm) { // which gives jobs processors and memory
        facts.limits.memory = 0;
        facts.limits.processors = 0;
    }
    facts.sandbox = machine.trial.sandbox.params;
    facts.webots = machine.simulator.program;
    facts.compiler = find_compiler(config, machine.simulator);
    if (config.service.allow_edit && facts.compiler.make.empty())
        log.info("Programs in C and C++ are not compiled here (docs/access.md, \"Who may change programs\")");
    facts.first_port = static_cast<std::uint16_t>(config.address.port + 1);
    facts.old_webots_tls = !config.network.ssl_certificate.empty() && !config.address.port_rewrite &&
                           config.address.path.empty();
    facts.environment = current_environment();
    for (auto& [name, value] : facts.environment)
        if (name == "WEBOTS_HOME")
            value = absolute_path(value);
    if (!config.docker)
        tell_environment(facts.environment, config.launching, log);
    return facts;
}

} // namespace webots_cloud::app
