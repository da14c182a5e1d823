// Folders below an open root, opened one at a time and never through a symbolic link.
#pragma once

#include "file_descriptor.hpp"
#include "project_files.hpp"

#include <webots_cloud/error.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::adapters {

/// Finds the open folder of a path. Fast when paths come in the order of a walk.   Thread-safety: one thread
/// at a time.
class FolderWalk
{
public:
    /// `root` must outlive it.
    explicit FolderWalk(int root) : root_(root) {}

    /// The folder that holds `path`: its descriptor is valid until the next call.   Errors: `unavailable`.
    result<int> parent_of(std::string_view path);

private:
    struct Level
    {
        std::string path; ///< With a slash at the end.
        FileDescriptor folder;
    };

    int root_;
    std::vector<Level> levels_;
};

/// The last part of a path.
inline char const* file_name(std::string const& path) noexcept
{
    auto const slash = path.rfind('/');
    return path.c_str() + (slash == std::string::npos ? 0 : slash + 1);
}

} // namespace webots_cloud::adapters
