#include <webots_cloud/instance_root.hpp>

#include <webots_cloud/adapters.hpp>

#include "../core/text.hpp"
#include "file_descriptor.hpp"
#include "remove_tree.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace webots_cloud {
namespace fs = std::filesystem;

using adapters::FileDescriptor;
using core::concat;

namespace {

Failure refusal(fs::path const& folder, std::string_view why)
{
    return Failure(errc::invalid_argument,
                   concat(folder.string(), ", for the directories of simulations: ", why));
}

std::string last_error()
{
    return std::error_code(errno, std::generic_category()).message();
}

/// The folder that ours are in: the operator's choice, and perhaps everybody's.
result<FileDescriptor> open_shared(fs::path const& folder)
{
    FileDescriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    struct stat status;
    if (!opened || ::fstat(opened.get(), &status) != 0)
        return refusal(folder, last_error());
    if ((status.st_mode & S_IWOTH) != 0 && (status.st_mode & S_ISVTX) == 0)
        return refusal(
            folder, "everybody may rename what is in it. Give it the sticky bit (chmod +t), or set TMPDIR to "
                    "another folder.");
    return opened;
}

/// Makes a folder in `parent` if need be. In a shared one somebody else may have been there first.
result<FileDescriptor> take(int parent, fs::path const& folder)
{
    auto const name = folder.filename();
    if (::mkdirat(parent, name.c_str(), 0700) != 0 && errno != EEXIST)
        return refusal(folder, last_error());
    FileDescriptor taken(::openat(parent, name.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    struct stat status;
    if (!taken && (errno == ENOTDIR || errno == ELOOP))
        return refusal(folder,
                       "it is no folder, or a link to one. Remove it, or set TMPDIR to another folder.");
    if (!taken || ::fstat(taken.get(), &status) != 0)
        return refusal(folder, last_error());
    if (status.st_uid != ::geteuid())
        return refusal(folder, "it belongs to another user. Remove it, or set TMPDIR to another folder.");
    if ((status.st_mode & (S_IWGRP | S_IWOTH)) != 0)
        return refusal(folder, "others may write to it. Remove it, or set TMPDIR to another folder.");
    if (::fchmod(taken.get(), 0700) != 0)
        return refusal(folder, last_error());
    return taken;
}

/// `folder`, of which the last `levels` names are ours.
result<FileDescriptor> take(fs::path const& folder, int levels)
{
    if (levels == 0)
        return open_shared(folder);
    auto const parent = take(folder.parent_path(), levels - 1);
    if (!parent)
        return parent.error();
    return take(parent->get(), folder);
}

constexpr std::string_view aside = "left-over-";

/// Empties `folder`, wherever its name may lead by now. What can't be removed gets a name that is no
/// simulation's.
result<LeftOvers> clear(int opened, fs::path const& folder)
{
    LeftOvers left_overs;
    std::error_code failed;
    auto const entries = fs::path("/proc/self/fd") / std::to_string(opened);
    for (auto const& entry : fs::directory_iterator(entries, failed)) {
        auto const outcome = adapters::remove_tree(entry.path()); // which may have an overlay mounted
        if (outcome) {
            ++left_overs.removed;
            continue;
        }
        auto const name = entry.path().filename().string();
        auto const other = concat(aside, make_token().substr(0, 8));
        if (!name.starts_with(aside) && ::renameat(opened, name.c_str(), opened, other.c_str()) != 0)
            return refusal(folder,
                           concat("can't remove the left-over ", name, ": ", outcome.error().message()));
        ++left_overs.kept;
    }
    if (failed)
        return refusal(folder, failed.message());
    return left_overs;
}

} // namespace

result<InstanceRoot> InstanceRoot::open(fs::path const& folder)
{
    auto taken = take(folder, levels);
    if (!taken)
        return taken.error();
    if (::flock(taken->get(), LOCK_EX | LOCK_NB) != 0)
        return refusal(folder, "another simulation server uses it; is one running already?");
    auto const left_overs = clear(taken->get(), folder);
    if (!left_overs)
        return left_overs.error();
    return InstanceRoot(taken->release(), *left_overs);
}

InstanceRoot::~InstanceRoot()
{
    if (lock_ >= 0)
        ::close(lock_);
}

} // namespace webots_cloud
