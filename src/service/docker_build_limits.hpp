// Keeps the limits of builds.
#pragma once

#include "core/simulation/webots_output.hpp"
#include "docker_commands.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>
#include <vector>

namespace webots_cloud {

/// Follows docker, and limits each step of a build of this server as soon as it runs.
///
/// Lifetime: everything passed by reference must outlive it.
/// Thread-safety: one executor.
class DockerBuildLimits
{
public:
    DockerBuildLimits(DockerModeParams const& params, DockerCommands const& commands, ProcessHost& processes,
                      Clock& clock, Logger log)
        : params_(params), commands_(commands), processes_(processes), clock_(clock), log_(std::move(log))
    {}

    /// Whether there are any that docker can set for a container that runs.
    bool any() const;

    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

private:
    boost::asio::awaitable<void> follow();
    boost::asio::awaitable<void> limit(std::vector<std::string> containers);

    DockerModeParams const& params_;
    DockerCommands const& commands_;
    ProcessHost& processes_;
    Clock& clock_;
    Logger log_;
};

} // namespace webots_cloud
