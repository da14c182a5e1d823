#include "project_world.hpp"

#include "core/text.hpp"

#include <fstream>

namespace webots_cloud::adapters {

result<std::string> require_world(std::filesystem::path const& root, std::string const& world)
{
    auto const path = root / "worlds" / world;
    std::error_code failed;
    std::ifstream file;
    if (std::filesystem::is_regular_file(path, failed)) // a pipe would block us
        file.open(path, std::ios::binary);
    if (!file.is_open())
        return Failure(errc::not_found, core::concat(core::printable(world, 200), " does not exist."));
    std::string line(256, '\0');
    file.read(line.data(), static_cast<std::streamsize>(line.size()));
    line.resize(static_cast<std::size_t>(file.gcount()));
    return line.substr(0, line.find_first_of("\r\n"));
}

} // namespace webots_cloud::adapters
