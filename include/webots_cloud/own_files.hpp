// What of the file system a server needs.
#pragma once

#include <filesystem>
#include <vector>

namespace webots_cloud {

/// Files and folders with all that is in them; absolute.
struct OwnFiles
{
    OwnFiles() = default;

    std::vector<std::filesystem::path> read;
    std::vector<std::filesystem::path> write; ///< Read, too.
};

} // namespace webots_cloud
