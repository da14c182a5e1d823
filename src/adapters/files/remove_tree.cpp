#include "remove_tree.hpp"

#include "file_descriptor.hpp"
#include "mounts.hpp"

#include "core/text.hpp"

#include <webots_cloud/adapters/secrets.hpp>

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr int deepest = 32; // folders that are open at once

Failure removal_failure()
{
    return {errc::unavailable, std::error_code(errno, std::generic_category()).message()};
}

/// A simulation may leave folders that not even their owner may look into or change.
FileDescriptor open_unlocked(int parent, char const* name)
{
    // Not by name: it must be the folder that is opened, not what a link leads to.
    FileDescriptor const found(::openat(parent, name, O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    auto const path = concat("/proc/self/fd/", std::to_string(found.get()));
    if (found)
        (void)::chmod(path.c_str(), S_IRWXU); // where it fails, so does what follows
    return FileDescriptor(found ? ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1);
}

/// Empties folders by descriptors and never by paths, which may be longer than the system allows. What lies
/// too deep is moved up first.
class Emptying
{
public:
    explicit Emptying(int top) : top_(top) {}

    result<> run()
    {
        do {
            moved_ = false;
            if (auto const emptied =
                    empty(FileDescriptor(::openat(top_, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC)), 0);
                !emptied)
                return emptied;
        } while (moved_);
        return {};
    }

private:
    result<> empty(FileDescriptor folder, int depth)
    {
        std::unique_ptr<DIR, int (*)(DIR*)> const listing(folder ? ::fdopendir(folder.get()) : nullptr,
                                                          &::closedir);
        if (!listing)
            return removal_failure();
        auto const parent = folder.release(); // the listing's now
        while (auto const* const entry = ::readdir(listing.get())) {
            std::string_view const name = entry->d_name;
            if (name == "." || name == "..")
                continue;
            if (auto const removed = remove(parent, entry->d_name, depth); !removed)
                return removed;
        }
        return {};
    }

    result<> remove(int parent, char const* name, int depth)
    {
        if (::unlinkat(parent, name, 0) == 0 || errno == ENOENT)
            return {};
        if (errno != EISDIR && errno != EPERM)
            return removal_failure();
        auto folder = open_unlocked(parent, name);
        if (!folder)
            return removal_failure();
        if (depth == deepest)
            return move_up(parent, name);
        if (auto const emptied = empty(std::move(folder), depth + 1); !emptied)
            return emptied;
        return ::unlinkat(parent, name, AT_REMOVEDIR) == 0 ? result<>() : removal_failure();
    }

    result<> move_up(int parent, char const* name)
    {
        moved_ = true;
        return ::renameat(parent, name, top_, make_token().c_str()) == 0 ? result<>() : removal_failure();
    }

    int top_;
    bool moved_ = false;
};

} // namespace

result<> remove_tree(fs::path const& directory)
{
    if (auto const unmounted = unmount_below(directory); !unmounted)
        return unmounted.error();
    if (::unlink(directory.c_str()) == 0 || errno == ENOENT || errno == ENOTDIR)
        return {};
    if (errno != EISDIR && errno != EPERM)
        return removal_failure();
    auto const folder = open_unlocked(AT_FDCWD, directory.c_str());
    if (!folder)
        return removal_failure();
    if (auto const emptied = Emptying(folder.get()).run(); !emptied)
        return emptied;
    return ::rmdir(directory.c_str()) == 0 ? result<>() : removal_failure();
}

} // namespace webots_cloud::adapters
