// A start waits for this copy, so bytes are shared with the cache (reflinks) where the file system can, else
// copied inside the kernel, and several threads share the files of a large folder.
#include "git_copy.hpp"

#include "adapters/files/folder_walk.hpp"
#include "adapters/files/project_files.hpp"
#include "core/refusals.hpp"

#include <boost/asio/error.hpp>

#include <fcntl.h>
#include <linux/fs.h>
#include <sys/ioctl.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <mutex>

namespace webots_cloud::adapters {
namespace {

using Kind = core::GitTreeEntry::Kind;

constexpr std::size_t files_at_once = 16; // files that a thread takes on before it looks for more
constexpr std::size_t max_helpers = 3;

Failure damaged()
{
    return core::refused(core::Refused::copy_damaged);
}

/// Copies inside the kernel; between file systems only the older of the two ways works.
ssize_t copy_piece(int from, int to, std::uint64_t size)
{
    auto const count = ::copy_file_range(from, nullptr, to, nullptr, size, 0);
    if (count >= 0 || (errno != EXDEV && errno != EINVAL && errno != ENOSYS && errno != EOPNOTSUPP))
        return count;
    return ::sendfile(to, from, nullptr, size);
}

result<> copy_bytes(int from, int to, std::uint64_t size)
{
    while (size > 0) {
        auto const count = copy_piece(from, to, size);
        if (count < 0)
            return disk_failure();
        if (count == 0)
            return damaged();
        size -= static_cast<std::uint64_t>(count);
    }
    return {};
}

result<> copy_link(int from, int to, char const* name, std::uint64_t size)
{
    std::array<char, 1024> target;
    auto const length = ::readlinkat(from, name, target.data(), target.size() - 1);
    if (length < 0 || static_cast<std::uint64_t>(length) != size)
        return damaged();
    target[static_cast<std::size_t>(length)] = '\0';
    if (::symlinkat(target.data(), to, name) != 0)
        return disk_failure();
    return {};
}

result<> make_folders(GitIndex const& index, int to)
{
    FolderWalk targets(to);
    for (auto const& entry : index.entries) {
        if (entry.kind != Kind::folder)
            continue;
        auto const target = targets.parent_of(entry.path);
        if (!target)
            return target.error();
        if (::mkdirat(*target, file_name(entry.path), 0755) != 0)
            return disk_failure();
    }
    return {};
}

/// Copies files and links; any number of threads may work on it.
class FolderCopy
{
public:
    FolderCopy(GitIndex const& index, int from, int to, GitCopyWay way, std::atomic<bool> const& aborted)
        : index_(index), from_(from), to_(to), way_(way), aborted_(aborted)
    {}

    /// Returns when nothing is left to begin with.
    void work()
    {
        FolderWalk sources(from_);
        FolderWalk targets(to_);
        auto const count = index_.entries.size();
        for (auto first = next_.fetch_add(files_at_once); first < count;
             first = next_.fetch_add(files_at_once))
            for (auto i = first; i < std::min(first + files_at_once, count); ++i)
                if (auto const copied = copy(index_.entries[i], sources, targets); !copied)
                    return give_up(copied.error());
    }

    /// Call only when no thread works on it any more.
    result<> outcome() const { return outcome_; }

private:
    result<> copy(GitIndexEntry const& entry, FolderWalk& sources, FolderWalk& targets) const
    {
        if (entry.kind == Kind::folder)
            return {};
        if (aborted_.load(std::memory_order_relaxed))
            return Failure(boost::asio::error::operation_aborted);
        auto const source = sources.parent_of(entry.path);
        if (!source)
            return damaged();
        auto const target = targets.parent_of(entry.path);
        if (!target)
            return target.error();
        auto const* const name = file_name(entry.path);
        if (entry.kind == Kind::link)
            return copy_link(*source, *target, name, entry.size);
        return copy_file(*source, name, *target, name, entry.size,
                         entry.kind == Kind::executable ? 0755 : 0644, way_);
    }

    void give_up(Failure const& failure)
    {
        next_ = index_.entries.size();
        std::lock_guard const lock(mutex_);
        outcome_ = failure;
    }

    GitIndex const& index_;
    int from_;
    int to_;
    GitCopyWay way_;
    std::atomic<bool> const& aborted_;
    std::atomic<std::size_t> next_{0};
    std::mutex mutex_;
    result<> outcome_; ///< Guarded by the mutex.
};

} // namespace

result<> copy_file(int from, char const* from_name, int to, char const* to_name, std::uint64_t size,
                   mode_t mode, GitCopyWay way)
{
    FileDescriptor const source(::openat(from, from_name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    struct stat status;
    // Of the size that the index says, or the cache was changed, and a copy of it would be wrong, too.
    if (!source || ::fstat(source.get(), &status) != 0 || !S_ISREG(status.st_mode) ||
        static_cast<std::uint64_t>(status.st_size) != size)
        return damaged();
    FileDescriptor const target(
        ::openat(to, to_name, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode));
    if (!target)
        return disk_failure();
    if (way == GitCopyWay::clone && ::ioctl(target.get(), FICLONE, source.get()) == 0)
        return {};
    return copy_bytes(source.get(), target.get(), size);
}

result<> copy_folder(GitIndex const& index, int from, int to, GitCopyWay way, BlockingPool& pool,
                     std::atomic<bool> const& aborted)
{
    if (auto const made = make_folders(index, to); !made)
        return made.error();
    FolderCopy copy(index, from, to, way, aborted);
    auto const helpers = std::min(max_helpers, index.entries.size() / files_at_once);
    pool.share(helpers, [&copy] { copy.work(); });
    return copy.outcome();
}

} // namespace webots_cloud::adapters
