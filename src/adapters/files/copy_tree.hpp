// Copies a folder that is the operator's (of a forge that is a folder, or a website's template) into the
// directory of a simulation. Others can't change it, so paths are good enough here: what strangers wrote is
// opened safely by folder_walk and project_files.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/project_source.hpp>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>

namespace webots_cloud::adapters {

/// Copies folders and files below `from` into the existing folder `to`; what is neither (links, devices,
/// sockets, pipes) is left out. `progress.bytes_received` is the bytes that were copied so far. Blocks.
///
/// Errors: `too_large`, `unavailable` (disk), `operation_aborted` soon after `aborted` becomes true; the
/// detail is a sentence.
result<> copy_tree(std::filesystem::path const& from, std::filesystem::path const& to,
                   FetchLimits const& limits, FetchProgress& progress, std::atomic<bool> const& aborted);

/// What is below the folder, as far as names, sizes and times of change tell: a text that is another one
/// after whatever is changed there. Empty: it can't be read, has more than `most_files`, or `aborted` was
/// set. Blocks.
std::string tree_state(std::filesystem::path const& folder, std::uint32_t most_files,
                       std::atomic<bool> const& aborted);

} // namespace webots_cloud::adapters
