// Writes the files beside a project with which compose runs it.
#pragma once

#include "core/docker/container_files.hpp"

#include "docker_commands.hpp"

#include <webots_cloud/docker_mode.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/text_files.hpp>

#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace webots_cloud {

/// A project whose files have been written.
struct ContainerProject
{
    ContainerProject() = default;

    core::DockerEnvironment environment;
    bool uses_project_dockerfile = false; ///< Otherwise it is built with ours.
    bool builds_what_it_says = false;     ///< Commands of the project run while images are built.
    bool own_network = false;             ///< The simulator has none of Docker's.
    std::string token;                    ///< Of the simulator's container.
    std::vector<std::string> notes;       ///< Sentences for the browser.
};

/// Lifetime: everything passed by reference must outlive it.
/// Thread-safety: one executor.
class DockerProjectFiles
{
public:
    DockerProjectFiles(DockerConfig const& config, SimulationLauncherConfig const& launching,
                       DockerFacts const& facts, TextFiles& files, DockerCommands const& commands,
                       DockerModeHooks hooks)
        : config_(config), launching_(launching), facts_(facts), files_(files), commands_(commands),
          hooks_(std::move(hooks))
    {}

    /// Reads the project and our templates, and writes what compose needs. `runtime` is what runs the
    /// containers.
    ///
    /// Errors: as `DockerMode::prepare`.
    boost::asio::awaitable<result<ContainerProject>> write(LaunchSpec const& spec, std::uint16_t port,
                                                           std::string const& runtime);

private:
    result<core::DockerEnvironment> environment(LaunchSpec const& spec, std::uint16_t port,
                                                std::string const& runtime) const;
    core::ContainerWalls walls_of(std::string const& compose_file, bool confines_build, bool competes) const;
    std::filesystem::path display_socket() const;
    boost::asio::awaitable<result<std::string>> read_template(std::string name);
    boost::asio::awaitable<result<core::CompetitionFiles>>
    competition_files(LaunchSpec const& spec, core::DockerfileTerms const& terms);
    core::DockerfileTerms dockerfile_terms(core::DockerEnvironment const& environment) const;
    boost::asio::awaitable<result<>> check_bases(std::vector<std::string> bases);
    boost::asio::awaitable<result<core::ProjectDockerfile>>
    choose_dockerfile(core::ProjectTexts const& texts, bool own, core::DockerfileTerms const& terms);

    DockerConfig const& config_;
    SimulationLauncherConfig const& launching_;
    DockerFacts const& facts_;
    TextFiles& files_;
    DockerCommands const& commands_;
    DockerModeHooks hooks_;
};

} // namespace webots_cloud
