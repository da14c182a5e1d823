// How much disk a folder takes, as a seam.
#pragma once

#include <webots_cloud/export.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <filesystem>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What was found.
struct FolderUse
{
    FolderUse() = default;

    std::uint64_t bytes = 0;      ///< On disk, also of files that can't be read.
    bool too_many_files = false;  ///< There is more than was counted: very many files, or very deep folders.
    std::uint64_t free_bytes = 0; ///< On that disk, for everybody.

    bool operator==(FolderUse const&) const = default;
};

/// Measures how much of a disk a folder takes.
class FolderMeter
{
public:
    virtual ~FolderMeter() = default;

    /// Counts what lies in a folder in which strangers' programs work meanwhile, until `enough` bytes are
    /// found. A folder that is not there takes nothing.
    ///
    /// Cancellation: none; it ends after a bounded number of files.
    virtual boost::asio::awaitable<FolderUse> measure(std::filesystem::path folder, std::uint64_t enough) = 0;
};

} // namespace webots_cloud
