// Starts simulators and tells what becomes of them: ready, running, idle, ended. Never loses track of one.
#pragma once

#include <webots_cloud/docker_mode.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace webots_cloud {

struct SimulationLauncherParams
{
    SimulationLauncherParams() = default;

    /// The program to run, absolute: Webots, or one that takes its command line.
    std::filesystem::path webots;
    /// Simulators listen on `first_port` to `first_port + max_simulations - 1`.
    std::uint16_t first_port = 2001;
    int max_simulations = 100;
    /// The longest life of a simulation. Default 2 hours; the browser is told.
    Duration timeout = std::chrono::hours(2);
    /// From the start of the program to its first sign of life. Default 5 min: some worlds load for minutes.
    /// For containers from the last word of compose, which may have to fetch an image and to build first.
    Duration start_timeout = std::chrono::minutes(5);
    /// From the polite request to end to the kill. Default 1.5 s.
    Duration grace = std::chrono::milliseconds(1500);
    /// What `DISPLAY` is set to. Default `:0`.
    std::string display = ":0";
    /// Webots R2021b and older shall speak TLS themselves, with the certificate in their own folders.
    bool old_webots_tls = false;
    /// What these are told of Janus, which shows their pictures as video: its address for browsers, and where
    /// it takes the stream. Default: none.
    std::string old_webots_multimedia_server;
    std::string old_webots_multimedia_stream;
    /// Our own environment, of which simulators get what they need.
    std::vector<std::pair<std::string, std::string>> environment;
    /// What they get besides: `NAME` and `PREFIX_*` of our environment, and `NAME=value`.
    std::vector<std::string> simulator_environment;
};

/// What to simulate.
struct LaunchSpec
{
    LaunchSpec() = default;

    std::filesystem::path root;  ///< The project's folder, which holds `worlds/`.
    std::filesystem::path world; ///< The world file, absolute.
    std::string world_header;    ///< Its first line, which names the release of Webots it was made with.
    std::string mode;            ///< What the browser asked for: empty, `x3d`, `w3d` or `mjpeg`.
    bool old_command_line =
        false; ///< Webots R2021b or older is started, for a browser that expects it; it has no modes.
    bool controller_edit = false; ///< With the old command line: the browser may edit controllers.
    std::string label;            ///< In front of log lines.
    /// Gets every line that the simulator prints, but its heartbeats; any bytes. Must not block. Empty:
    /// nobody wants them.
    std::function<void(std::string_view line)> output;
};

/// How far the start is, in the words of those who do it; for the browser. Containers only.
struct SimulationProgress
{
    SimulationProgress() = default;
    explicit SimulationProgress(std::string text) : text(std::move(text)) {}

    std::string text;
};

/// The world is loaded, and the simulator listens on `port`.
struct SimulationReady
{
    SimulationReady() = default;
    explicit SimulationReady(std::uint16_t port) : port(port) {}

    std::uint16_t port = 0;
};

/// The simulator's sign of life, every five seconds.
struct SimulationHeartbeat
{
    SimulationHeartbeat() = default;
};

/// A browser paused the simulation, or let it run.
struct SimulationActivity
{
    SimulationActivity() = default;
    explicit SimulationActivity(bool running) : running(running) {}

    bool running = false;
};

/// The simulator and everything it started is gone; `reason` is a sentence for the browser.
struct SimulationEnded
{
    SimulationEnded() = default;

    std::string reason;
    ExitStatus status;
    bool was_ready = false;
};

using SimulationEvent = std::variant<SimulationProgress, SimulationReady, SimulationHeartbeat,
                                     SimulationActivity, SimulationEnded>;

/// A simulator that was started. Its port returns to the pool when it is destroyed, which also kills what
/// still runs.
class Simulation
{
public:
    virtual ~Simulation() = default;

    /// What happens next; `SimulationEnded` exactly once and last.
    /// Cancellation: terminal, nothing is lost.
    virtual boost::asio::awaitable<result<SimulationEvent>> next_event() = 0;

    /// Asks it to end; `SimulationEnded` follows. Safe at any moment, more than once.
    virtual void terminate() noexcept = 0;

    virtual int process_id() const noexcept = 0;

    /// When it is ended for its age, at the latest.
    virtual TimePoint ends_at() const noexcept = 0;

    /// Whole messages that the browser gets before all others: what the project says of itself. Containers
    /// only.
    virtual std::vector<std::string> const& announcements() const noexcept = 0;

    /// What the simulator and everything it started have consumed. The simulation may be destroyed meanwhile.
    virtual boost::asio::awaitable<ProcessUsage> usage() = 0;
};

/// Starts simulators on ports of its own.
///
/// Lifetime: everything passed by reference must outlive the launcher, and the launcher its simulations.
/// Thread-safety: one executor.
class SimulationLauncher
{
public:
    /// `docker`: simulations run in containers; it is open. Null: they run on this machine itself.
    SimulationLauncher(SimulationLauncherParams params, ProcessHost& processes, Clock& clock, Logger log,
                       DockerMode* docker = nullptr);
    ~SimulationLauncher();

    /// Starts a simulator.
    /// Errors: `unavailable` (every port is taken), `invalid_argument` (mode), `start_failed`, and those of
    /// `DockerMode::prepare`; the detail is a sentence for the browser.
    boost::asio::awaitable<result<std::unique_ptr<Simulation>>> launch(LaunchSpec spec);

    /// Simulators whose port is not back in the pool.
    std::size_t running() const noexcept;

    SimulationLauncherParams const& params() const noexcept;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
