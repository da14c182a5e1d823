#include "adapters/files/file_descriptor.hpp"
#include "adapters/threads/blocking_pool.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace webots_cloud {
namespace {

namespace fs = std::filesystem;
using adapters::FileDescriptor;

constexpr std::uint64_t max_files = 250'000; // five times what a project may have when it is fetched
constexpr int max_depth = 64;                // a descriptor is open for each
constexpr std::uint64_t block = 512;         // in which stat(2) counts

/// A folder that its owner may not look into, as simulations can make them, is made accessible.
FileDescriptor open_folder(int parent, char const* name)
{
    FileDescriptor folder(::openat(parent, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (folder || errno != EACCES)
        return folder;
    // Not by name: it must be the folder that is opened, not what a link leads to.
    FileDescriptor const found(::openat(parent, name, O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    auto const path = core::concat("/proc/self/fd/", std::to_string(found.get()));
    if (!found || ::chmod(path.c_str(), S_IRWXU) != 0)
        return FileDescriptor();
    return FileDescriptor(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
}

/// Adds up what is in a folder, until it is known to be enough.
class Measurement
{
public:
    explicit Measurement(std::uint64_t enough) : enough_(enough) {}

    FolderUse run(fs::path const& folder)
    {
        FileDescriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
        struct statvfs disk
        {};
        if (opened && ::fstatvfs(opened.get(), &disk) == 0)
            use_.free_bytes = std::uint64_t{disk.f_bavail} * disk.f_frsize;
        if (opened)
            count(std::move(opened), 0);
        return use_;
    }

private:
    bool is_done() const { return use_.bytes > enough_ || use_.too_many_files; }

    void count(FileDescriptor folder, int depth)
    {
        std::unique_ptr<DIR, int (*)(DIR*)> const listing(::fdopendir(folder.get()), &::closedir);
        if (!listing)
            return;
        auto const parent = folder.release(); // the listing's now
        while (auto const* const entry = is_done() ? nullptr : ::readdir(listing.get())) {
            std::string_view const name = entry->d_name;
            if (name != "." && name != "..")
                count_entry(parent, entry->d_name, depth);
        }
    }

    void count_entry(int parent, char const* name, int depth)
    {
        struct stat status
        {};
        if (::fstatat(parent, name, &status, AT_SYMLINK_NOFOLLOW) != 0)
            return; // removed meanwhile
        use_.bytes += static_cast<std::uint64_t>(status.st_blocks) * block;
        use_.too_many_files = ++files_ > max_files;
        if (!S_ISDIR(status.st_mode) || is_done())
            return;
        if (depth == max_depth) {
            use_.too_many_files = true;
            return;
        }
        if (auto folder = open_folder(parent, name))
            count(std::move(folder), depth + 1);
    }

    std::uint64_t enough_;
    std::uint64_t files_ = 0;
    FolderUse use_;
};

struct Measure
{
    FolderUse operator()() const { return Measurement(enough).run(folder); }

    fs::path folder;
    std::uint64_t enough;
};

class LocalFolderMeter final : public FolderMeter
{
public:
    boost::asio::awaitable<FolderUse> measure(fs::path folder, std::uint64_t enough) override
    {
        Measure work{std::move(folder), enough};
        co_return co_await pool_.run(std::move(work));
    }

private:
    adapters::BlockingPool pool_{1};
};

} // namespace

std::unique_ptr<FolderMeter> make_folder_meter()
{
    return std::make_unique<LocalFolderMeter>();
}

} // namespace webots_cloud
