// Copies a folder of the operator's into a project's directory.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/project_source.hpp>

#include <atomic>
#include <filesystem>

namespace webots_cloud::adapters {

/// Copies folders and files below `from` into the existing folder `to`; what is neither (links, devices,
/// sockets, pipes) is left out. Notes in `progress` how many bytes that were. Blocks.
///
/// Errors: `too_large`, `unavailable` (disk), `operation_aborted` soon after `aborted` becomes true; the
/// detail is a sentence.
result<> copy_tree(std::filesystem::path const& from, std::filesystem::path const& to,
                   FetchLimits const& limits, FetchProgress& progress, std::atomic<bool> const& aborted);

} // namespace webots_cloud::adapters
