// Files that we write where simulations, which run as the same user, may have put something else.
#pragma once

#include "file_descriptor.hpp"

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <string>

#include <sys/types.h>

namespace webots_cloud::adapters {

/// A regular file, open for writing at its end.
struct OutputFile
{
    FileDescriptor file;
    std::string notice; ///< Not empty: a sentence about what was in its place.
};

enum class OutputMode
{
    append, ///< What the file has stays.
    anew    ///< A new, empty file takes its place.
};

/// Opens one of our files; creates it and its folders if necessary. Never blocks, never follows a link in
/// place of the file, and never changes a file with a second hard link: anything but a regular file with a
/// single link is renamed.
///
/// Errors: that of the system.
result<OutputFile> open_output(std::filesystem::path const& path, OutputMode mode, mode_t permissions);

} // namespace webots_cloud::adapters
