#include "file_descriptor.hpp"

#include "core/text.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>

namespace webots_cloud {
namespace {

using adapters::FileDescriptor;
using core::concat;

// <linux/landlock.h> of Debian 12 ends with version 2 of the interface.
struct Ruleset
{
    std::uint64_t files = 0;
    std::uint64_t network = 0;
    std::uint64_t scoped = 0;
};
constexpr std::uint64_t first_version = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1; // all rights of version 1
constexpr std::uint64_t refer = std::uint64_t{1} << 13;                         // version 2
constexpr std::uint64_t truncate = std::uint64_t{1} << 14;                      // version 3
constexpr std::uint64_t device_control = std::uint64_t{1} << 15;                // version 5
constexpr std::uint64_t scope_signals = std::uint64_t{1} << 1;                  // version 6

constexpr std::uint64_t reading = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t of_files =
    LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_EXECUTE | truncate;
// Pipes and links are renamed where others have put them in place of a log.
constexpr std::uint64_t writing =
    reading | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_REMOVE_DIR | LANDLOCK_ACCESS_FS_REMOVE_FILE |
    LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_REG | LANDLOCK_ACCESS_FS_MAKE_SOCK |
    LANDLOCK_ACCESS_FS_MAKE_FIFO | LANDLOCK_ACCESS_FS_MAKE_SYM | refer | truncate;

std::uint64_t rights_of_version(long version)
{
    return first_version | (version >= 2 ? refer : 0) | (version >= 3 ? truncate : 0) |
           (version >= 5 ? device_control : 0);
}

/// What is not there needs no rule.
bool allow(int ruleset, std::filesystem::path const& path, std::uint64_t rights)
{
    FileDescriptor const opened(::open(path.c_str(), O_PATH | O_CLOEXEC));
    struct stat status;
    if (!opened || ::fstat(opened.get(), &status) != 0)
        return true;
    landlock_path_beneath_attr rule{};
    rule.parent_fd = opened.get();
    rule.allowed_access = S_ISDIR(status.st_mode) ? rights : rights & of_files;
    return ::syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0;
}

Failure landlock_failure()
{
    return {errc::unavailable,
            concat("Landlock: ", std::error_code(errno, std::generic_category()).message())};
}

} // namespace

result<> confine_to_files(OwnFiles const& files)
{
    auto const version = ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
    if (version < 1)
        return Failure(errc::unavailable, "this kernel has no Landlock");
    // Without `refer`, of version 2, no file can be moved from one folder to another.
    if (version < 2 && files.moves_files)
        return Failure(errc::unavailable, "this kernel's Landlock is too old (Linux 5.19 is needed)");
    Ruleset wanted;
    wanted.files = rights_of_version(version);
    wanted.scoped = version >= 6 && !files.signals ? scope_signals : 0;
    FileDescriptor const ruleset(
        static_cast<int>(::syscall(SYS_landlock_create_ruleset, &wanted, sizeof wanted, 0)));
    if (!ruleset)
        return landlock_failure();
    for (auto const& path : files.read)
        if (!allow(ruleset.get(), path, reading & wanted.files))
            return landlock_failure();
    for (auto const& path : files.write)
        if (!allow(ruleset.get(), path, writing & wanted.files))
            return landlock_failure();
    for (auto const& path : files.tidy)
        if (!allow(ruleset.get(), path, LANDLOCK_ACCESS_FS_REMOVE_DIR))
            return landlock_failure();
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
        ::syscall(SYS_landlock_restrict_self, ruleset.get(), 0) != 0)
        return landlock_failure();
    return {};
}

} // namespace webots_cloud
