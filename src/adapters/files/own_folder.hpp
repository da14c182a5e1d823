// Folders of ours that simulations, which run as the same user, may have changed or replaced.
#pragma once

#include "file_descriptor.hpp"

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

/// Gives what is called `name` in the open folder `parent` a new name that nobody has, and says so in a
/// sentence. `path` is what people call it.   Errors: that of the system.
result<std::string> set_aside(int parent, char const* name, std::filesystem::path const& path);

/// What to do with a folder that belongs to another user.
enum class Foreign
{
    refuse,
    set_aside
};

/// Opens the folder at `path`, whose parent folder is `parent`, for us alone; makes it if need be. Never
/// follows a link.
///
/// What is in the way is set aside, a mode that lets others in or us not is mended, and `notices` gets a
/// sentence for each. Errors: `invalid_argument` where it is another user's, and otherwise that of the
/// system.
result<FileDescriptor> open_own_folder(int parent, std::filesystem::path const& path, Foreign foreign,
                                       std::vector<std::string>& notices);

} // namespace webots_cloud::adapters
