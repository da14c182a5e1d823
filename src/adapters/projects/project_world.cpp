#include "project_world.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

#include <fstream>
#include <utility>

namespace webots_cloud::adapters {
namespace {

/// At most this many bytes of a file that was opened.
std::string beginning_of(std::ifstream& file, std::size_t length)
{
    std::string text(length, '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(file.gcount()));
    return text;
}

/// The first line of the world file.
result<std::string> require_world(std::filesystem::path const& root, std::string const& world)
{
    auto const path = root / "worlds" / world;
    std::error_code failed;
    std::ifstream file;
    if (std::filesystem::is_regular_file(path, failed)) // a pipe would block us
        file.open(path, std::ios::binary);
    if (!file.is_open())
        return core::refused(core::Refused::no_world, {{"file", core::printable(world, 200)}});
    auto const line = beginning_of(file, 256);
    return line.substr(0, line.find_first_of("\r\n"));
}

} // namespace

result<FetchedProject> finished_project(std::filesystem::path root, std::string revision,
                                        std::string const& world)
{
    auto header = require_world(root, world);
    if (!header)
        return header.error();
    FetchedProject project;
    project.webots_yml = read_webots_yml(root);
    project.root = std::move(root);
    project.revision = std::move(revision);
    project.world_header = std::move(*header);
    return project;
}

std::string read_webots_yml(std::filesystem::path const& root)
{
    constexpr std::size_t longest = std::size_t{64} << 10;
    for (auto const* name : {"webots.yml", "webots.yaml"}) {
        std::error_code failed;
        if (std::filesystem::symlink_status(root / name, failed).type() !=
            std::filesystem::file_type::regular)
            continue;
        if (std::ifstream file(root / name, std::ios::binary); file.is_open())
            return beginning_of(file, longest);
    }
    return {};
}

} // namespace webots_cloud::adapters
