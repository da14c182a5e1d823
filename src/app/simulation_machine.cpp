// Prepares the machine before the server confines itself, in the order in which one thing needs the other:
// folders, the simulator, who runs it in which sandbox (machine_trial), processes.
#include "simulation_machine.hpp"

#include "adapters/files/own_folder.hpp"
#include "core/docker/docker_project.hpp"
#include "core/sandbox/limits.hpp"
#include "core/text.hpp"
#include "environment.hpp"
#include "simulation_folders.hpp"

#include <webots_cloud/adapters/host.hpp>
#include <webots_cloud/adapters/processes.hpp>

#include <unistd.h>

#include <string>

namespace webots_cloud::app {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using core::concat;

/// On a disk that is full no project could be copied, nor a sandbox be made.
result<adapters::InstanceRoot> open_instances(core::StateFolder const& folder, std::string const& name)
{
    auto root = adapters::InstanceRoot::open(folder.path, name,
                                             folder.may_be_link ? adapters::InstanceRoot::State::may_be_link
                                                                : adapters::InstanceRoot::State::no_link);
    if (!root)
        return root;
    if (auto const usable = adapters::make_own_folder(root->path().parent_path()); !usable)
        return Failure(usable.error().code(),
                       concat(usable.error().message(),
                              ". Make room there, or set \"stateDir\" to a folder on another disk"));
    return root;
}

bool is_in_use(Failure const& failure)
{
    return failure.code() == boost::system::errc::resource_unavailable_try_again;
}

/// The folder for the projects of running simulations, in the first state folder that works.
result<adapters::InstanceRoot> open_instances(SimulationConfig const& config, Logger const& log)
{
    auto const name = std::to_string(config.address.port);
    auto const folders = state_folders(config);
    auto root = open_instances(folders.front(), name);
    for (std::size_t i = 1; i < folders.size() && !root && !is_in_use(root.error()); ++i) {
        log.warning(concat(root.error().message(), ". Trying ", folders[i].path.string(), " instead."));
        root = open_instances(folders[i], name);
    }
    if (!root) {
        auto const failure =
            is_in_use(root.error()) ? Failure(errc::unavailable, root.error().message()) : root.error();
        return failure.within(concat("no simulation server on port ", name));
    }
    for (auto const& notice : root->notices())
        log.warning(notice);
    if (auto const removed = root->left_overs().removed; removed > 0)
        log.info(concat("Removed ", std::to_string(removed), " left-over instance directories"));
    return root;
}

/// In the folder of the user, or beside the working files.
fs::path choose_cache(SimulationConfig const& config, adapters::InstanceRoot const& root, Logger const& log)
{
    auto const state = root.path().parent_path().parent_path();
    auto folder = cache_folder(config, state);
    auto const usable = adapters::make_own_folder(folder);
    if (usable) {
        for (auto const& notice : *usable)
            log.warning(notice);
        return folder;
    }
    auto spare = spare_cache_folder(config, state);
    log.warning(concat("Projects that are fetched can't be kept in ", folder.string(), ": ",
                       usable.error().message(), ". They are kept in ", spare.string(), " instead."));
    return spare;
}

/// Folders that simulations must not change: the cache, which later simulations are made of, and their logs.
std::vector<fs::path> read_only_folders(SimulationConfig const& config, fs::path const& cache)
{
    std::vector<fs::path> folders;
    std::error_code failed;
    // All of them, not this port's alone: a server that finds its own in use takes the next one.
    auto const caches = cache.parent_path();
    for (auto const& folder : {absolute_path(caches), absolute_path(config.log_dir / "simulation")}) {
        // A folder that is made later would be writable for simulations that run already.
        fs::create_directories(folder, failed);
        if (fs::is_directory(folder, failed))
            folders.push_back(folder);
    }
    return folders;
}

} // namespace

result<core::SimulatorChoice> find_simulator(SimulationConfig const& config, fs::path const& programs)
{
    if (!config.docker)
        return core::choose_simulator(absolute_path(config.webots_home),
                                      absolute_path(environment("WEBOTS_HOME")), programs, is_program);
    core::SimulatorChoice choice;
    choice.program = core::webots_in_container;
    return choice;
}

asio::awaitable<result<std::unique_ptr<SimulationMachine>>> prepare_machine(asio::any_io_executor executor,
                                                                            SimulationConfig const& config,
                                                                            fs::path programs, Clock& clock,
                                                                            Logger log)
{
    auto simulator = find_simulator(config, programs);
    if (!simulator)
        co_return simulator.error();
    auto const guard = programs / "webots-process-guard";
    if (!is_program(guard))
        co_return Failure(errc::start_failed,
                          concat("There is no program ", guard.string(),
                                 ", which starts simulations: build it, or install the server again"));
    if (!simulator->notice.empty())
        log.warning(simulator->notice);
    // Before anything is tried: a second server on this port ends here, and disturbs nothing of the first
    // one.
    auto root = open_instances(config, log);
    if (!root)
        co_return root.error();
    auto machine = std::make_unique<SimulationMachine>(std::move(*simulator), std::move(*root));
    machine->cache = choose_cache(config, machine->root, log);
    machine->guard = guard;
    machine->metrics = make_host_metrics();
    auto const host = machine->metrics->description();
    machine->limits = core::simulation_limits(config.limits, host.memory_bytes, host.cores);
    ControlGroupsParams grouping;
    grouping.enabled =
        !config.docker && !config.slurm && machine->limits.any(); // those have groups of their own
    grouping.may_use_root = ::geteuid() == 0;
    auto const groups = make_control_groups(grouping);
    machine->group_folders = control_group_mounts(*groups);

    TrialContext context;
    context.simulator = machine->simulator.program;
    context.guard = machine->guard;
    context.state = machine->instances().parent_path();
    context.read_only = read_only_folders(config, machine->cache);
    context.read_only.insert(context.read_only.end(), machine->group_folders.begin(),
                             machine->group_folders.end());
    context.limits = machine->limits;
    context.limit_support = limit_support(*groups);
    machine->processes = make_process_host(executor, machine->guard, context.read_only, groups,
                                           machine->metrics->graphics_times());
    machine->trial = co_await try_machine(config, std::move(context), *machine->processes, clock);
    // Also where the trial fails: the remarks say what has led to that.
    machine->trial.remarks.tell(log);
    if (!machine->trial.outcome)
        co_return machine->trial.outcome.error();
    // Only now it is known which users simulations have: without them, a server that is not root can't remove
    // what they have left.
    co_await remove_left_overs(machine->root, machine->trial.user.subordinate, machine->guard, log);
    co_return machine;
}

} // namespace webots_cloud::app
