// What of the file system a server needs.
#pragma once

#include <webots_cloud/export.hpp>

#include <filesystem>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Files and folders with all that is in them; absolute.
struct OwnFiles
{
    OwnFiles() = default;

    std::vector<std::filesystem::path> read;
    std::vector<std::filesystem::path> write; ///< Read, too.
    std::vector<std::filesystem::path> tidy;  ///< Empty folders may be removed from these, and nothing else.
    /// Files are moved from one folder to another. Linux before 5.19 can confine only programs that
    /// move none.
    bool moves_files = false;
    bool signals = false; ///< Processes of others are signalled.
};

} // namespace webots_cloud
