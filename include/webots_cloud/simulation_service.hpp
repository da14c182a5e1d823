// The simulation server's protocol: /client, /load and /monitor, over any server adapter.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/public_address.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/host_metrics.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/simulation_logs.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace webots_cloud {

struct SimulationServiceParams
{
    SimulationServiceParams() { address.port = 2000; }

    PublicAddress address; ///< In what browsers are sent to; its port is for the monitor page.
    std::vector<std::string> allowed_repositories; ///< URL prefixes always accepted.
    std::vector<std::string> blocked_repositories; ///< URL prefixes refused when idle time is shared.
    double share_idle_time =
        50; ///< Percent: the highest load at which other repositories are accepted; 0: never.
    /// Simulations that a client may have, from start to end: `IncomingRequest::quota_key` says who is one.
    /// 0: any number.
    std::size_t simulations_per_address = 0;
    bool docker = false;     ///< Simulations run in containers.
    bool strict_load = true; ///< The load formula: strict, or the one of the Python reference.
    /// From the opening of a socket to its `start`. Default 30 s: an open page that starts nothing costs
    /// nothing.
    Duration handshake_timeout = std::chrono::seconds(30);
    /// Sockets that are open and have not started anything yet: of one client, and of all. One more, and the
    /// oldest is closed. Browsers ask for their start within a round trip, so that this is far more than they
    /// need.
    std::size_t waiting_per_address = 64;
    std::size_t max_waiting = 256;
    /// How long a simulation waits for a browser that lost its connection. Default 0: it ends at once.
    Duration reconnect_grace{};
    /// Makes the tokens by which browsers return: words that nobody guesses. Wanted with a grace only.
    std::function<std::string()> new_token;
    std::string title;               ///< Heading of the monitor page; empty: a standard one.
    std::string description;         ///< Paragraph of the monitor page.
    std::vector<std::string> notify; ///< URLs of registries, for the monitor page.
    /// Takes the lines of monitor.csv, its heading excluded, one a second; must not block. Empty: nobody
    /// wants them.
    std::function<void(std::string line)> monitor_log;
    std::shared_ptr<SimulationLogs> simulation_logs; ///< Keeps what simulators print. Null: nobody does.
    std::string notice; ///< Shown on the monitor page: for instance that this is the demo simulator.
    /// What is missing to keep simulations apart, a sentence: on the monitor page, in the answer of `/readyz`
    /// and as a figure. Empty: nothing is.
    std::string isolation_warning;
    /// What `GET /metrics` shows below the service's own figures: families in the text format of Prometheus.
    /// Must not wait.
    std::function<std::string()> more_metrics;
};

/// Runs one simulation per browser: fetch, launch, relay, clean up.
///
/// Inert until served by an adapter and `run()` is awaited, which measures the machine once a second.
/// Lifetime: everything passed by reference must outlive the service.
/// Thread-safety: one executor.
class SimulationService final : public Endpoint
{
public:
    SimulationService(SimulationServiceParams params, ProjectFetcher& fetcher, SimulationLauncher& launcher,
                      HostMetrics& metrics, Clock& clock, Logger log);
    ~SimulationService() override;

    /// Takes the repositories, the shared idle time, `simulations_per_address`, title and description of
    /// `params`; simulations that run go on.
    void apply(SimulationServiceParams const& params);

    /// Takes no new simulations from now on, and says so; with `exit_when_empty`, `run()` succeeds when the
    /// last has ended.
    void drain(bool exit_when_empty);

    /// Ends when cancelled, or when drained; from then on no browser is waited for.
    /// Cancellation: terminal.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    Answer respond(IncomingRequest const& request) override;
    boost::asio::awaitable<void> serve_websocket(ChannelInfo info, Channel& channel) override;
    void stopping() override;

    /// Percent: what `GET /load` answers.
    double load() const noexcept;

    /// Browsers whose simulation runs or is being started.
    std::size_t sessions() const noexcept;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
