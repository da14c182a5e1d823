// Which files a project needs beside its own to run in containers (protocol section 6.3).
#pragma once

#include "container_walls.hpp"
#include "docker_project.hpp"
#include "project_dockerfile.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// What is read of a project to decide how it runs.
struct ProjectTexts
{
    ProjectTexts() = default;

    /// The files to read, in the order that the constructor expects.
    static std::vector<std::string> names();

    /// `texts`: of each name, the text of the file, or nothing where there is none.
    explicit ProjectTexts(std::vector<std::optional<std::string>> const& texts);

    std::string yml;                       ///< `webots.yml`, or else `webots.yaml`.
    std::optional<std::string> dockerfile; ///< The project's own.
    std::string dockerignore;
    bool has_makefile = false;
    bool has_compose_file = false;
};

/// What is read of a competition, besides.
struct CompetitionTexts
{
    CompetitionTexts() = default;

    std::optional<std::string> world;
    std::optional<std::string> controller_dockerfile; ///< Of the participant's controller.
    std::optional<std::string> launcher;              ///< The operator's `remote_controller_launcher`.
};

inline constexpr char controller_dockerfile[] = "controllers/Dockerfile";
inline constexpr char controller_launcher[] = "remote_controller_launcher.py";

/// A file to write beside a project: its name, relative to the project's folder, and its text.
using ContainerFile = std::pair<std::string, std::string>;

/// What a competition adds to a project.
struct CompetitionFiles
{
    CompetitionFiles() = default;

    std::vector<ContainerFile> files;
    std::vector<std::string> bases; ///< As `ProjectDockerfile::bases`.
};

/// The participant's controller runs outside of Webots, in a container that the project describes. Where its
/// Dockerfile does not say what to start, that is the launcher. `world` is the name of the world file.
///
/// Errors: `not_found`: the project has no Dockerfile for it; and as `project_dockerfile`.
result<CompetitionFiles> competition_files(CompetitionTexts const& texts, std::string const& world,
                                           DockerfileTerms const& terms);

/// The files for compose and docker, whatever is being run, without the operator's list of system calls.
/// `dockerfile` is the one to build with.
std::vector<ContainerFile> container_files(ProjectTexts const& project, std::string dockerfile,
                                           std::string env_file, std::string compose_file,
                                           ContainerWalls const& walls);

/// Sentences for the browser about files of the project that this server does not use.
std::vector<std::string> unused_file_notes(ProjectTexts const& project, bool uses_project_dockerfile);

} // namespace webots_cloud::core
