// Removes what simulations and builds leave behind in Docker.
#pragma once

#include "core/docker/docker_leftovers.hpp"
#include "docker_commands.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/awaitable.hpp>

#include <set>
#include <string>
#include <vector>

namespace webots_cloud {

/// Lifetime: everything passed by reference must outlive it.
/// Thread-safety: one executor.
class DockerCleanup
{
public:
    DockerCleanup(DockerConfig const& config, DockerFacts const& facts, DockerCommands const& commands,
                  Clock& clock, Logger log)
        : config_(config), facts_(facts), commands_(commands), clock_(clock), log_(std::move(log))
    {}

    /// Removes containers, networks, volumes and names of images of a simulation, until nothing is found any
    /// more; an empty name: of all simulations of this server.
    ///
    /// Errors: `unavailable`, and as `run_program`.
    boost::asio::awaitable<result<>> remove_leftovers(std::string project);

    /// Removes containers that docker creates for builds that were given up, until no more are expected.
    ///
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> watch_builds();

    /// Removes names of images of simulations that have ended: docker may finish a build that was given up,
    /// and name its image. Failures are logged.
    boost::asio::awaitable<void> remove_late_names(std::set<std::string> projects);

    /// Removes old images that no container uses. Failures are logged.
    boost::asio::awaitable<void> remove_old_images();

    /// Removes what was built first while more is kept of builds than there may be, but nothing that running
    /// builds have named. Failures are logged.
    boost::asio::awaitable<void> bound_builds(std::set<std::string> in_use);

private:
    boost::asio::awaitable<result<std::size_t>> remove_once(core::DockerScope const& scope);
    boost::asio::awaitable<result<std::size_t>> remove_kind(core::LeftoverKind kind,
                                                            core::DockerScope const& scope);
    boost::asio::awaitable<void> remove_builds(std::vector<std::string> containers);
    boost::asio::awaitable<std::vector<std::string>> find_old_images();

    DockerConfig const& config_;
    DockerFacts const& facts_;
    DockerCommands const& commands_;
    Clock& clock_;
    Logger log_;
};

} // namespace webots_cloud
