// Turns objects that have arrived into a folder: moved from the staging area, or linked from another folder
// of the cache that has them. git_layout has decided each name before.
#include "git_unpack.hpp"

#include "adapters/files/folder_walk.hpp"
#include "adapters/files/project_files.hpp"
#include "git_copy.hpp"

#include "core/git/git_problem.hpp"
#include "core/safe_names.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace webots_cloud::adapters {
namespace {

using core::GitLayoutItem;
using Kind = core::GitTreeEntry::Kind;

constexpr std::uint64_t max_link_length = 1023;

/// Makes the items of a layout below one folder, and writes down what it has made.
class Unpacker
{
public:
    Unpacker(GitStaging const& staging, GitDonors const& donors, int root)
        : staging_(staging), donors_(donors), root_(root), targets_(root)
    {}

    /// Reads the target of a link before a file of the same text can be moved away.
    result<> read_link(GitLayoutItem const& item)
    {
        if (!staging_.has_blob(item.id))
            return missing();
        if (links_.count(item.id) || staging_.blob_size(item.id) > max_link_length)
            return {};
        auto text = staging_.read_blob(item.id);
        if (!text)
            return text.error();
        links_.emplace(item.id, std::move(*text));
        return {};
    }

    result<> make(GitLayoutItem const& item)
    {
        auto const folder = targets_.parent_of(item.path);
        if (!folder)
            return folder.error();
        auto const* const name = file_name(item.path);
        switch (item.kind) {
        case Kind::folder:
            add(item, 0);
            return ::mkdirat(*folder, name, 0755) == 0 ? result<>() : disk_failure();
        case Kind::link:
            return make_link(item, *folder, name);
        default:
            return make_file(item, *folder, name);
        }
    }

    GitIndex index;

private:
    void add(GitLayoutItem const& item, std::uint64_t size)
    {
        GitIndexEntry entry;
        entry.kind = item.kind;
        entry.id = item.id;
        entry.size = size;
        entry.path = item.path;
        index.bytes += size;
        index.entries.push_back(std::move(entry));
    }

    result<> make_link(GitLayoutItem const& item, int folder, char const* name)
    {
        auto const target = links_.find(item.id);
        if (target == links_.end())
            return {}; // absurdly long
        if (!core::link_stays_inside(target->second, item.depth()))
            return {};
        if (::symlinkat(target->second.c_str(), folder, name) != 0)
            return disk_failure();
        add(item, target->second.size());
        return {};
    }

    result<> make_file(GitLayoutItem const& item, int folder, char const* name)
    {
        auto const size = place(item, folder, name);
        if (!size)
            return size.error();
        add(item, *size);
        if (auto const donor = donors_.files.find(item.id); donor != donors_.files.end())
            index.entries.back().pointer = donor->second.pointer;
        return {};
    }

    /// The size of the file that is now there.
    result<std::uint64_t> place(GitLayoutItem const& item, int folder, char const* name)
    {
        auto const mode = item.kind == Kind::executable ? 0755 : 0644;
        // The same content may be here already under another name, or in another folder of the cache: then it
        // is shared.
        if (auto const before = placed_.find(item.id); before != placed_.end())
            return share(before->second, root_, item, folder, name);
        if (auto const donor = donors_.files.find(item.id); donor != donors_.files.end()) {
            auto const size = share(donor->second, donor->second.folder, item, folder, name);
            if (size)
                remember(item, *size);
            return size;
        }
        if (auto const link = links_.find(item.id); link != links_.end())
            return write_text(link->second, folder, name, mode_t(mode));
        if (!staging_.has_blob(item.id))
            return missing();
        if (::renameat(staging_.folder(), to_hex(item.id).c_str(), folder, name) != 0)
            return disk_failure();
        if (item.kind == Kind::executable && ::fchmodat(folder, name, mode_t(mode), 0) != 0)
            return disk_failure();
        auto const size = staging_.blob_size(item.id);
        remember(item, size);
        return size;
    }

    /// A file whose bytes are already somewhere: the same file where mode and content agree, else a copy.
    result<std::uint64_t> share(GitDonors::File const& file, int root, GitLayoutItem const& item, int folder,
                                char const* name)
    {
        FolderWalk walk(root);
        auto const parent = walk.parent_of(file.path);
        if (!parent)
            return parent.error();
        if (file.kind == item.kind && ::linkat(*parent, file_name(file.path), folder, name, 0) == 0)
            return file.size;
        auto const mode = item.kind == Kind::executable ? 0755 : 0644;
        auto const copied = copy_file(*parent, file_name(file.path), folder, name, file.size, mode_t(mode));
        if (!copied)
            return copied.error();
        return file.size;
    }

    /// A file that has the text of a link.
    static result<std::uint64_t> write_text(std::string const& text, int folder, char const* name,
                                            mode_t mode)
    {
        if (auto const written = write_file(folder, name, text, mode); !written)
            return written.error();
        return text.size();
    }

    void remember(GitLayoutItem const& item, std::uint64_t size)
    {
        GitDonors::File file;
        file.path = item.path;
        file.kind = item.kind;
        file.size = size;
        placed_.emplace(item.id, std::move(file));
    }

    static Failure missing() { return {core::GitProblem::object_missing, "the git server left out a file"}; }

    GitStaging const& staging_;
    GitDonors const& donors_;
    int root_;
    FolderWalk targets_;
    std::unordered_map<core::GitObjectId, GitDonors::File, core::GitObjectIdHash> placed_;
    std::unordered_map<core::GitObjectId, std::string, core::GitObjectIdHash> links_;
};

} // namespace

result<GitIndex> unpack_git_folder(std::vector<GitLayoutItem> const& layout, GitStaging const& staging,
                                   GitDonors const& donors, int root, FetchInterrupt const& interrupt)
{
    Unpacker unpacker(staging, donors, root);
    for (auto const& item : layout)
        if (item.kind == Kind::link)
            if (auto const read = unpacker.read_link(item); !read)
                return read.error();
    for (auto const& item : layout) {
        if (auto const may_go_on = ask(interrupt); !may_go_on)
            return may_go_on.error();
        if (auto const made = unpacker.make(item); !made)
            return made.error();
    }
    return std::move(unpacker.index);
}

} // namespace webots_cloud::adapters
