// File systems that are mounted inside a project's directory.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::adapters {

/// The mount points at or below `directory` that a `/proc/self/mountinfo` lists, the innermost first.
std::vector<std::string> mounts_below(std::string_view mountinfo, std::string_view directory);

/// Detaches everything that is mounted at or below `directory`. Nothing there: success. Blocks.   Errors:
/// `unavailable`.
result<> unmount_below(std::filesystem::path const& directory);

} // namespace webots_cloud::adapters
