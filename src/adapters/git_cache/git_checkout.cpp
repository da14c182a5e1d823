#include "git_checkout.hpp"

#include "adapters/files/project_files.hpp"
#include "adapters/files/remove_tree.hpp"
#include "git_overlay.hpp"

#include "core/refusals.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"

#include <fcntl.h>
#include <linux/fs.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;
using core::concat;

/// Makes `directory` and in it the folder `name`, which it opens.
result<FileDescriptor> make_folders(fs::path const& directory, std::string const& name)
{
    auto const folder = make_folder(AT_FDCWD, directory.c_str());
    if (!folder)
        return folder.error();
    if (!core::is_safe_file_name(name))
        return core::refused(core::Refused::impossible_folder, {{"name", core::printable(name, 60)}});
    return make_folder(folder->get(), name.c_str());
}

/// Whether files can share their blocks from one folder to the other.
bool can_clone(fs::path const& cache, fs::path const& instances)
{
    auto const name = concat(".probe-", std::to_string(::getpid()));
    auto const below = cache / name;
    auto const above = instances / name;
    bool cloned = false;
    if (write_file(AT_FDCWD, below.c_str(), "probe", 0644) && write_file(AT_FDCWD, above.c_str(), "", 0644)) {
        FileDescriptor const from(::open(below.c_str(), O_RDONLY | O_CLOEXEC));
        FileDescriptor const to(::open(above.c_str(), O_WRONLY | O_CLOEXEC));
        cloned = ::ioctl(to.get(), FICLONE, from.get()) == 0;
    }
    ::unlink(below.c_str());
    ::unlink(above.c_str());
    return cloned;
}

} // namespace

GitCheckout::GitCheckout(fs::path const& cache, fs::path const& instances)
{
    if (instances.empty())
        return;
    keep_folders_apart(instances);
    overlay_ = can_overlay(cache, instances);
    if (!overlay_ && can_clone(cache, instances))
        way_ = GitCopyWay::clone;
}

std::string_view GitCheckout::describe() const noexcept
{
    if (overlay_)
        return "overlay mounts";
    return way_ == GitCopyWay::clone ? "reflinks" : "copying";
}

result<fs::path> GitCheckout::check_out(GitSnapshot const& snapshot, fs::path const& directory,
                                        std::string const& repository, BlockingPool& pool,
                                        std::atomic<bool> const& aborted) const
{
    auto const target = make_folders(directory, repository);
    if (!target)
        return target.error();
    auto const source = open_folder(AT_FDCWD, snapshot.files.c_str());
    if (!source)
        return source.error();
    auto root = directory / repository;
    if (!snapshot.target.folder.empty())
        root /= snapshot.target.folder;
    // The name begins with a dot, as no repository's does.
    if (overlay_ && mount_overlay(source->get(), directory / ".overlay", target->get()))
        return root;
    auto const copied = copy_folder(snapshot.index, source->get(), target->get(), way_, pool, aborted);
    if (!copied)
        return copied.error();
    return root;
}

} // namespace webots_cloud::adapters
