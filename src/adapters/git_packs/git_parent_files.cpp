#include "git_parent_files.hpp"

#include "core/git/git_lfs_pointer.hpp"
#include "core/refusals.hpp"

#include <optional>

namespace webots_cloud::adapters {
namespace {

using core::GitLayoutItem;
using Kind = core::GitTreeEntry::Kind;

/// The size of a file that is there.
std::optional<std::uint64_t> size_of(GitLayoutItem const& item, GitStaging const& staging,
                                     GitDonors const& donors)
{
    if (item.kind != Kind::link)
        if (auto const donor = donors.files.find(item.id); donor != donors.files.end())
            return donor->second.size;
    if (staging.has_blob(item.id))
        return staging.blob_size(item.id);
    return std::nullopt;
}

/// What a pointer of Git LFS will bring besides itself; 0 for any other file.
std::uint64_t content_of(GitLayoutItem const& item, GitStaging const& staging)
{
    if (item.kind == Kind::link || !staging.has_blob(item.id) ||
        staging.blob_size(item.id) > core::max_lfs_pointer_length)
        return 0;
    auto const text = staging.read_blob(item.id);
    auto const pointer = text ? core::parse_lfs_pointer(*text) : std::nullopt;
    return pointer ? pointer->size : 0;
}

} // namespace

std::vector<core::GitObjectId> missing_files(std::vector<GitLayoutItem> const& layout,
                                             GitStaging const& staging, GitDonors const& donors, bool parents)
{
    std::vector<core::GitObjectId> missing;
    std::unordered_set<core::GitObjectId, core::GitObjectIdHash> seen;
    for (auto const& item : layout)
        if (item.kind != Kind::folder && (parents || !item.of_parent) && !size_of(item, staging, donors) &&
            seen.insert(item.id).second)
            missing.push_back(item.id);
    return missing;
}

void GitParentFiles::expect(std::vector<GitLayoutItem> const& layout, GitStaging const& staging,
                            GitDonors const& donors)
{
    expected_.clear();
    stopped_ = false;
    for (auto const& item : layout)
        if (item.of_parent && !size_of(item, staging, donors))
            expected_.insert(item.id);
    for (auto const& item : layout)
        if (!item.of_parent && !expected_.empty())
            expected_.erase(item.id);
}

result<> GitParentFiles::begins(std::uint64_t size)
{
    return size > max_parent_bytes && !expected_.empty() ? stop() : result<>();
}

result<> GitParentFiles::arrived(core::GitObjectId const& id, std::uint64_t size)
{
    if (expected_.erase(id) == 0)
        return {};
    bytes_ += size;
    return too_large() ? stop() : result<>();
}

result<> GitParentFiles::stop()
{
    stopped_ = true;
    return core::refused(core::Refused::parent_files);
}

bool may_keep_parent_files(std::vector<GitLayoutItem> const& layout, GitStaging const& staging,
                           GitDonors const& donors, std::uint64_t max_bytes)
{
    std::uint64_t of_parents = 0;
    std::uint64_t all = 0;
    for (auto const& item : layout) {
        if (item.kind == Kind::folder)
            continue;
        auto const size = size_of(item, staging, donors);
        if (!size && item.of_parent)
            return false;
        all += size.value_or(0);
        if (!item.of_parent)
            continue;
        of_parents += *size;
        auto const content = content_of(item, staging);
        if (content > max_parent_bytes) // else the sum could overflow
            return false;
        of_parents += content;
    }
    return of_parents <= max_parent_bytes && all <= max_bytes;
}

bool leave_out_parent_files(std::vector<GitLayoutItem>& layout)
{
    return std::erase_if(layout, [](GitLayoutItem const& item) { return item.of_parent; }) > 0;
}

} // namespace webots_cloud::adapters
