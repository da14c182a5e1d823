// The simulation server's protocol: /client, and what operators and session servers ask, over any server
// adapter.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/public_address.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/simulation_walls.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/controllers.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/folder_meter.hpp>
#include <webots_cloud/transport/host_metrics.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/picture_taker.hpp>
#include <webots_cloud/transport/simulation_logs.hpp>
#include <webots_cloud/transport/simulator_talk.hpp>
#include <webots_cloud/transport/text_files.hpp>
#include <webots_cloud/transport/world_finder.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What SimulationService is told of its server and machine, found out at the start.
struct SimulationServiceFacts
{
    SimulationServiceFacts() { address.port = 2000; }

    PublicAddress address; ///< Where browsers are sent; its port is for the monitor page.
    SimulationWalls walls; ///< Other repositories are accepted only where these are high enough.
    std::string notice;    ///< Shown on the monitor page: for instance that this is the demo simulator.
    /// A sentence that says why simulations are not isolated from each other: for the monitor page, the
    /// answer of `/readyz` and a metric. Empty: they are.
    std::string isolation_warning;
    /// A sentence that says which limits simulations can exceed here, for the monitor page. Empty: none.
    std::string limits_warning;
    /// How simulations are confined, for the monitor page, as in `bubblewrap, public internet only`.
    std::string sandbox;
    /// What this machine can run, for session servers: as in `LoadReport::labels`.
    std::vector<std::string> labels;
    /// What simulations draw on, for the monitor page, as in `:0, shared by all`.
    std::string display;
};

/// What a SimulationService calls besides what its constructor requires. Each may be empty; none may block.
struct SimulationServiceHooks
{
    SimulationServiceHooks() = default;

    /// Makes the tokens with which browsers return, which nobody can guess. Not set: no browser can return.
    std::function<std::string()> new_token;
    /// Why a browser that came with a ticket may start no simulation, a sentence; empty: it may, this once.
    /// The ticket is empty for browsers without one. Not set: tickets mean nothing.
    std::function<std::optional<Failure>(std::string_view ticket)> refuse_ticket;
    /// Makes the tokens in the addresses of simulations, which nobody can guess: letters only. Required where
    /// the launcher's `gateway` is true. Without, the monitor page is not live behind a session server.
    std::function<std::string()> new_address_token;
    /// Takes the lines of monitor.csv, without its heading, one each second.
    std::function<void(std::string line)> monitor_log;
    /// Keeps what simulators print; must outlive the service.
    SimulationLogs* simulation_logs = nullptr;
    /// Reads and writes the programs of simulations where `SimulationServiceConfig::allow_edit` is true; must
    /// outlive the service. Null: nobody can change them.
    TextFiles* program_files = nullptr;
    /// Measures the folders of simulations with a limit of disk; must outlive the service. Null: nobody does.
    FolderMeter* folder_meter = nullptr;
    /// Finds the worlds that `GET /worlds` lists; must outlive the service. Null: none.
    WorldFinder* world_finder = nullptr;
    /// Takes the pictures of `GET /worlds/picture/...`; must outlive the service. Null: there are none.
    PictureTaker* picture_taker = nullptr;
    /// Says to simulators behind the gateway what their page asks for before it is connected; must outlive
    /// the service. Null: pages say it themselves.
    SimulatorTalk* simulator_talk = nullptr;
    /// What `GET /metrics` shows below the service's own figures: families in the text format of Prometheus.
    std::function<std::string()> more_metrics;
};

/// Runs one simulation per browser: fetch, launch, relay, clean up.
///
/// Inert until served by an adapter and `run()` is awaited, which measures the machine once a second.
/// Lifetime: everything passed by reference must outlive the service, and the service must outlive its
/// operations: await their end before it is destroyed.
/// Thread-safety: one executor.
class SimulationService final : public Endpoint, public ControllerDoor
{
public:
    SimulationService(SimulationServiceConfig config, SimulationServiceFacts facts, ProjectFetcher& fetcher,
                      SimulationLauncher& launcher, HostMetrics& metrics, Clock& clock, Logger log,
                      SimulationServiceHooks hooks = SimulationServiceHooks());
    ~SimulationService() override;

    /// Obeys another configuration from now on; running simulations go on.
    void apply(SimulationServiceConfig config);

    /// Takes no new simulations from now on, and logs that; with `exit_when_empty`, `run()` succeeds when the
    /// last one has ended.
    void drain(bool exit_when_empty);

    /// Ends when cancelled, or when drained and empty; from then on it waits for no browser that lost its
    /// connection.
    ///
    /// Cancellation: terminal.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    Answer respond(IncomingRequest const& request) override;
    std::uint64_t max_body(IncomingRequest const& request) override;
    boost::asio::awaitable<HttpResponse> respond_to_body(IncomingRequest const& request) override;
    boost::asio::awaitable<void> serve_websocket(ChannelInfo info, Channel& channel) override;
    void stopping() override;
    result<ControllerWay> way_of_controller(std::uint16_t machine, std::string_view key,
                                            std::string_view robot) override;

    /// Percent: what `GET /load` answers.
    double load() const noexcept;

    /// Browsers whose simulation runs or is being started.
    std::size_t sessions() const noexcept;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
