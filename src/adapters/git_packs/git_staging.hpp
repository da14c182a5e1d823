// Objects of a repository on their way from the network into a folder.
#pragma once

#include "adapters/files/file_descriptor.hpp"
#include "adapters/projects/fetch_budget.hpp"

#include "core/git/git_object_id.hpp"

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

/// What is noted of each object, whatever its size: about what the tables here and in a pack's reader need.
constexpr std::uint64_t git_object_memory = 192;

/// Observes the files that arrive.
class GitBlobWatch
{
public:
    virtual ~GitBlobWatch() = default;

    /// Before there is any of a file. What it returns ends the fetch.
    virtual result<> begins(std::uint64_t size) = 0;

    /// Once a file is there; the same.
    virtual result<> arrived(core::GitObjectId const& id, std::uint64_t size) = 0;
};

/// Keeps files (blobs) in a folder, each under its digest, and everything else in memory.
///
/// Lifetime: the folder and the share must outlive it.   Thread-safety: one thread at a time.
class GitStaging
{
public:
    /// `folder`: an open, empty folder. `share`: the fetch's share of the budget; null: not counted.
    explicit GitStaging(int folder, FetchShare* share = nullptr) : folder_(folder), share_(share) {}

    /// Reserves memory and disk for an object before they are used.   Errors: as `FetchShare::take`.
    result<> pay_for(GitObjectKind kind, std::uint64_t size);

    /// The same for what is given back with `give_back_memory`.
    result<> take_memory(std::uint64_t bytes);
    void give_back_memory(std::uint64_t bytes) noexcept;

    /// Stores a whole object, for which memory and disk were reserved.   Errors: `unavailable` (disk),
    /// `too_large` (memory).
    result<> put(GitObjectKind kind, core::GitObjectId const& id, std::string bytes);

    /// A commit, tree or tag; null when it never arrived.
    std::string const* find(core::GitObjectId const& id) const;

    bool has_blob(core::GitObjectId const& id) const { return blobs_.count(id) > 0; }

    /// Size of a blob that is there.
    std::uint64_t blob_size(core::GitObjectId const& id) const { return blobs_.at(id); }

    /// Bytes of all objects in memory.
    std::uint64_t memory() const noexcept { return memory_; }

    /// A blob's bytes.   Errors: `unavailable`.
    result<std::string> read_blob(core::GitObjectId const& id) const;

    /// Begins a blob that is too large for memory; then `append` and `finish_blob`.
    result<> begin_blob();
    result<> append(std::string_view bytes);
    result<> finish_blob(core::GitObjectId const& id, std::uint64_t size);

    /// While there is one, `watch` sees the files that come.
    class Watching
    {
    public:
        Watching(GitStaging& staging, GitBlobWatch& watch) : staging_(staging) { staging.watch_ = &watch; }
        Watching(Watching const&) = delete;
        ~Watching() { staging_.watch_ = nullptr; }

    private:
        GitStaging& staging_;
    };

    /// The folder, where a blob's file is called `to_hex(id)`.
    int folder() const noexcept { return folder_; }

private:
    result<> note_arrival(core::GitObjectId const& id, std::uint64_t size);

    int folder_;
    FetchShare* share_;
    GitBlobWatch* watch_ = nullptr;
    FileDescriptor open_blob_;
    std::uint64_t memory_ = 0;
    std::unordered_map<core::GitObjectId, std::string, core::GitObjectIdHash> objects_;
    std::unordered_map<core::GitObjectId, std::uint64_t, core::GitObjectIdHash> blobs_;
};

} // namespace webots_cloud::adapters
