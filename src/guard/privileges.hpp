// What a simulation may not have, whoever it runs as.
#pragma once

namespace webots_cloud::guard {

/// Takes from this process, and from every program that it becomes, the capabilities that reach beyond a
/// user's own files and processes: to trace others, to mount, to load modules and the like. Without effect on
/// who has none.
void drop_capabilities();

/// From now on nobody but root can trace this process, or look into its memory and descriptors. Not where
/// `/proc` hides such processes
/// (`hidepid`): the server could not see the tree below us, and would wait for its port in vain.
void forbid_tracing();

/// Whether the kernel can keep a process from signalling others (Landlock, since Linux 6.12).
bool can_confine_signals();

/// From now on this process and its children can neither signal nor trace a process outside.   False: the
/// kernel can't.
bool confine_signals();

} // namespace webots_cloud::guard
