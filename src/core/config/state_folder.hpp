// Chooses the folders for the simulation server's working files, and for what it fetches.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::core {

/// A candidate for the folder.
struct StateFolder
{
    StateFolder() = default;
    StateFolder(std::filesystem::path path, bool may_be_link)
        : path(std::move(path)), may_be_link(may_be_link)
    {}

    std::filesystem::path path;
    bool may_be_link =
        false; ///< The operator, or systemd, has chosen it: whether it is a link is theirs to say.

    bool operator==(StateFolder const&) const = default;
};

/// What the choice depends on; empty: not set.
struct StateFolderContext
{
    std::filesystem::path configured; ///< `stateDir`, absolute.
    std::string state_directory; ///< `STATE_DIRECTORY`, which systemd sets: folders with colons between them.
    std::string xdg_state_home;  ///< `XDG_STATE_HOME`
    std::string xdg_cache_home;  ///< `XDG_CACHE_HOME`
    std::string home;            ///< `HOME`
    std::filesystem::path temporary; ///< The folder for temporary files.
    unsigned user = 0;               ///< Our number, for a folder that all users share.
};

/// The folders to try, the best first: what the operator or systemd names, alone; or else one in the home
/// folder, and if that can't be used, one in the folder for temporary files.
std::vector<StateFolder> state_folders(StateFolderContext const& context);

/// The folder for what is fetched: `state`, the one of the working files, is ours alone, and holds it where
/// the user has no folder for such files. (In a folder that everybody shares, somebody else may have been
/// there first.)
std::filesystem::path cache_folder(StateFolderContext const& context, std::filesystem::path const& state);

/// Where it is if that one can't be used.
std::filesystem::path spare_cache_folder(std::filesystem::path const& state);

} // namespace webots_cloud::core
