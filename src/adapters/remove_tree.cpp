#include "remove_tree.hpp"

#include "mounts.hpp"

#include <fts.h>
#include <sys/stat.h>

#include <memory>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;

/// A simulation may leave folders that not even their owner may look into or change.
void open_folders(fs::path const& directory)
{
    auto path = directory.string();
    char* const roots[] = {path.data(), nullptr};
    constexpr int options = FTS_PHYSICAL | FTS_NOCHDIR | FTS_XDEV;
    std::unique_ptr<FTS, int (*)(FTS*)> const walk(::fts_open(roots, options, nullptr), &::fts_close);
    while (auto const* const entry = walk ? ::fts_read(walk.get()) : nullptr)
        if (entry->fts_info == FTS_D)
            (void)::chmod(entry->fts_accpath, S_IRWXU); // before it is read
}

} // namespace

result<> remove_tree(fs::path const& directory)
{
    if (auto const unmounted = unmount_below(directory); !unmounted)
        return unmounted.error();
    std::error_code failed;
    fs::remove_all(directory, failed);
    if (failed == std::errc::permission_denied) {
        open_folders(directory);
        fs::remove_all(directory, failed);
    }
    if (failed)
        return Failure(errc::unavailable, failed.message());
    return {};
}

} // namespace webots_cloud::adapters
