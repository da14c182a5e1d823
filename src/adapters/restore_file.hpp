// One file of a project, as it was fetched, over what became of it.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <string>

namespace webots_cloud::adapters {

/// Copies `<from>/<file>` over `<to>/<file>` in one step; missing folders are made. `file` is relative.
/// Blocks.
///
/// Follows no symbolic link on either side, so it leaves neither folder whatever a simulation has put there.
/// Errors: `not_found`: the project has no such file; `unavailable`.
result<> restore_file(std::filesystem::path const& from, std::filesystem::path const& to,
                      std::string const& file);

} // namespace webots_cloud::adapters
