// What is taken from containers beyond what the operator's compose file takes from them.
#pragma once

#include <webots_cloud/process_limits.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Its text lies beside `docker-compose.yml`, and is read by compose after that.
inline constexpr char walls_file_name[] = "docker-compose.walls.yml";
/// The copy of `system_calls_template` beside it.
inline constexpr char system_calls_file_name[] = "docker-compose.seccomp.json";
/// The operator's list of the system calls that containers may use.
inline constexpr char system_calls_template[] = "seccomp.json";

/// The names of the services of a compose file, as people write them: keys below `services:`, all indented
/// alike. Empty: it can't be understood.
std::vector<std::string> compose_services(std::string_view compose_file);

struct ContainerWalls
{
    ContainerWalls() = default;

    bool own_display = false; ///< The simulator starts an X server of its own, by `xvfb-run`.
    /// The socket of the X display of the machine that they may draw on; they see no other. Empty: none.
    std::filesystem::path display_socket;
    bool own_network =
        false; ///< The simulator gets its network from us, and the controller of a competition none.
    /// Nothing is reached while the image is built, unless the operator has chosen a network for that.
    bool builds_without_network = false;            ///< The simulator's image.
    bool controller_builds_without_network = false; ///< That of the participant of a competition.
    /// There is a list of system calls, for all services but the editor and those for which the operator has
    /// chosen another.
    bool system_calls = false;
    std::string name_server; ///< Of that network; empty: none.
    /// What tells the simulator's container from all others: the value of its label `simulator_label`, which
    /// nobody guesses. Labels of images, such as compose's, are whatever the maker of an image likes.
    std::string token;
    ProcessLimits limits; ///< Of each container; that of disk is each file's.
};

/// The service that runs the simulator.
inline constexpr char simulator_service[] = "webots";

inline constexpr char simulator_label[] = "webots_cloud.simulator";

/// Whether the operator has chosen the network of the simulator in the compose file: then it is not ours to
/// change.
bool chooses_network(std::string_view compose_file);

/// A compose file that is to be merged with `compose_file`, which stays what the operator has written: no
/// service of it has capabilities that it does not ask for (`cap_add`), and none can gain any.
std::string walls_file(std::string_view compose_file, ContainerWalls const& walls);

} // namespace webots_cloud::core
