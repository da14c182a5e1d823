// Keeps the limits of builds.
#pragma once

#include "async/wakeup.hpp"
#include "docker_commands.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/awaitable.hpp>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace webots_cloud {

/// While simulations run that build what a project says, follows docker, and limits each step of a build of
/// this server as soon as it runs.
///
/// Lifetime: everything passed by reference must outlive it.
/// Thread-safety: one executor.
class DockerBuildLimits
{
public:
    DockerBuildLimits(DockerFacts const& facts, DockerCommands const& commands, ProcessHost& processes,
                      Clock& clock, Logger log)
        : facts_(facts), commands_(commands), processes_(processes), clock_(clock), log_(std::move(log))
    {}

    /// From now on steps of builds may run, for this simulation.
    void begin(std::string project);
    /// It has ended.
    void end(std::string const& project) noexcept;

    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

private:
    boost::asio::awaitable<void> follow();
    boost::asio::awaitable<void> limit(std::vector<std::string> containers);

    DockerFacts const& facts_;
    DockerCommands const& commands_;
    ProcessHost& processes_;
    Clock& clock_;
    Logger log_;
    std::map<std::string, WallTime> projects_; ///< That may build, and since when.
    std::unique_ptr<Process> following_;       ///< Null: docker is not followed.
    bool is_ending_ = false;                   ///< Docker was told to end, since nothing was built.
    std::optional<async::Wakeup> begun_;       ///< While `run()` is awaited.
};

} // namespace webots_cloud
