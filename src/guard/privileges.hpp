// Takes privileges away from simulations, whichever user they run as.
#pragma once

namespace webots_cloud::guard {

/// Takes from this process, and from every program that it executes, the capabilities that reach beyond a
/// user's own files and processes: to trace others, to mount, to load modules and the like. No effect without
/// capabilities.
void drop_capabilities();

/// From now on only root can trace this process, or look into its memory and descriptors. Does nothing where
/// `/proc` hides such processes (`hidepid`): the server could not see the tree below the guard, and would
/// wait for its port in vain.
void forbid_tracing();

/// Whether the kernel can keep a process from signalling others (Landlock, since Linux 6.12).
bool can_confine_signals();

/// From now on this process and its children can neither signal nor trace processes outside.
///
/// Returns: false where the kernel can't do that.
bool confine_signals();

} // namespace webots_cloud::guard
