// Fetches a project, starts a simulator for it, waits until it is ready, and cleans up: what a simulation
// server does for each browser, without any browser.
//
//     04_run_a_simulation PROGRAMS EXAMPLES WORLD_URL
//
// PROGRAMS is the folder of webots-process-guard and webots-demo-simulator, EXAMPLES the folder that holds
// demo_projects.
#include <webots_cloud/adapters.hpp>
#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/simulation_launcher.hpp>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <system_error>

using namespace webots_cloud;
namespace asio = boost::asio;
namespace fs = std::filesystem;

/// Awaits the simulator's events until it is ready, then ends it and awaits its end.
asio::awaitable<result<>> run_until_ready(Simulation& simulation)
{
    for (;;) {
        auto const event = co_await simulation.next_event();
        if (!event)
            co_return event.error();
        if (auto const* ready = std::get_if<SimulationReady>(&*event)) {
            std::cout << "ready: " << (ready->port != 0 ? "it listens" : "no port") << '\n';
            simulation.terminate();
        } else if (auto const* ended = std::get_if<SimulationEnded>(&*event)) {
            std::cout << "ended: " << (ended->was_ready ? "after it was ready" : ended->reason.message())
                      << '\n';
            co_return result<>();
        }
    }
}

asio::awaitable<result<>> simulate(ProjectFetcher& fetcher, SimulationLauncher& launcher, std::string url)
{
    auto const ref = fetcher.parse(url);
    if (!ref)
        co_return ref.error();
    auto const progress = std::make_shared<FetchProgress>();
    auto const project = co_await fetcher.fetch(*ref, progress);
    if (!project)
        co_return project.error();
    LaunchSpec spec;
    spec.world = project->world;
    spec.world_header = project->world_header;
    spec.mode = "mjpeg";
    auto const simulation = co_await launcher.launch(std::move(spec));
    result<> outcome;
    if (simulation)
        outcome = co_await run_until_ready(**simulation);
    else
        outcome = simulation.error();
    co_await fetcher.discard(*project);
    co_return outcome;
}

int main(int argc, char** argv)
{
    if (argc != 4) {
        std::cerr << "usage: " << argv[0] << " PROGRAMS EXAMPLES WORLD_URL\n";
        return 2;
    }
    asio::io_context context(1);
    auto const executor = context.get_executor();
    auto const clock = make_steady_clock(executor);
    auto const processes = make_process_host(executor, fs::path(argv[1]) / "webots-process-guard");
    auto const projects = make_directory_source(argv[2]);

    // For what it fetches: its own, and empty at first.
    auto instances = (fs::temp_directory_path() / "webots_cloud_XXXXXX").string();
    if (!::mkdtemp(instances.data())) {
        std::cerr << "no folder can be made in " << fs::temp_directory_path() << '\n';
        return 1;
    }
    ProjectFetcherParams fetching;
    fetching.instances = instances;
    ProjectFetcher fetcher(fetching, {Forge("local:", *projects)}, Logger());
    SimulationLauncherFacts facts;
    facts.webots = fs::path(argv[1]) / "webots-demo-simulator";
    facts.first_port = 42001;
    SimulationLauncher launcher(SimulationLauncherConfig(), facts, *processes, *clock, Logger());

    int status = 1;
    auto const report = [&](std::exception_ptr failure, result<> const& outcome) {
        if (failure)
            std::rethrow_exception(failure);
        status = outcome ? 0 : 1;
        if (!outcome)
            std::cout << outcome.error().message() << '\n';
    };
    asio::co_spawn(context, simulate(fetcher, launcher, argv[3]), report);
    context.run();
    std::error_code kept;
    fs::remove(instances, kept);
    return status;
}
