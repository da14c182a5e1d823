// Finds out what of Docker there is on this machine.
#pragma once

#include "docker_commands.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>
#include <vector>

namespace webots_cloud {

/// The Docker of this machine.
struct DockerEngine
{
    DockerEngine() = default;

    std::vector<std::string> compose; ///< The beginning of its command line.
    std::string runtime = "runc";     ///< What runs the containers.
    bool confines_builds = false;     ///< As `core::confines_builds`.
};

/// Asks docker and compose for their versions.
///
/// Errors: as `DockerMode::open`.
boost::asio::awaitable<result<DockerEngine>> find_docker(DockerFacts const& facts,
                                                         DockerCommands const& commands);

/// Lets containers use this machine's screen, if there is an `xhost`. Failures are logged.
boost::asio::awaitable<void> open_screen(DockerFacts const& facts, DockerCommands const& commands,
                                         Logger const& log);

} // namespace webots_cloud
