// Runs docker, compose and xhost.
#pragma once

#include <webots_cloud/docker_mode.hpp>

#include <string>
#include <vector>

namespace webots_cloud {

/// Starts commands with the environment that docker may have, for a minute at most.
///
/// Lifetime: everything passed by reference must outlive it.
/// Thread-safety: one executor.
class DockerCommands
{
public:
    DockerCommands(SimulationLauncherConfig const& launching, DockerFacts const& facts,
                   ProcessHost& processes, Clock& clock)
        : launching_(launching), facts_(facts), processes_(processes), clock_(clock)
    {}

    ProcessSpec spec(std::vector<std::string> argv) const;

    /// What the command prints.
    ///
    /// Errors: as `run_program`.
    boost::asio::awaitable<result<std::string>> run(ProcessSpec spec) const;
    boost::asio::awaitable<result<std::string>> run(std::vector<std::string> argv) const;

    /// The same for what may take five minutes, such as fetching an image that a project starts from.
    boost::asio::awaitable<result<std::string>> run_long(std::vector<std::string> argv) const;

    /// What `docker` prints with these arguments.
    ///
    /// Errors: as `run_program`.
    boost::asio::awaitable<result<std::string>> docker(std::vector<std::string> arguments) const;

private:
    SimulationLauncherConfig const& launching_;
    DockerFacts const& facts_;
    ProcessHost& processes_;
    Clock& clock_;
};

} // namespace webots_cloud
