// Proves that the index of a folder in the cache matches the folder of its commit: simulations may have
// changed the index, while git identifies the folder by its digest.
#pragma once

#include "adapters/git_packs/git_index.hpp"

#include "core/git/git_object_id.hpp"

#include <string>
#include <string_view>
#include <unordered_set>

namespace webots_cloud::adapters {

/// Collects a commit and those of its folders that lead to the wanted one and lie in it.
class GitProof
{
public:
    explicit GitProof(std::string_view folder);

    void add_commit(std::string_view object) { add('c', object); }
    bool has_tree(core::GitObjectId const& id) const { return trees_.contains(id); }
    void add_tree(core::GitObjectId const& id, std::string_view object);

    /// The text of a file, for `is_proven`.
    std::string const& text() const noexcept { return text_; }

private:
    void add(char kind, std::string_view object);

    std::string text_;
    std::unordered_set<core::GitObjectId, core::GitObjectIdHash> trees_;
};

/// Of such a text, the wanted folder; empty for anything else.
std::string proven_folder(std::string_view proof);

/// Whether `index` is the folder that the proof is about, of this commit: with the same names, kinds and
/// digests. Links may be missing, since those that lead out of the repository are left out; and the files of
/// the folders above it, but only all together.
bool is_proven(std::string_view proof, core::GitObjectId const& commit, GitIndex const& index);

} // namespace webots_cloud::adapters
