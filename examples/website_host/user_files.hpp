// The files that the users of the website have saved: `<folder>/<user>/projects/<project>/...`.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace website_host {

inline constexpr std::uint64_t disk_quota = 10'000'000; ///< Bytes for each user.
inline constexpr std::size_t max_files = 1000;          ///< Of each user.

/// A name of a file or folder that can't lead anywhere else, and that every program can handle: ASCII
/// letters, digits, `_`, `-`, `.` and blanks, not beginning with a dot or blank, 100 bytes at most.
bool is_plain_name(std::string_view name);

/// Thread-safety: one thread at a time, which may have to wait for the disk.
class UserFiles
{
public:
    explicit UserFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

    /// Stores `content` as the file `filename` in the folder `dirname` of the user's projects, whose names
    /// are plain. A file that is there is replaced, at once or not at all.
    ///
    /// Errors: `too_large`: the quota; `unavailable`.
    webots_cloud::result<> save(std::uint32_t user, std::string_view dirname, std::string const& filename,
                                std::string_view content) const;

    /// A zip file of what the user has saved of a project.
    ///
    /// Errors: `not_found`: nothing; `unavailable`.
    webots_cloud::result<std::string> zip(std::uint32_t user, std::string const& project) const;

    /// How that folder is called in answers.
    static std::string name_of(std::uint32_t user, std::string const& project);

private:
    std::filesystem::path folder_;
};

} // namespace website_host
