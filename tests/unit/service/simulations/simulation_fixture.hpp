// A whole simulation server on fakes, and browsers that use it.
#pragma once

#include "service/run.hpp"
#include "service/setups.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"

#include <webots_cloud/simulation_service.hpp>
#include <webots_cloud/testing/fixed_metrics.hpp>
#include <webots_cloud/testing/loopback_channel.hpp>
#include <webots_cloud/testing/memory_project_source.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/recording_simulation_logs.hpp>
#include <webots_cloud/testing/scripted_processes.hpp>
#include <webots_cloud/testing/world.hpp>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud {

/// Of a server that waits for its browsers for `grace`.
inline ServiceSetup simulation_service_setup(Duration grace = {})
{
    ServiceSetup setup;
    setup.config.reconnect_grace = grace;
    setup.facts.address.host = "host.org";
    setup.facts.address.ssl = false;
    setup.facts.address.port_rewrite = false;
    setup.config.repositories.allowed = {"https://github.com/o"};
    return setup;
}

/// Tokens are `token1`, `token2` and so on; those in addresses `secreta`, `secretb`.
inline SimulationServiceHooks simulation_service_hooks(SimulationLogs* logs = nullptr)
{
    SimulationServiceHooks hooks;
    hooks.new_token = [n = 0]() mutable { return "token" + std::to_string(++n); };
    hooks.new_address_token = [n = 0]() mutable {
        return "secret" + std::string(1, static_cast<char>('a' + n++));
    };
    hooks.simulation_logs = logs;
    return hooks;
}

inline LauncherSetup simulation_launcher_setup(int max_simulations,
                                               ProcessLimits const& limits = ProcessLimits(),
                                               bool gateway = false)
{
    LauncherSetup setup;
    setup.config.gateway = gateway;
    setup.facts.limits = limits;
    setup.facts.webots = "/opt/webots/webots";
    setup.config.max_simulations = max_simulations;
    setup.config.timeout = std::chrono::seconds(600);
    setup.config.start_timeout = std::chrono::seconds(300);
    return setup;
}

inline ProjectFetcherParams project_fetcher_params()
{
    ProjectFetcherParams params;
    params.instances = "/instances";
    return params;
}

/// At its end nothing may be left: no process, port, directory, task or timer.
struct SimulationFixture
{
    explicit SimulationFixture(ServiceSetup setup, int max_simulations = 2)
        : SimulationFixture(std::move(setup), simulation_service_hooks(), max_simulations)
    {}

    /// With what the launcher needs beyond `simulation_launcher_setup`.
    SimulationFixture(ServiceSetup setup, LauncherSetup launching)
        : SimulationFixture(std::move(setup), simulation_service_hooks(), std::move(launching))
    {}

    /// What simulators print is recorded in `logs`.
    SimulationFixture(ServiceSetup setup, SimulationServiceHooks hooks, int max_simulations = 2,
                      ProcessLimits const& limits = ProcessLimits(), bool gateway = false)
        : SimulationFixture(std::move(setup), std::move(hooks),
                            simulation_launcher_setup(max_simulations, limits, gateway))
    {}

    SimulationFixture(ServiceSetup setup, SimulationServiceHooks hooks, LauncherSetup launching)
        : processes(world.clock), source(world.clock), logs(world.clock),
          fetcher(project_fetcher_params(), {Forge("https://github.com", source)}, log.logger(), &source),
          launcher(launching.config, launching.facts, processes, world.clock, log.logger()),
          service(setup.config, setup.facts, fetcher, launcher, metrics, world.clock, log.logger(),
                  with_logs(std::move(hooks))),
          tasks(world.executor())
    {
        source.add("o/r", "a.wbt");
        source.add("robots", "a.wbt");
        tasks.spawn(run(service));
        world.settle();
    }

    ~SimulationFixture()
    {
        tasks.cancel_all();
        world.run(tasks.join());
        BOOST_TEST(browsings.size() == 0u);
        BOOST_TEST(processes.alive() == 0);
        BOOST_TEST(processes.held() == 0u);
        BOOST_TEST(launcher.running() == 0u);
        BOOST_TEST(source.directories().empty());
        BOOST_TEST(logs.open_logs == 0);
        BOOST_TEST(service.sessions() == 0u);
        BOOST_TEST(world.clock.pending() == 0u);
    }

    /// A browser on /client. `client` is whose quota counts; empty: nobody's.
    testing::LoopbackChannel& connect(std::string const& client = {}, std::string path = "/client")
    {
        ChannelInfo info;
        info.path = std::move(path);
        info.client = info.quota_key = client;
        return connect_as(std::move(info));
    }

    testing::LoopbackChannel& connect_as(ChannelInfo info)
    {
        browsers.push_back(std::make_unique<testing::LoopbackChannel>(world.executor()));
        browsings.spawn(service.serve_websocket(std::move(info), *browsers.back()));
        world.settle();
        return *browsers.back();
    }

    /// A browser of a client whose first message is this.
    testing::LoopbackChannel& say(std::string const& client, std::string message)
    {
        auto& browser = connect(client);
        browser.browser_says(std::move(message));
        world.settle();
        return browser;
    }

    void leave(testing::LoopbackChannel& browser)
    {
        browser.browser_leaves();
        world.settle();
    }

    void lose(testing::LoopbackChannel& browser)
    {
        browser.browser_is_lost();
        world.settle();
    }

    HttpResponse get(std::string_view path)
    {
        IncomingRequest request;
        request.method = "GET";
        request.path = path;
        return std::get<HttpResponse>(service.respond(request));
    }

    /// How many lines of the log have this text.
    std::ptrdiff_t lines(std::string_view text) const
    {
        return std::count_if(log.lines.begin(), log.lines.end(),
                             [&](std::string const& line) { return line.find(text) != std::string::npos; });
    }

    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedProcesses processes;
    testing::MemoryProjectSource source;
    testing::RecordingSimulationLogs logs;
    testing::FixedMetrics metrics;
    ProjectFetcher fetcher;
    SimulationLauncher launcher;
    SimulationService service;
    std::vector<std::unique_ptr<testing::LoopbackChannel>> browsers;
    async::TaskGroup tasks;
    async::TaskGroup browsings{world.executor()};

private:
    SimulationServiceHooks with_logs(SimulationServiceHooks hooks)
    {
        hooks.simulation_logs = &logs;
        return hooks;
    }
};

} // namespace webots_cloud
