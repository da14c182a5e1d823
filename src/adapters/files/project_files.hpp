// Reading and writing whole files below an open folder.
#pragma once

#include "file_descriptor.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include <sys/types.h>

namespace webots_cloud::adapters {

/// The operating system's last error (`errno`), as "This server can't store the project: <why>.". The
/// code is `unavailable`, or boost's `no_space_on_device` where more room would have helped.
Failure disk_failure();

/// The same for an error that the standard library reports.
Failure disk_failure(std::error_code const& why);

/// True for the second of these; elsewhere `unavailable` stands for both.
bool is_lack_of_room(Failure const& failure);

/// Opens the folder `name` in `parent` (AT_FDCWD: a path), never through a symbolic link.   Errors:
/// `unavailable`.
result<FileDescriptor> open_folder(int parent, char const* name);

/// Makes the folder `name` in `parent` and opens it.   Errors: `unavailable`, also when it exists.
result<FileDescriptor> make_folder(int parent, char const* name);

/// Tells the file system to store the folders in `folder` far from each other, as unrelated ones (ext4 does;
/// others may not know how). Otherwise they are stored close together, and creating files in one of them
/// has to skip all that were deleted from the others in the last five seconds: up to ten times slower.
void keep_folders_apart(std::filesystem::path const& folder);

/// Writes all of `bytes`.   Errors: `unavailable`.
result<> write_all(int file, std::string_view bytes);

/// Makes the file `name`, which must not exist, with these bytes.   Errors: `unavailable`.
result<> write_file(int folder, char const* name, std::string_view bytes, mode_t mode);

/// All bytes of a regular file, at most `limit`.   Errors: `not_found`, `unavailable`.
result<std::string> read_file(int folder, char const* name, std::uint64_t limit);

} // namespace webots_cloud::adapters
