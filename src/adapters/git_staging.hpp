// Objects of a repository on their way from the network into a folder.
#pragma once

#include "file_descriptor.hpp"

#include "../core/git_object_id.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>

namespace webots_cloud::adapters {

enum class GitObjectKind
{
    commit,
    tree,
    blob,
    tag
};

/// Keeps files (blobs) in a folder, each under its digest, and everything else in memory.
///
/// Lifetime: the folder must outlive it.   Thread-safety: one thread at a time.
class GitStaging
{
public:
    /// `folder`: an open, empty folder.
    explicit GitStaging(int folder) : folder_(folder) {}

    /// Stores a whole object.   Errors: `unavailable` (disk), `too_large` (memory).
    result<> put(GitObjectKind kind, core::GitObjectId const& id, std::string bytes);

    /// A commit, tree or tag; null when it never arrived.
    std::string const* find(core::GitObjectId const& id) const;

    bool has_blob(core::GitObjectId const& id) const { return blobs_.count(id) > 0; }

    /// Size of a blob that is there.
    std::uint64_t blob_size(core::GitObjectId const& id) const { return blobs_.at(id); }

    /// A blob's bytes.   Errors: `unavailable`.
    result<std::string> read_blob(core::GitObjectId const& id) const;

    /// Begins a blob that is too large for memory; then `append` and `finish_blob`.
    result<> begin_blob();
    result<> append(std::string_view bytes);
    result<> finish_blob(core::GitObjectId const& id, std::uint64_t size);

    /// The folder, where a blob's file is called `to_hex(id)`.
    int folder() const noexcept { return folder_; }

private:
    int folder_;
    FileDescriptor open_blob_;
    std::uint64_t memory_ = 0;
    std::unordered_map<core::GitObjectId, std::string, core::GitObjectIdHash> objects_;
    std::unordered_map<core::GitObjectId, std::uint64_t, core::GitObjectIdHash> blobs_;
};

} // namespace webots_cloud::adapters
