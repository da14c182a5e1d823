// Starts simulators and reports what they do: ready, running, idle, ended.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/docker_mode.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/private_display.hpp>
#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/sandbox.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

class SlurmMode;

/// With what controllers in C and C++ are compiled.
struct ControllerCompiler
{
    ControllerCompiler() = default;

    std::filesystem::path make; ///< Absolute. Empty: nothing is compiled.
    std::filesystem::path home; ///< `WEBOTS_HOME`, absolute; simulations can see it.
};

/// What SimulationLauncher has been given on this machine, found out at the start.
struct SimulationLauncherFacts
{
    SimulationLauncherFacts() = default;

    /// Absolute path of Webots, or of a program with the same command line.
    std::filesystem::path webots;
    /// Simulators listen on `first_port` to `first_port + max_simulations - 1`.
    std::uint16_t first_port = 2001;
    /// What `DISPLAY` is set to. Default `:0`. Empty: it is not set.
    std::string display = ":0";
    /// Gives each simulator a display of its own, in place of `display`. Not for containers. Default: none.
    PrivateDisplay private_display;
    /// Webots R2021b and older speak TLS themselves, with the certificate in their own folders.
    bool old_webots_tls = false;
    /// Our own environment, of which simulators get only what they need.
    std::vector<std::pair<std::string, std::string>> environment;
    /// Compiles within the walls of the simulation. Only for processes of this machine. Default: nothing
    /// does.
    ControllerCompiler compiler;
    /// How simulators are confined. Default: not at all. With containers Docker does it.
    SandboxParams sandbox;
    /// With `SimulationLauncherConfig::gateway`: an absolute folder that only we may enter, of at most 100
    /// bytes. Simulators with a network of their own are reached through sockets in there, and no port of the
    /// machine is opened for them. Empty: there is one for each, on all addresses.
    std::filesystem::path brokers;
    /// Of each simulation. A simulation that exceeds one is ended by the SimulationService. Default: none.
    /// With containers Docker keeps them.
    ProcessLimits limits;
};

/// What to simulate.
struct LaunchSpec
{
    LaunchSpec() = default;

    std::filesystem::path instance; ///< The instance directory, all that the simulator may change.
    std::filesystem::path root;     ///< The project's folder, which holds `worlds/`.
    std::filesystem::path world;    ///< The world file, absolute.
    std::string world_header;       ///< The first line of the world file, which names a release of Webots.
    std::string mode;               ///< As requested by the browser: empty, `x3d`, `w3d` or `mjpeg`.
    /// Start Webots R2021b or older, for a browser that expects that; of the modes it knows `mjpeg`.
    bool old_command_line = false;
    bool controller_edit = false;           ///< With the old command line: the browser may edit controllers.
    std::string label;                      ///< A prefix of log lines, and of container names.
    std::vector<std::string> needed_labels; ///< What the project needs of a machine.
    /// Webots R2022b or newer is to say which robots wait for controllers that somebody else starts.
    bool names_extern_robots = false;
    /// Gets every line that the simulator prints, except heartbeats; any bytes. Must not block. May be empty.
    std::function<void(std::string_view line)> output;
};

/// The progress of the start, for the browser: with containers, a line that compose or docker printed. Also
/// how much output was left out.
struct SimulationProgress
{
    SimulationProgress() = default;
    explicit SimulationProgress(std::string text) : text(std::move(text)) {}

    std::string text;
};

/// A simulator that had to wait for a node of a cluster has one: its time limit begins now.
struct SimulationAllocated
{
    SimulationAllocated() = default;
};

/// The world is loaded, and the simulator listens on `port`.
///
/// With `through_gateway` browsers are to reach it through the server alone, which finds it at that port of
/// `host` or, unless it is empty, through the socket `broker` (see `ProcessNetwork`).
struct SimulationReady
{
    SimulationReady() = default;
    explicit SimulationReady(std::uint16_t port) : port(port) {}

    std::uint16_t port = 0;
    bool through_gateway = false;
    std::string host = "127.0.0.1"; ///< A numeric address.
    std::filesystem::path broker;
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

/// A robot waits for a controller that somebody else starts: only with `LaunchSpec::names_extern_robots`.
struct SimulationExternRobot
{
    SimulationExternRobot() = default;
    explicit SimulationExternRobot(std::string name) : name(std::move(name)) {}

    std::string name; ///< Percent-encoded, as Webots compares it.
};

/// The simulator and everything that it started has ended; `reason` is a sentence for the browser.
struct SimulationEnded
{
    SimulationEnded() = default;

    Failure reason; ///< Without a sentence after `terminate`: who called it knows why.
    ExitStatus status;
    bool was_ready = false;
    std::optional<Limit> overrun; ///< The limit that it was ended for.
};

using SimulationEvent =
    std::variant<SimulationProgress, SimulationAllocated, SimulationReady, SimulationHeartbeat,
                 SimulationActivity, SimulationExternRobot, SimulationEnded>;

/// A controller of the project that is to be compiled.
struct ControllerSources
{
    ControllerSources() = default;
    ControllerSources(std::string name, std::filesystem::path folder, bool has_makefile)
        : name(std::move(name)), folder(std::move(folder)), has_makefile(has_makefile)
    {}

    std::string name;             ///< For messages.
    std::filesystem::path folder; ///< In the instance directory; absolute.
    bool has_makefile = false;    ///< Of its own.
};

/// What came of that.
struct Compilation
{
    Compilation() = default;

    std::string output; ///< What was printed: any bytes, the first 20,000 of them.
    /// Errors: `refused`: nothing is compiled here; `invalid_argument`: the sources are wrong; `timed_out`
    /// after 30 seconds; `start_failed`. The detail is a sentence for the browser.
    result<> outcome;
};

/// A started simulator. Destroying it kills what still runs, and returns its port to the pool.
///
/// Lifetime: must outlive its operations, but for those that say otherwise: await their end before it is
/// destroyed.
class Simulation
{
public:
    virtual ~Simulation() = default;

    /// What happens next; `SimulationEnded` is the last event.
    ///
    /// Cancellation: terminal; no event is lost.
    virtual boost::asio::awaitable<result<SimulationEvent>> next_event() = 0;

    /// Asks it to end; `SimulationEnded` follows. May be called at any time, and more than once.
    virtual void terminate() noexcept = 0;

    /// As `terminate`, because it has overrun a limit, which is the reason that its browser is told.
    virtual void terminate_at(Limit limit) noexcept = 0;

    virtual int process_id() const noexcept = 0;

    /// When it reaches its time limit.
    virtual TimePoint ends_at() const noexcept = 0;

    /// Has its time limit begin now: its first browser has come.
    virtual void restart_time() noexcept = 0;

    /// Puts off its time limit by what is asked for, or by what is left of
    /// `SimulationLauncherConfig::extendable`. Returns: by how much.
    virtual Duration extend(Duration asked) noexcept = 0;

    /// By how much its time limit can still be put off.
    virtual Duration extendable() const noexcept = 0;

    /// Whole messages of the project's `webots.yml`, which the browser gets before all others. Containers
    /// only.
    virtual std::vector<std::string> const& announcements() const noexcept = 0;

    /// To be called when `file` of the instance directory, absolute, was put back as it was: so it is where
    /// the simulator runs, if that has a copy of the project.
    ///
    /// Cancellation: terminal.
    /// Errors: `unavailable`; the detail is a sentence for the browser.
    virtual boost::asio::awaitable<result<>> put_back(std::filesystem::path file) = 0;

    /// Compiles a controller within the walls of the simulator; where that has a network of its own, the
    /// compiler has none. What it writes counts as the simulator's, but its processes and memory have limits
    /// of their own. Nothing of it runs any more when this has ended.
    ///
    /// Cancellation: terminal; then the outcome is `operation_aborted`.
    virtual boost::asio::awaitable<Compilation> compile(ControllerSources sources) = 0;

    /// What the simulator and everything that it started have consumed. The simulation may be destroyed while
    /// this runs.
    virtual boost::asio::awaitable<ProcessUsage> usage() = 0;

    /// What it has written outside of the instance directory. The simulation may be destroyed while this
    /// runs.
    virtual boost::asio::awaitable<WrittenElsewhere> written_elsewhere() = 0;
};

/// Starts simulators on ports of its own.
///
/// Lifetime: everything passed by reference must outlive the launcher, and the launcher its simulations and
/// its operations: await their end before it is destroyed.
/// Thread-safety: one executor.
class SimulationLauncher
{
public:
    /// `docker`: an open one, to run simulations in containers. `slurm`: an open one, to run them as jobs.
    /// Null: they are processes of this machine.
    SimulationLauncher(SimulationLauncherConfig config, SimulationLauncherFacts facts, ProcessHost& processes,
                       Clock& clock, Logger log, DockerMode* docker = nullptr, SlurmMode* slurm = nullptr);
    ~SimulationLauncher();

    /// Starts a simulator.
    ///
    /// Cancellation: terminal while a container is prepared, as by pulling its image. The start itself is not
    /// interrupted: a caller that was cancelled may get a simulation all the same.
    /// Errors: `unavailable` (every port is taken), `invalid_argument` (mode), `start_failed`, and those of
    /// `DockerMode::prepare`; the detail is a sentence for the browser.
    boost::asio::awaitable<result<std::unique_ptr<Simulation>>> launch(LaunchSpec spec);

    /// Simulators whose port is in use.
    std::size_t running() const noexcept;

    SimulationLauncherConfig const& config() const noexcept;
    SimulationLauncherFacts const& facts() const noexcept;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
