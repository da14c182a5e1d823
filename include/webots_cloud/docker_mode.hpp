// Simulations in containers (protocol section 6.3): what is put beside a project, how it is run, what is
// cleared away.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/process_host.hpp>
#include <webots_cloud/transport/text_files.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace webots_cloud {

struct LaunchSpec;

struct DockerModeParams
{
    DockerModeParams() = default;

    /// Where the programs are, absolute; empty: not on this machine.
    std::filesystem::path docker;
    std::filesystem::path docker_compose;
    /// Lets containers onto this machine's screen; empty: they are not.
    std::filesystem::path xhost;
    /// The operator's `docker-compose-default.yml` and its like, and `Dockerfile.default`.
    std::filesystem::path templates;
    /// Of the default images, without a tag.
    std::string images = "cyberbotics/webots.cloud";
    /// By which this server knows its containers again, see `core::docker_identity`; and a word of this run
    /// of it.
    std::string identity;
    std::string run;
    /// The `Dockerfile` of a project is built in place of ours. Its compose file never is.
    bool project_dockerfiles = false;
    /// Present: images that are older than two days and in no use are removed, but these (`repository:tag`).
    std::optional<std::vector<std::string>> persistent_images;
    std::string display = ":0";
    /// What the containers get of the graphics processor: a device, or `/dev/null`.
    std::string graphics_device = "/dev/null";
    /// Our own environment, of which docker gets what it needs.
    std::vector<std::pair<std::string, std::string>> environment;
    /// What docker gets besides, so that compose files can refer to it: `NAME` and `PREFIX_*` of our
    /// environment, and `NAME=value`.
    std::vector<std::string> simulator_environment;
};

/// A project that is ready to be run.
struct ContainerPlan
{
    ContainerPlan() = default;

    ProcessSpec process;                    ///< Compose, in the foreground; the guard clears away after it.
    ProcessSpec restart_controller;         ///< For competitions; otherwise without arguments.
    std::string project;                    ///< Compose's name for all of it.
    std::string image;                      ///< The default image; empty: the project's own Dockerfile says.
    std::vector<std::string> announcements; ///< Whole messages for the browser, before all others.
    std::vector<std::string> notes;         ///< Sentences for it, shown while it waits.
};

/// Docker on this machine. A live object: `run()` is to be awaited as long as it is used.
///
/// Lifetime: everything passed by reference must outlive it.
/// Thread-safety: one executor.
class DockerMode
{
public:
    DockerMode(DockerModeParams params, ProcessHost& processes, TextFiles& files, Clock& clock, Logger log);
    ~DockerMode();

    /// Finds out which compose there is, and removes what a dead predecessor left.
    /// Errors: `not_found`: no compose; `unavailable`: docker does not answer; the detail is a sentence for
    /// the operator.
    boost::asio::awaitable<result<>> open();

    /// After `open` and after each `clear`, watches for 20 seconds whether docker makes a container for a
    /// build that nobody waits for any more, and removes it.
    /// Precondition: `open` succeeded.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    /// Puts beside the project what docker needs.
    /// Precondition: `open` succeeded.
    /// Errors: `not_found` (a template), `invalid_argument`, `unavailable`; the detail is a sentence for the
    /// browser.
    boost::asio::awaitable<result<ContainerPlan>> prepare(LaunchSpec const& spec, std::uint16_t port);

    /// Of a project that was prepared and could not be run.
    void forget(std::string const& project) noexcept;

    /// Makes sure that nothing is left of a project that was prepared and has ended, and lets old images go.
    boost::asio::awaitable<void> clear(std::string project);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
