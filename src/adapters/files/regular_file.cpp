#include "regular_file.hpp"

#include "core/text.hpp"
#include "file_descriptor.hpp"

#include <webots_cloud/adapters/files.hpp>

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

} // namespace webots_cloud::adapters

namespace webots_cloud {

result<std::string> read_regular_file(std::filesystem::path const& path, std::size_t limit)
{
    return adapters::read_regular_file(path, limit);
}

} // namespace webots_cloud
