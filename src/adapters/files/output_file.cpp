#include "output_file.hpp"

#include "own_folder.hpp"

#include "core/text.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;

Failure last_failure()
{
    return Failure(boost::system::error_code(errno, boost::system::system_category()));
}

bool is_ordinary(struct stat const& status)
{
    return S_ISREG(status.st_mode) && status.st_nlink == 1;
}

/// The file that occupies the name of our folder, or of the one above it. Empty: none that we could rename.
fs::path obstacle_of(fs::path const& folder)
{
    for (auto const& path : {folder.parent_path(), folder}) {
        struct stat status;
        struct stat target;
        if (path.empty() || !path.has_filename() || ::lstat(path.c_str(), &status) != 0 ||
            S_ISDIR(status.st_mode))
            continue;
        bool const is_link_to_folder = ::stat(path.c_str(), &target) == 0 && S_ISDIR(target.st_mode);
        bool const is_device =
            S_ISCHR(status.st_mode) || S_ISBLK(status.st_mode) || path.parent_path() == "/dev";
        if (!is_link_to_folder)
            return is_device || status.st_uid != ::geteuid() ? fs::path() : path;
    }
    return {};
}

/// The folder of a file. It may be a link: where logs lie is the operator's choice.
result<FileDescriptor> open_folder_of(fs::path const& path, std::string& notice)
{
    auto const folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    if (auto const obstacle = obstacle_of(folder); !obstacle.empty()) {
        auto moved = set_aside(AT_FDCWD, obstacle.c_str(), obstacle);
        if (!moved)
            return moved.error();
        notice = std::move(*moved);
    }
    std::error_code failed;
    fs::create_directories(folder, failed);
    FileDescriptor found(::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    struct stat status;
    if (!found || ::fstat(found.get(), &status) != 0)
        return failed ? Failure(boost::system::error_code(failed.value(), boost::system::system_category()))
                      : last_failure();
    if (status.st_uid == ::geteuid() && (status.st_mode & S_IRWXU) != S_IRWXU) {
        auto const link = core::concat("/proc/self/fd/", std::to_string(found.get()));
        if (::chmod(link.c_str(), (status.st_mode | S_IRWXU) & 07777) == 0)
            notice =
                core::concat(folder.string(), " had the mode of a folder that we can't use: now we can.");
    }
    return found;
}

/// Nothing is waited for: a pipe has no reader, a device may have none.
FileDescriptor open_file(int folder, char const* name, int flags, mode_t permissions)
{
    return FileDescriptor(::openat(
        folder, name, O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC | flags,
        permissions));
}

} // namespace

result<OutputFile> open_output(fs::path const& path, OutputMode mode, mode_t permissions)
{
    OutputFile output;
    auto const folder = open_folder_of(path, output.notice);
    if (!folder)
        return folder.error();
    auto const name = path.filename();
    struct stat status;
    bool const exists = ::fstatat(folder->get(), name.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0;
    if (exists && is_ordinary(status) && mode == OutputMode::append) {
        output.file = open_file(folder->get(), name.c_str(), 0, permissions);
        // By now it may be something else again.
        if (output.file && ::fstat(output.file.get(), &status) == 0 && is_ordinary(status))
            return output;
        // What can't be opened for one of these reasons makes way below.
        if (!output.file && errno != EACCES && errno != EPERM && errno != ELOOP && errno != ENXIO)
            return last_failure();
    }
    if (exists && is_ordinary(status) && mode == OutputMode::anew) {
        if (::unlinkat(folder->get(), name.c_str(), 0) != 0)
            return last_failure();
    } else if (exists) {
        auto moved = set_aside(folder->get(), name.c_str(), path);
        if (!moved)
            return moved.error();
        output.notice = std::move(*moved);
    }
    output.file = open_file(folder->get(), name.c_str(), O_EXCL, permissions);
    if (!output.file)
        return last_failure();
    return output;
}

} // namespace webots_cloud::adapters
