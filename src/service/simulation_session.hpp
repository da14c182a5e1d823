// The life of one browser on /client: from its `start` to the last cleaned-up byte.
#pragma once

#include "../core/client_protocol.hpp"
#include "../core/repository_policy.hpp"
#include "../core/simulation_board.hpp"
#include "../core/start_figures.hpp"

#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace webots_cloud {

/// What the sessions of a server share: the parts that they work with, and what decides over their starts.
struct SessionSurroundings
{
    SessionSurroundings(ProjectFetcher& projects, SimulationLauncher& simulators, Clock& time, Logger logger)
        : fetcher(projects), launcher(simulators), clock(time), log(std::move(logger))
    {}

    ProjectFetcher& fetcher;
    SimulationLauncher& launcher;
    Clock& clock;
    Logger log;
    core::PublicAddress address;
    core::RepositoryPolicy policy;
    double load = 0;       ///< Of this machine at the last look, in percent.
    bool draining = false; ///< No new simulation is taken.
    core::StartFigures starts;
};

/// What one browser has.
///
/// Lifetime: the surroundings must outlive it.   Thread-safety: one executor.
class SimulationSession
{
public:
    enum class State
    {
        fetching,
        launching,
        idle,
        running
    };

    SimulationSession(SessionSurroundings& surroundings, std::uint64_t id, core::SimulationRequest request);

    /// Fetches, launches and relays until the browser leaves or the simulation ends, then cleans up. Once
    /// only.
    ///
    /// Not cancellable: the browser's leave ends it.
    boost::asio::awaitable<void> run(Channel& channel);

    State state() const noexcept { return state_; }
    bool is_starting() const noexcept { return state_ == State::fetching || state_ == State::launching; }

    /// Takes a look at what the simulator consumes. Costs some small reads per process.
    void look_at_processes();

    core::SimulationRow row() const;

private:
    boost::asio::awaitable<void> host(Channel& channel);
    boost::asio::awaitable<void> watch(Channel& channel);
    boost::asio::awaitable<result<>> fetch(Channel& channel);
    boost::asio::awaitable<result<Project>> fetch_requested(std::shared_ptr<FetchProgress> progress);
    boost::asio::awaitable<result<>> launch(Channel& channel);
    LaunchSpec launch_spec() const;
    boost::asio::awaitable<result<>> show_progress(std::shared_ptr<FetchProgress const> progress,
                                                   Channel& channel);
    boost::asio::awaitable<void> relay(Channel& channel);
    boost::asio::awaitable<void> clean_up();
    result<> admission() const;
    void refuse(Channel& channel, Failure const& failure);
    void tell(Channel& channel, std::string_view error);
    void pass(core::StartStage stage);
    std::string name() const;

    SessionSurroundings& surroundings_;
    std::uint64_t id_;
    core::SimulationRequest request_;
    State state_ = State::fetching;
    TimePoint since_;
    TimePoint stage_began_;
    bool start_over_ = false; ///< It got ready, or it failed.
    std::optional<Project> project_;
    std::unique_ptr<Simulation> simulation_;
    bool ended_ = false; ///< The simulation has reported its end.

    ProcessUsage used_;         ///< At the last look.
    TimePoint looked_;          ///< When that was; at first when the simulator was started.
    std::optional<double> cpu_; ///< Percent of one processor, between the last two looks.
};

} // namespace webots_cloud
