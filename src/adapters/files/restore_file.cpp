#include "restore_file.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"
#include "project_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>

namespace webots_cloud::adapters {
namespace {

using core::concat;

/// Of a simulation that runs as another user, what we put back is that user's too.
void give_as(int folder, int made)
{
    struct stat status;
    if (::fstat(folder, &status) == 0 && status.st_uid != ::geteuid())
        (void)!::fchown(made, status.st_uid, status.st_gid); // else it can be read, but not changed
}

/// The folder of `parts`, but for the last one, below `root`.
result<FileDescriptor> folder_of(std::filesystem::path const& root,
                                 std::vector<std::string_view> const& parts, bool make)
{
    auto folder = open_folder(AT_FDCWD, root.c_str());
    for (std::size_t i = 0; folder && i + 1 < parts.size(); ++i) {
        auto const name = std::string(parts[i]);
        bool const is_new = make && ::mkdirat(folder->get(), name.c_str(), 0755) == 0;
        if (make && !is_new && errno != EEXIST)
            return disk_failure();
        auto next = open_folder(folder->get(), name.c_str());
        if (next && is_new)
            give_as(folder->get(), next->get());
        folder = std::move(next);
    }
    return folder;
}

result<> copy_bytes(int from, int to)
{
    std::array<char, 64 * 1024> buffer;
    for (;;) {
        auto const count = ::read(from, buffer.data(), buffer.size());
        if (count == 0)
            return {};
        if (count < 0 && errno == EINTR)
            continue;
        if (count < 0)
            return disk_failure();
        if (auto const written = write_all(to, {buffer.data(), static_cast<std::size_t>(count)}); !written)
            return written;
    }
}

} // namespace

result<> restore_file(std::filesystem::path const& from, std::filesystem::path const& to,
                      std::string const& file, mode_t also)
{
    auto const parts = core::split(file, '/');
    auto const name = std::string(parts.back());
    auto const source = folder_of(from, parts, false);
    // O_NONBLOCK: a pipe must not make us wait; for regular files it means nothing.
    FileDescriptor const pristine(
        source ? ::openat(source->get(), name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC) : -1);
    struct stat status;
    if (!pristine || ::fstat(pristine.get(), &status) != 0 || !S_ISREG(status.st_mode))
        return core::refused(core::Refused::no_file, {{"file", core::printable(file, 200)}});
    auto const target = folder_of(to, parts, true);
    if (!target)
        return target.error();
    return replace_file(target->get(), name, (status.st_mode & 0777) | also,
                        [&pristine](int copy) { return copy_bytes(pristine.get(), copy); });
}

/// Writes beside the file first: a simulator that reads it meanwhile sees the old one or the new one.
result<> replace_file(int folder, std::string const& name, mode_t mode,
                      std::function<result<>(int file)> const& fill)
{
    constexpr auto beside = ".webots_cloud-reset";
    ::unlinkat(folder, beside, 0);
    FileDescriptor const copy(
        ::openat(folder, beside, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
    if (!copy)
        return disk_failure();
    auto filled = fill(copy.get());
    if (filled)
        give_as(folder, copy.get());
    if (filled && (::fchmod(copy.get(), mode) != 0 || ::renameat(folder, beside, folder, name.c_str()) != 0))
        filled = disk_failure();
    if (!filled)
        ::unlinkat(folder, beside, 0);
    return filled;
}

} // namespace webots_cloud::adapters
