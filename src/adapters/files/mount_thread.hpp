// Mounts for threads that are confined to files: Landlock forbids them to mount and unmount anything.
#pragma once

#include <functional>

namespace webots_cloud::adapters {

/// Calls the function, which mounts or unmounts something, on the `MountThread` if there is one, else here.
/// Blocks.   Returns: what the function returns.
int mount_elsewhere(std::function<int()> const& call);

} // namespace webots_cloud::adapters
