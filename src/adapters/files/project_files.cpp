#include "project_files.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

#include <fcntl.h>
#include <linux/fs.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace webots_cloud::adapters {

namespace system_errc = boost::system::errc;

Failure disk_failure()
{
    return disk_failure(std::error_code(errno, std::generic_category()));
}

Failure disk_failure(std::error_code const& why)
{
    auto const is_full = why.value() == ENOSPC || why.value() == EDQUOT;
    if (is_full)
        return core::refused(make_error_code(system_errc::no_space_on_device), core::Refused::disk_full,
                             {{"words", why.message()}});
    return core::refused(core::Refused::not_stored, {{"words", why.message()}});
}

bool is_lack_of_room(Failure const& failure)
{
    return failure.code() == system_errc::no_space_on_device;
}

result<FileDescriptor> open_folder(int parent, char const* name)
{
    FileDescriptor folder(::openat(parent, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (!folder)
        return disk_failure();
    return folder;
}

result<FileDescriptor> make_folder(int parent, char const* name)
{
    if (::mkdirat(parent, name, 0755) != 0)
        return disk_failure();
    return open_folder(parent, name);
}

void keep_folders_apart(std::filesystem::path const& folder)
{
    auto const opened = open_folder(AT_FDCWD, folder.c_str());
    int flags = 0;
    if (!opened || ::ioctl(opened->get(), FS_IOC_GETFLAGS, &flags) != 0 || (flags & FS_TOPDIR_FL) != 0)
        return;
    flags |= FS_TOPDIR_FL;
    ::ioctl(opened->get(), FS_IOC_SETFLAGS, &flags); // a hint: file systems that can't take it work, too
}

result<> write_all(int file, std::string_view bytes)
{
    while (!bytes.empty()) {
        auto const written = ::write(file, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            return disk_failure();
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return {};
}

result<> write_file(int folder, char const* name, std::string_view bytes, mode_t mode)
{
    FileDescriptor const file(
        ::openat(folder, name, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode));
    if (!file)
        return disk_failure();
    return write_all(file.get(), bytes);
}

result<std::string> read_file(int folder, char const* name, std::uint64_t limit)
{
    // O_NONBLOCK: a pipe must not make us wait; for regular files it means nothing.
    FileDescriptor const file(::openat(folder, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    struct stat status;
    if (!file || ::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode))
        return Failure(errc::not_found, core::concat(name, " can't be read"));
    auto const size = static_cast<std::uint64_t>(status.st_size);
    if (size > limit)
        return Failure(errc::unavailable, core::concat(name, " is too large"));
    std::string bytes(size, '\0');
    std::size_t have = 0;
    while (have < bytes.size()) {
        auto const count = ::read(file.get(), bytes.data() + have, bytes.size() - have);
        if (count < 0 && errno == EINTR)
            continue;
        if (count <= 0)
            return Failure(errc::unavailable, core::concat(name, " can't be read"));
        have += static_cast<std::size_t>(count);
    }
    return bytes;
}

} // namespace webots_cloud::adapters
