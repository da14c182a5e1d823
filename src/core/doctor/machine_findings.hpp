// What the readings of this machine mean for an operator: folders, memory, clock, open files.
#pragma once

#include "finding.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// A folder that a server writes into, or that of its parents which is there.
struct FolderReading
{
    FolderReading() = default;

    std::filesystem::path path;
    bool exists = true;      ///< False: the server will make it.
    std::string problem;     ///< Why nothing can be written there, as in "Permission denied"; empty: it can.
    std::uint64_t free = 0;  ///< Bytes that are left for us,
    std::uint64_t total = 0; ///< of so many.
    std::uint64_t free_files = 0;  ///< The same of inodes;
    std::uint64_t total_files = 0; ///< 0: the file system does not count them.
};

/// `wanted`: bytes that the server may need there. `key`: what changes the folder, for the remedy.
Finding judge_folder(std::string_view subject, std::string_view key, FolderReading const& reading,
                     std::uint64_t wanted);

/// `wanted`: bytes that the server may need.
Finding judge_memory(std::uint64_t available, std::uint64_t total, std::uint64_t wanted);

/// Whether somebody sets the clock of this machine right, as far as the kernel knows.
Finding judge_clock(bool is_synchronised);

inline constexpr std::string_view lost_log_subject = "log file";

/// A log file that is not there any more, as the server knows it: somebody has removed or replaced it, or its
/// folder, while the server ran.
Finding judge_lost_log(std::string_view path);

/// The limit of open files, and the most connections that the server wants to keep.
Finding judge_open_files(std::uint64_t limit, std::uint64_t wanted);

} // namespace webots_cloud::core
