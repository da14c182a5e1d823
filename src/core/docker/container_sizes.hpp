// What the containers of a simulation have written outside of its folder.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// `1.21GB (virtual 3.5GB)`, as docker prints it: what a container has added to its image. Docker rounds.
std::uint64_t container_bytes(std::string_view size);

/// What was written into the file systems of containers, and into which volumes.
struct ContainerSizes
{
    ContainerSizes() = default;

    std::uint64_t bytes = 0;
    std::vector<std::string> volumes; ///< Their names, each once.
};

/// The arguments of docker that list the containers of a simulation, as `parse_container_sizes` reads them.
std::vector<std::string> list_container_sizes(std::string_view project);

/// Docker rounds: the sum may be off by half a percent.
ContainerSizes parse_container_sizes(std::string_view listing);

/// The arguments of docker that list all volumes of the machine, as `volume_bytes` reads them: it can't list
/// the sizes of some.
std::vector<std::string> list_volume_sizes();

/// What lies in these volumes together.
std::uint64_t volume_bytes(std::string_view listing, std::vector<std::string> const& volumes);

} // namespace webots_cloud::core
