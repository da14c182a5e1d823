#include "state_folder.hpp"

#include "core/text.hpp"

namespace webots_cloud::core {

std::vector<StateFolder> state_folders(StateSurroundings const& surroundings)
{
    namespace fs = std::filesystem;
    if (!surroundings.configured.empty())
        return {StateFolder(surroundings.configured, true)};
    auto const colon = surroundings.state_directory.find(':');
    if (fs::path const first = surroundings.state_directory.substr(0, colon); first.is_absolute())
        return {StateFolder(first, true)};
    std::vector<StateFolder> folders;
    if (fs::path const xdg = surroundings.xdg_state_home; xdg.is_absolute())
        folders.emplace_back(xdg / "webots_cloud", false);
    else if (fs::path const home = surroundings.home; home.is_absolute())
        folders.emplace_back(home / ".local" / "state" / "webots_cloud", false);
    folders.emplace_back(surroundings.temporary / concat("webots-", std::to_string(surroundings.user)),
                         false);
    return folders;
}

} // namespace webots_cloud::core
