#include "remove_tree.hpp"

#include "mounts.hpp"

namespace webots_cloud::adapters {

result<> remove_tree(std::filesystem::path const& directory)
{
    if (auto const unmounted = unmount_below(directory); !unmounted)
        return unmounted.error();
    std::error_code failed;
    std::filesystem::remove_all(directory, failed);
    if (failed)
        return Failure(errc::unavailable, failed.message());
    return {};
}

} // namespace webots_cloud::adapters
