#include "start_trial.hpp"

#include "app/launch_backends.hpp"
#include "app/project_sources.hpp"
#include "core/doctor/simulation_findings.hpp"
#include "core/text.hpp"

#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/this_coro.hpp>

#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <variant>

namespace webots_cloud::app {
namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

constexpr auto world_url = "local:/doctor/empty/blob/main/worlds/empty.wbt";
constexpr auto empty_world = "#VRML_SIM R2023b utf8\nWorldInfo {\n}\nViewpoint {\n}\n";
constexpr std::size_t max_printed_lines = 10; // the last ones that it prints
constexpr std::size_t max_printed_line = 300;

/// A folder that can be the forge of a `local:` project.
result<> write_projects(fs::path const& projects)
{
    auto const world = projects / "doctor" / "empty" / "worlds" / "empty.wbt";
    std::error_code failed;
    fs::create_directories(world.parent_path(), failed);
    std::ofstream file(world);
    file << empty_world << std::flush;
    return file ? result<>()
                : result<>(Failure(errc::unavailable, core::concat(world.string(), " can't be written")));
}

/// Until it has loaded its world, or has ended.
asio::awaitable<void> await_start(Simulation& simulation, core::StartReading& reading)
{
    for (;;) {
        auto const event = co_await simulation.next_event();
        if (!event) {
            reading.outcome = event.error();
            co_return;
        }
        if (std::holds_alternative<SimulationReady>(*event)) {
            reading.outcome = result<>();
            co_return;
        }
        if (auto const* ended = std::get_if<SimulationEnded>(&*event)) {
            reading.outcome = ended->reason;
            co_return;
        }
    }
}

/// It is asked to end, and nothing of it is left afterwards.
asio::awaitable<void> end_simulation(Simulation& simulation)
{
    simulation.terminate();
    for (;;) {
        auto const event = co_await simulation.next_event();
        if (!event || std::holds_alternative<SimulationEnded>(*event))
            co_return;
    }
}

asio::awaitable<core::StartReading> start_and_end(SimulationLauncher& launcher, Project const& project,
                                                  Clock& clock)
{
    core::StartReading reading;
    LaunchSpec spec;
    spec.instance = project.directory;
    spec.root = project.root;
    spec.world = project.world;
    spec.world_header = project.world_header;
    spec.mode = "mjpeg";
    spec.label = "doctor";
    spec.output = [&reading](std::string_view line) {
        if (reading.printed.size() == max_printed_lines)
            reading.printed.erase(reading.printed.begin());
        reading.printed.push_back(core::printable(line, max_printed_line));
    };
    auto const began = clock.now();
    auto const simulation = co_await launcher.launch(std::move(spec));
    if (!simulation) {
        reading.outcome = simulation.error();
        co_return reading;
    }
    co_await await_start(**simulation, reading);
    reading.took = clock.now() - began;
    if (reading.outcome)
        co_await end_simulation(**simulation);
    co_return reading;
}

} // namespace

asio::awaitable<core::Finding> try_start(SimulationConfig const& configured, SimulationMachine const& machine,
                                         fs::path const& folder, Clock& clock)
{
    auto config = configured;
    core::StartReading reading;
    // The whole way of a visitor's start, but without the network: a folder is the forge, and its world is
    // empty.
    ForgeConfig forge("local:");
    forge.directory = folder / "projects";
    if (auto const written = write_projects(forge.directory); !written) {
        reading.outcome = written;
        co_return core::judge_start(reading);
    }
    config.forges.assign(1, forge);
    Logger const silent;
    auto const executor = co_await asio::this_coro::executor;
    ProjectSources sources(executor, config, machine, silent);
    config.launching.start_timeout = empty_start_limit;
    SimulationLauncher launcher(config.launching, launcher_facts(config, machine, silent), *machine.processes,
                                clock, silent);
    auto wanted = sources.fetcher().parse(world_url);
    auto progress = std::make_shared<FetchProgress>();
    result<Project> project = Failure(errc::not_found, "the world of the doctor has no address");
    if (wanted)
        project = co_await sources.fetcher().fetch(std::move(*wanted), std::move(progress));
    if (!project) {
        reading.outcome = project.error();
        co_return core::judge_start(reading);
    }
    reading = co_await start_and_end(launcher, *project, clock);
    co_await sources.fetcher().discard(std::move(*project));
    co_return core::judge_start(reading);
}

} // namespace webots_cloud::app
