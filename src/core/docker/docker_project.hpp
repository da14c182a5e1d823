// How a project is run in containers (protocol section 6.3): its image, its compose file, and the values in
// `.env`.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// Paths inside the containers.
inline constexpr std::string_view webots_in_container = "/usr/local/webots/webots";
inline constexpr std::string_view project_in_container = "/usr/local/webots-project";

/// The image for the release that the first line of a world names: `<repository>:R2023b-ubuntu22.04`.
///
/// Errors: `invalid_argument`: the line names none.
result<std::string> default_docker_image(std::string_view repository, std::string_view world_header);

/// Whether the Webots of that image can say which robots wait for controllers of others: from R2022b.
bool can_name_extern_robots(std::string_view world_header);

/// Why a simulation whose default image does not exist did not start.
Failure missing_image(std::string_view image);

/// Which of the operator's compose files a project wants.
enum class ComposeTemplate
{
    standard,
    theia,      ///< An editor beside the simulator.
    competition ///< That, and the participant's controller in a container of its own.
};

/// `docker-compose-default.yml` and its like.
std::string compose_template_file(ComposeTemplate kind);

/// The template for projects without a `Dockerfile` of their own that may be used.
inline constexpr char dockerfile_template[] = "Dockerfile.default";

/// What `webots.yml` requests.
struct WebotsYml
{
    WebotsYml() = default;

    ComposeTemplate kind = ComposeTemplate::standard;
    std::string volume;                ///< The folder that the editor shows, below `/usr/local/`.
    std::vector<std::string> messages; ///< For the browser, in the order of the file's lines.
};

/// Reads `webots.yml` line by line, like the Python server; it need not be valid YAML.
///
/// Errors: `invalid_argument`: a `dockerCompose:` line lacks its folder, or the folder is not a safe path.
result<WebotsYml> parse_webots_yml(std::string_view text);

/// The world of a competition, whose participant is a controller outside of Webots.
std::string with_extern_participant(std::string_view world);

/// A Dockerfile whose last step is the server's label. An image that loses its name loses its last step with
/// it, which is all that the next build of the project does anew: this one takes no time.
std::string with_last_step(std::string_view dockerfile, std::string_view server);

/// The name of a simulation for compose, with which those of its containers, networks and images begin:
/// `webots-2000-1f3a9c4d-17-<token>`. Somebody who builds an image could start from a simulation's whose name
/// they know: nobody guesses the token, 32 hexadecimal digits.
std::string compose_project(std::string_view identity, std::string_view label, std::string_view token);

/// The values that compose puts into its file.
struct DockerEnvironment
{
    DockerEnvironment() = default;

    std::string image;
    bool make = false; ///< The project has a `Makefile`.
    std::uint16_t port = 0;
    std::string project;              ///< Compose's project name.
    std::string server;               ///< The identity of this server, as a label.
    std::string world;                ///< The name of the world file.
    std::string stream_mode;          ///< What the browser requested.
    bool names_extern_robots = false; ///< As in `webots_command`; for images that know it.
    std::string display;
    bool own_display = false;     ///< The container starts an X server of its own, which its image must have.
    std::string runtime = "runc"; ///< What runs the containers: `nvidia` where there is such a processor.
    std::string graphics_device = "/dev/null";
    /// What stands before the ports that Docker opens on the machine: `127.0.0.1:` for this machine alone.
    std::string port_prefix;
    WebotsYml yml;
};

/// The text of the file `.env`.   Errors: `invalid_argument`: a value has characters that could end it early.
result<std::string> env_file(DockerEnvironment const& environment);

/// Whether we set this variable for compose: in the file `.env`, whose values the environment would override,
/// or in the environment.
bool is_set_for_compose(std::string_view name);

/// The environment of compose and docker: what they need of ours, the `entries` of `simulatorEnvironment`,
/// and variables that make them print the steps of a build.
std::vector<std::pair<std::string, std::string>>
docker_environment(std::vector<std::pair<std::string, std::string>> const& ours,
                   std::vector<std::string> const& entries = {});

/// `compose` is the beginning of the command line: `docker compose`, or `docker-compose`.
std::vector<std::string> compose_up(std::vector<std::string> compose, std::filesystem::path const& file);
std::vector<std::string> compose_down(std::vector<std::string> compose, std::filesystem::path const& file);
std::vector<std::string> compose_restart_controller(std::vector<std::string> compose,
                                                    std::filesystem::path const& file);

/// Arguments of docker: the running containers of a project, for `containers_with_project`.
std::vector<std::string> list_containers(std::string_view project);

/// Of that listing, the numbers of those that have a copy of the project: the simulator's, and the one of a
/// participant in a competition. Editors share a folder with one of them.
std::vector<std::string> containers_with_project(std::string_view listing);

/// Arguments of docker: brings a file of this machine into a container. `name`: within the project.
std::vector<std::string> copy_into_container(std::string_view container, std::filesystem::path const& file,
                                             std::filesystem::path const& name);

} // namespace webots_cloud::core
