#include <webots_cloud/instance_root.hpp>

#include "../core/text.hpp"
#include "remove_tree.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace webots_cloud {
namespace fs = std::filesystem;

using core::concat;

result<InstanceRoot> InstanceRoot::open(fs::path const& folder)
{
    auto const refuse = [&](std::string_view why) {
        return Failure(errc::invalid_argument, concat("instances folder ", folder.string(), ": ", why));
    };
    std::error_code failed;
    fs::create_directories(folder.parent_path(), failed);
    if (failed)
        return refuse(failed.message());
    // In a shared folder such as /tmp somebody else may have been there first: take nothing that is not ours.
    if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
        return refuse(std::error_code(errno, std::generic_category()).message());
    int const directory = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (directory < 0)
        return refuse(std::error_code(errno, std::generic_category()).message());
    InstanceRoot root(directory, 0);
    struct stat status;
    if (::fstat(directory, &status) != 0 || status.st_uid != ::geteuid())
        return refuse("it belongs to another user");
    if (::fchmod(directory, 0700) != 0)
        return refuse(std::error_code(errno, std::generic_category()).message());
    if (::flock(directory, LOCK_EX | LOCK_NB) != 0)
        return refuse("another simulation server uses it; is one running already?");
    for (auto const& entry : fs::directory_iterator(folder, failed)) {
        auto const removed = adapters::remove_tree(entry.path()); // which may have an overlay mounted
        if (!removed)
            return refuse(concat("can't remove the left-over ", entry.path().string(), ": ", removed.error().message()));
        ++root.removed_;
    }
    if (failed)
        return refuse(failed.message());
    return root;
}

InstanceRoot::~InstanceRoot()
{
    if (lock_ >= 0)
        ::close(lock_);
}

} // namespace webots_cloud
