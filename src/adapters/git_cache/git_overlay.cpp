#include "git_overlay.hpp"

#include "adapters/files/mount_thread.hpp"
#include "adapters/files/project_files.hpp"
#include "adapters/files/remove_tree.hpp"

#include "core/text.hpp"

#include <fcntl.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;
using core::concat;

/// A path for the kernel that holds neither commas nor colons, whatever the folder is called.
std::string path_of(int folder)
{
    return concat("/proc/self/fd/", std::to_string(folder));
}

bool mount_with(std::string const& options, int target)
{
    auto const path = path_of(target);
    errno = mount_elsewhere([&] {
        return ::mount("overlay", path.c_str(), "overlay", MS_NOSUID | MS_NODEV, options.c_str()) == 0
                   ? 0
                   : errno;
    });
    return errno == 0;
}

/// Removes a folder when it goes out of sight.
struct Scratch
{
    ~Scratch() { remove_tree(folder); }

    fs::path folder;
};

} // namespace

result<> mount_overlay(int lower, fs::path const& scratch, int target)
{
    auto const folder = make_folder(AT_FDCWD, scratch.c_str());
    if (!folder)
        return folder.error();
    auto const upper = make_folder(folder->get(), "upper");
    auto const work = make_folder(folder->get(), "work");
    // What is in there is not for simulations, which may own the folder around it.
    if (!upper || !work || ::fchmod(folder->get(), S_IRWXU) != 0)
        return disk_failure();
    auto const options = concat("lowerdir=", path_of(lower), ",upperdir=", path_of(upper->get()),
                                ",workdir=", path_of(work->get()));
    // Folders of the project can be renamed ("redirect_dir"), and nothing of it outlives the simulation, so
    // nothing needs to be synchronised ("volatile", since Linux 5.10). Files that only change hands, as all
    // do when simulations run as another user, are not copied ("metacopy").
    for (auto const* const more :
         {",metacopy=on,redirect_dir=on,volatile", ",redirect_dir=on,volatile", ",volatile", ""})
        if (mount_with(concat(options, more), target))
            return {};
    return disk_failure();
}

bool can_overlay(fs::path const& cache, fs::path const& instances)
{
    auto const name = concat(".probe-", std::to_string(::getpid()));
    Scratch const below{cache / name};
    Scratch const above{instances / name};
    auto const lower = make_folder(AT_FDCWD, below.folder.c_str());
    auto const place = make_folder(AT_FDCWD, above.folder.c_str());
    if (!lower || !place || !write_file(lower->get(), "old", "old", 0644))
        return false;
    auto const target = make_folder(place->get(), "target");
    if (!target || !mount_overlay(lower->get(), above.folder / "overlay", target->get()))
        return false;
    auto const mounted = open_folder(place->get(), "target"); // the descriptor from before is below the mount
    if (!mounted || !write_file(mounted->get(), "new", "new", 0644) ||
        ::unlinkat(mounted->get(), "old", 0) != 0)
        return false;
    return ::faccessat(lower->get(), "new", F_OK, 0) != 0 && ::faccessat(lower->get(), "old", F_OK, 0) == 0;
}

} // namespace webots_cloud::adapters
