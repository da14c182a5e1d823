// Restores one file of a project as it was fetched.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <string>

#include <sys/types.h>

namespace webots_cloud::adapters {

/// Copies `<from>/<file>` over `<to>/<file>` in one step, with its permissions and those of `also`; missing
/// folders are made. `file` is relative. Blocks.
///
/// Follows no symbolic link on either side, so it stays within both folders, whatever a simulation has put
/// there. Errors: `not_found`: the project has no such file; `unavailable`.
result<> restore_file(std::filesystem::path const& from, std::filesystem::path const& to,
                      std::string const& file, mode_t also = 0);

} // namespace webots_cloud::adapters
