// Files that the operator names, which may be something else: a pipe without a writer, a device without an
// end.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <filesystem>
#include <string>

namespace webots_cloud::adapters {

/// All bytes of a regular file. Never blocks, whatever kind of file it is.
///
/// Errors: `unavailable`, its detail the reason alone: that of the operating system, "it is a folder", "it is
/// no regular file", or "it is larger than <limit> bytes".
result<std::string> read_regular_file(std::filesystem::path const& path, std::size_t limit);

} // namespace webots_cloud::adapters
