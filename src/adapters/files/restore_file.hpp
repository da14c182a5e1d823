// Restores one file of a project as it was fetched.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <functional>
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

/// Makes the file `name` of an open folder anew, in one step, with this mode and for the folder's owner, as
/// where simulations run as users of their own. `fill` writes it, beside the old one. Blocks. Never through a
/// link, and nothing but the new file changes its owner, whatever a simulation does in the folder meanwhile.
/// Errors: those of `fill`; `unavailable`.
result<> replace_file(int folder, std::string const& name, mode_t mode,
                      std::function<result<>(int file)> const& fill);

} // namespace webots_cloud::adapters
