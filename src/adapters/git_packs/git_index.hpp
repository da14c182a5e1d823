// The index of an unpacked folder in the cache: enough to copy it, to verify it, and to build its successor
// from it.
#pragma once

#include "core/git/git_object_id.hpp"
#include "core/git/git_tree.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::adapters {

/// One folder, file or link; a folder comes before what is in it.
struct GitIndexEntry
{
    core::GitTreeEntry::Kind kind = core::GitTreeEntry::Kind::file; ///< Never `submodule`.
    core::GitObjectId id;
    std::uint64_t size = 0; ///< Of a file, in bytes.
    std::string path;       ///< Relative to the repository's root, harmless.
    std::string pointer;    ///< Of a large file (Git LFS): what git has in its place. Else empty.
};

struct GitIndex
{
    std::vector<GitIndexEntry> entries;
    std::uint64_t bytes = 0; ///< Of all files.
    /// What the project lacks for its names, printable: see `core::GitWay::forbidden`.
    std::vector<std::string> forbidden;
};

/// The text of an index file: a line of its own, one for each name that is forbidden, one per entry, a line
/// that ends it.
std::string write_index(GitIndex const& index);

/// Errors: `protocol_error` for anything that `write_index` would not have written.
result<GitIndex> parse_index(std::string_view text);

} // namespace webots_cloud::adapters
