// Files that the operator names, which may be something else: a pipe without a writer, a device without an
// end.
#pragma once

#include "file_descriptor.hpp"

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <filesystem>
#include <string>

namespace webots_cloud::adapters {

/// All bytes of a regular file. Never waits for anybody, whatever stands there.
///
/// Errors: `unavailable`, its detail the reason alone: that of the operating system, "it is a folder", "it is
/// no regular file", or "it is larger than <limit> bytes".
result<std::string> read_regular_file(std::filesystem::path const& path, std::size_t limit);

/// Opens a file to append to, makes it if need be, empties it first if `empty`; folders are made. A terminal,
/// or the pipe that collects our own output (`/dev/stdout`), is let be; other pipes, devices and the like are
/// refused.
///
/// Errors: as `read_regular_file`.
result<FileDescriptor> open_to_append(std::filesystem::path const& path, bool empty);

} // namespace webots_cloud::adapters
