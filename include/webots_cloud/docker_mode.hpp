// Simulations in containers (protocol section 6.3): prepares projects for compose, and cleans up after them.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/process_host.hpp>
#include <webots_cloud/transport/text_files.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

struct LaunchSpec;

/// What DockerMode has been given on this machine, found out at the start.
struct DockerFacts
{
    DockerFacts() = default;

    /// Absolute paths of the programs; empty: not installed.
    std::filesystem::path docker;
    std::filesystem::path docker_compose;
    /// The program that lets containers use this machine's screen; empty: they can't.
    std::filesystem::path xhost;
    /// Names this server among all that run containers on this machine, and stays the same from run to run:
    /// `webots-2000-1f3a9c4d`. Compose's project names begin with it, so that left-overs are recognised.
    std::string identity;
    std::string display = ":0"; ///< On which containers draw; they see no other. Empty: none of this machine.
    ProcessLimits limits;       ///< Of each container, and each step of a build. Default: none.
    bool own_displays = false;  ///< Each starts an X server of its own (`xvfb-run` in the image).
    /// What simulators reach. Needs root, but for `host`, which is what Docker's own networks reach.
    ProcessNetwork network;
    std::string name_server; ///< Where they ask for names then; empty: nowhere.
    /// The graphics device for the containers, or `/dev/null`.
    std::string graphics_device = "/dev/null";
    /// Our own environment, of which docker gets only what it needs.
    std::vector<std::pair<std::string, std::string>> environment;
};

/// What docker mode asks of the machine.
struct DockerModeHooks
{
    DockerModeHooks() = default;

    /// Whether a file exists now: the socket of the display. Default: none does.
    std::function<bool(std::filesystem::path const&)> exists;
    /// Makes names of simulations, and labels, that nobody can guess: 32 hexadecimal digits. Required.
    std::function<std::string()> new_token;
};

/// How to run a simulation that has been prepared: as processes of this machine, in containers, or as a job
/// of Slurm.
struct LaunchPlan
{
    LaunchPlan() = default;

    ProcessSpec process;            ///< Webots, or compose in the foreground, with its cleanup command.
    ProcessSpec restart_controller; ///< For competitions; otherwise without arguments.
    std::string command;            ///< For the log; empty: the process's.
    std::string project;            ///< Compose's project name.
    std::string job;                ///< The name of its job; empty: it is none.
    std::uint64_t job_memory = 0;   ///< Bytes that the job may use; 0: Slurm decides.
    std::string image;              ///< The default image; empty: the project has its own Dockerfile.
    std::vector<std::string> announcements; ///< Whole messages for the browser, sent before all others.
    std::vector<std::string> notes;         ///< Sentences for the browser, shown while it waits.
};

/// Docker on this machine. A live object: await `run()` as long as it is used.
///
/// Lifetime: everything passed by reference must outlive it. It must outlive its operations: await their end
/// before it is destroyed.
/// Thread-safety: one executor.
class DockerMode
{
public:
    /// The `directory` of `config` is absolute. Of `launching`, which is that of the launcher, containers
    /// obey two keys: with `gateway` the ports that Docker opens are reached from this machine alone, and
    /// docker gets the variables of `simulator_environment`, to which compose files can refer.
    DockerMode(DockerConfig config, SimulationLauncherConfig launching, DockerFacts facts,
               ProcessHost& processes, TextFiles& files, Clock& clock, Logger log, DockerModeHooks hooks);
    ~DockerMode();

    /// Finds docker and compose, and removes what an earlier run of this server left behind.
    ///
    /// Errors: `not_found`: no docker, or no compose; `unavailable`: docker does not answer. The detail is a
    /// sentence for the operator.
    boost::asio::awaitable<result<>> open();

    /// After `open` and after each `clear`, watches for 20 seconds or more whether docker creates containers
    /// for builds that were given up, and removes them; and removes what `clear` could not remove, once
    /// docker answers again. Limits steps of builds as simulations are limited.
    ///
    /// Precondition: `open` succeeded.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    /// Writes the files that docker and compose need beside the project.
    ///
    /// Precondition: `open` succeeded.
    /// Errors: `not_found` (a template, or a file of a competition), `invalid_argument`, `unavailable`; the
    /// detail is a sentence for the browser.
    boost::asio::awaitable<result<LaunchPlan>> prepare(LaunchSpec const& spec, std::uint16_t port);

    /// Forgets a project that was prepared and could not be started.
    void forget(std::string const& project) noexcept;

    /// A line of compose, which may name what is built for a project that was prepared.
    void note(std::string const& project, std::string_view line);

    /// What the containers of a project have written into their file systems and volumes, and what its build
    /// has made, as docker has counted it in the last ten seconds, two while it is built, or, where it takes
    /// long to count, not so often. 0 where it does not answer.
    boost::asio::awaitable<WrittenElsewhere> written(std::string project);

    /// Brings a file below the root of a project that was prepared into those of its containers that have a
    /// copy of the project and run. The calling object may be destroyed while this runs.
    ///
    /// Errors: as docker says.
    boost::asio::awaitable<result<>> put_back(std::string project, std::filesystem::path root,
                                              std::filesystem::path file);

    /// Removes whatever is left of a project that was prepared and has ended, old images, and what is kept
    /// of builds beyond `build_cache`.
    boost::asio::awaitable<void> clear(std::string project);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
