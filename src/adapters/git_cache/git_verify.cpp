// A folder of the cache is believed if nothing about its inodes has changed since it was last read in full;
// else git's own digests decide. To read all of it at each start would take too long.
#include "git_verify.hpp"

#include "adapters/files/folder_walk.hpp"
#include "adapters/files/project_files.hpp"
#include "adapters/files/sha256.hpp"
#include "adapters/git_packs/git_digest.hpp"

#include "core/git/git_lfs_pointer.hpp"
#include "core/text.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;
using Kind = core::GitTreeEntry::Kind;

constexpr std::int64_t a_second = 1'000'000'000;
constexpr std::int64_t unsettled = a_second / 10; // file systems may count time in ticks of the kernel

std::int64_t nanoseconds(timespec const& time)
{
    return time.tv_sec * a_second + time.tv_nsec;
}

bool is_as_indexed(GitIndexEntry const& entry, struct stat const& status)
{
    if (entry.kind == Kind::folder)
        return S_ISDIR(status.st_mode);
    auto const same_size = static_cast<std::uint64_t>(status.st_size) == entry.size;
    return same_size && (entry.kind == Kind::link ? S_ISLNK(status.st_mode) : S_ISREG(status.st_mode));
}

/// What a simulation that got the file could be misled by.
bool has_right_mode(GitIndexEntry const& entry, struct stat const& status)
{
    bool const special = (status.st_mode & (S_ISUID | S_ISGID | S_ISVTX)) != 0;
    bool const executable = (status.st_mode & S_IXUSR) != 0;
    return entry.kind == Kind::link || entry.kind == Kind::folder ||
           (!special && executable == (entry.kind == Kind::executable));
}

/// Adds up the metadata of what a folder holds.
class Look
{
public:
    void take(struct stat const& status)
    {
        auto const changed = nanoseconds(status.st_ctim);
        newest_ = std::max(newest_, changed);
        std::array<std::int64_t, 5> const facts{static_cast<std::int64_t>(status.st_dev),
                                                static_cast<std::int64_t>(status.st_ino), status.st_size,
                                                static_cast<std::int64_t>(status.st_mode), changed};
        digest_.update({reinterpret_cast<char const*>(facts.data()), sizeof facts});
    }

    GitLook finish()
    {
        timespec now{};
        ::clock_gettime(CLOCK_REALTIME, &now);
        return GitLook{digest_.finish(), newest_ + unsettled < nanoseconds(now)};
    }

private:
    GitDigest digest_;
    std::int64_t newest_ = 0;
};

void begin_blob(GitDigest& digest, std::uint64_t size)
{
    auto const header = core::concat("blob ", std::to_string(size));
    digest.update({header.c_str(), header.size() + 1}); // with the zero
}

bool has_link_content(int folder, GitIndexEntry const& entry)
{
    std::array<char, 1024> target;
    auto const length = ::readlinkat(folder, file_name(entry.path), target.data(), target.size());
    if (length < 0 || static_cast<std::uint64_t>(length) != entry.size)
        return false;
    GitDigest digest;
    begin_blob(digest, entry.size);
    digest.update({target.data(), static_cast<std::size_t>(length)});
    return digest.finish() == entry.id;
}

/// Of a file: what git says of it, or what its pointer does.
class FileDigest
{
public:
    explicit FileDigest(GitIndexEntry const& entry) : entry_(entry)
    {
        begin_blob(git_, entry.size);
        if (!entry.pointer.empty())
            lfs_.emplace();
    }

    void update(std::string_view bytes)
    {
        if (lfs_)
            lfs_->update(bytes);
        else
            git_.update(bytes);
    }

    bool is_right()
    {
        if (!lfs_)
            return git_.finish() == entry_.id;
        auto const pointer = core::parse_lfs_pointer(entry_.pointer); // the index was checked against `id`
        return pointer && lfs_->finish() == pointer->object;
    }

private:
    GitIndexEntry const& entry_;
    GitDigest git_;
    std::optional<Sha256> lfs_;
};

bool has_file_content(int folder, GitIndexEntry const& entry, std::string& buffer,
                      std::atomic<bool> const* aborted)
{
    FileDescriptor const file(
        ::openat(folder, file_name(entry.path), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    struct stat status;
    if (!file || ::fstat(file.get(), &status) != 0 || !is_as_indexed(entry, status) ||
        !has_right_mode(entry, status))
        return false;
    FileDigest digest(entry);
    for (;;) {
        auto const count = ::read(file.get(), buffer.data(), buffer.size());
        if (count < 0 && errno == EINTR)
            continue;
        if (count < 0 || (aborted && aborted->load(std::memory_order_relaxed)))
            return false;
        if (count == 0)
            return digest.is_right();
        digest.update({buffer.data(), static_cast<std::size_t>(count)});
    }
}

bool has_content(GitIndexEntry const& entry, FolderWalk& walk, std::string& buffer,
                 std::atomic<bool> const* aborted)
{
    auto const folder = walk.parent_of(entry.path);
    if (!folder)
        return false;
    if (entry.kind == Kind::link)
        return has_link_content(*folder, entry);
    return entry.kind == Kind::folder || has_file_content(*folder, entry, buffer, aborted);
}

/// How many entries a folder has; -1: it can't be read.
long count_entries(int parent, char const* name)
{
    auto folder = open_folder(parent, name);
    std::unique_ptr<DIR, int (*)(DIR*)> const listing(folder ? ::fdopendir(folder->get()) : nullptr,
                                                      &::closedir);
    if (!listing)
        return -1;
    folder->release(); // the listing's now
    long count = 0;
    while (auto const* const entry = ::readdir(listing.get())) {
        std::string_view const each = entry->d_name;
        count += each == "." || each == ".." ? 0 : 1;
    }
    return count;
}

std::string_view folder_of(std::string_view path)
{
    auto const slash = path.rfind('/');
    return slash == std::string_view::npos ? std::string_view() : path.substr(0, slash);
}

/// Everything of the index is there when this is asked, so that one entry more is one too many.
bool has_nothing_else(GitIndex const& index, int root)
{
    std::unordered_map<std::string_view, long> counts{{std::string_view(), 0}};
    for (auto const& entry : index.entries) {
        ++counts[folder_of(entry.path)];
        if (entry.kind == Kind::folder)
            counts.try_emplace(entry.path, 0);
    }
    if (count_entries(root, ".") != counts[std::string_view()])
        return false;
    FolderWalk walk(root);
    for (auto const& entry : index.entries) {
        if (entry.kind != Kind::folder)
            continue;
        auto const folder = walk.parent_of(entry.path);
        if (!folder || count_entries(*folder, file_name(entry.path)) != counts[entry.path])
            return false;
    }
    return true;
}

} // namespace

std::optional<GitLook> look_at(GitIndex const& index, fs::path const& files)
{
    auto const root = open_folder(AT_FDCWD, files.c_str());
    struct stat status;
    if (!root || ::fstat(root->get(), &status) != 0)
        return std::nullopt;
    Look look;
    look.take(status);
    FolderWalk walk(root->get());
    for (auto const& entry : index.entries) {
        auto const folder = walk.parent_of(entry.path);
        if (!folder || ::fstatat(*folder, file_name(entry.path), &status, AT_SYMLINK_NOFOLLOW) != 0 ||
            !is_as_indexed(entry, status))
            return std::nullopt;
        look.take(status);
    }
    return look.finish();
}

GitContent check_content(GitIndex const& index, fs::path const& files, std::atomic<bool> const* aborted)
{
    auto const root = open_folder(AT_FDCWD, files.c_str());
    if (!root)
        return GitContent::changed;
    constexpr std::size_t piece = 256 * 1024;
    std::string buffer(piece, '\0');
    FolderWalk walk(root->get());
    for (auto const& entry : index.entries) {
        bool const good = has_content(entry, walk, buffer, aborted);
        if (aborted && aborted->load(std::memory_order_relaxed))
            return GitContent::unknown;
        if (!good)
            return GitContent::changed;
    }
    return has_nothing_else(index, root->get()) ? GitContent::intact : GitContent::changed;
}

} // namespace webots_cloud::adapters
