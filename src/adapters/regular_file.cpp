#include "regular_file.hpp"

#include "../core/text.hpp"

#include <webots_cloud/adapters.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace webots_cloud::adapters {
namespace {

// O_NONBLOCK: a pipe must not make us wait; for regular files it means nothing. O_NOCTTY: nor may a terminal
// become ours.
constexpr int never_wait = O_NONBLOCK | O_NOCTTY | O_CLOEXEC;

Failure system_failure()
{
    return {errc::unavailable, std::error_code(errno, std::generic_category()).message()};
}

Failure wrong_kind(mode_t mode)
{
    return {errc::unavailable, S_ISDIR(mode) ? "it is a folder" : "it is no regular file"};
}

/// Whether a file is what we write our standard output or errors to.
bool is_own_output(struct stat const& file)
{
    for (int const own : {STDOUT_FILENO, STDERR_FILENO}) {
        struct stat status;
        if (::fstat(own, &status) == 0 && status.st_dev == file.st_dev && status.st_ino == file.st_ino)
            return true;
    }
    return false;
}

} // namespace

result<std::string> read_regular_file(std::filesystem::path const& path, std::size_t limit)
{
    FileDescriptor const file(::open(path.c_str(), O_RDONLY | never_wait));
    struct stat status;
    if (!file || ::fstat(file.get(), &status) != 0)
        return system_failure();
    if (!S_ISREG(status.st_mode))
        return wrong_kind(status.st_mode);
    std::string bytes;
    for (std::size_t have = 0;;) { // its size may change meanwhile, and the kernel's own files have none
        bytes.resize(
            std::min(limit + 1, std::max(bytes.size() * 2, static_cast<std::size_t>(status.st_size) + 1)));
        auto const count = ::read(file.get(), bytes.data() + have, bytes.size() - have);
        if (count < 0 && errno == EINTR)
            continue;
        if (count < 0)
            return system_failure();
        have += static_cast<std::size_t>(count);
        if (have > limit)
            return Failure(errc::unavailable,
                           core::concat("it is larger than ", std::to_string(limit), " bytes"));
        if (count == 0) {
            bytes.resize(have);
            return bytes;
        }
    }
}

result<FileDescriptor> open_to_append(std::filesystem::path const& path, bool empty)
{
    std::error_code failed;
    if (path.has_parent_path())
        std::filesystem::create_directories(path.parent_path(), failed);
    if (failed)
        return Failure(errc::unavailable, failed.message());
    FileDescriptor file(::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | never_wait, 0666));
    if (!file && errno == ENXIO) // a pipe that nobody reads, or a socket
        return wrong_kind(S_IFIFO);
    struct stat status;
    if (!file || ::fstat(file.get(), &status) != 0)
        return system_failure();
    bool const is_pipe = S_ISFIFO(status.st_mode) && is_own_output(status);
    if (!S_ISREG(status.st_mode) && !S_ISCHR(status.st_mode) && !is_pipe)
        return wrong_kind(status.st_mode);
    if (!S_ISREG(status.st_mode)) // whoever writes does that on a thread: let it wait rather than lose lines
        ::fcntl(file.get(), F_SETFL, O_APPEND);
    else if (empty && ::ftruncate(file.get(), 0) != 0)
        return system_failure();
    return file;
}

} // namespace webots_cloud::adapters

namespace webots_cloud {

result<std::string> read_regular_file(std::filesystem::path const& path, std::size_t limit)
{
    return adapters::read_regular_file(path, limit);
}

} // namespace webots_cloud
