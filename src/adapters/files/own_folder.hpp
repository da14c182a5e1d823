// Our folders, which simulations of the same user may have changed or replaced.
#pragma once

#include "file_descriptor.hpp"

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

/// Renames the entry `name` of the open folder `parent` to an unused name, and returns a message about it.
/// `path` is its path in that message.   Errors: that of the system.
result<std::string> set_aside(int parent, char const* name, std::filesystem::path const& path);

/// What to do with a folder that belongs to another user.
enum class Foreign
{
    refuse,
    set_aside
};

/// Opens the folder at `path`, whose parent folder is `parent`, for us alone; creates it if necessary. Never
/// follows a link.
///
/// Anything else with its name is renamed, a mode that admits others or excludes us is corrected, and
/// `notices` gets a message for each. Errors: `invalid_argument` if it belongs to another user, otherwise
/// that of the system.
result<FileDescriptor> open_own_folder(int parent, std::filesystem::path const& path, Foreign foreign,
                                       std::vector<std::string>& notices);

/// Makes the folder, which nobody else can then change or look into, and those above it where they are
/// missing; and tries whether files can be made in it. A folder whose mode admits others is closed, and what
/// is no folder gets another name.   Returns: sentences about that.
///
/// Errors: `invalid_argument`: it belongs to another user; otherwise that of the system, such as a disk that
/// is full.
result<std::vector<std::string>> make_own_folder(std::filesystem::path const& path);

} // namespace webots_cloud::adapters
