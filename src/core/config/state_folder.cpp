#include "state_folder.hpp"

#include "core/text.hpp"

namespace webots_cloud::core {

std::vector<StateFolder> state_folders(StateFolderContext const& context)
{
    namespace fs = std::filesystem;
    if (!context.configured.empty())
        return {StateFolder(context.configured, true)};
    auto const colon = context.state_directory.find(':');
    if (fs::path const first = context.state_directory.substr(0, colon); first.is_absolute())
        return {StateFolder(first, true)};
    std::vector<StateFolder> folders;
    if (fs::path const xdg = context.xdg_state_home; xdg.is_absolute())
        folders.emplace_back(xdg / "webots_cloud", false);
    else if (fs::path const home = context.home; home.is_absolute())
        folders.emplace_back(home / ".local" / "state" / "webots_cloud", false);
    folders.emplace_back(context.temporary / concat("webots-", std::to_string(context.user)), false);
    return folders;
}

std::filesystem::path cache_folder(StateFolderContext const& context, std::filesystem::path const& state)
{
    namespace fs = std::filesystem;
    if (fs::path const xdg = context.xdg_cache_home; xdg.is_absolute())
        return xdg / "webots_cloud";
    if (fs::path const home = context.home; home.is_absolute())
        return home / ".cache" / "webots_cloud";
    return spare_cache_folder(state);
}

std::filesystem::path spare_cache_folder(std::filesystem::path const& state)
{
    return state / "cache";
}

} // namespace webots_cloud::core
