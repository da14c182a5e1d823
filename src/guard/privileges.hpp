// What a simulation may not have, whoever it runs as.
#pragma once

namespace webots_cloud::guard {

/// Takes from this process, and from every program that it becomes, the capabilities that reach beyond a
/// user's own files and processes: to trace others, to mount, to load modules and the like. Without effect on
/// who has none.
void drop_capabilities();

/// Whether the kernel can keep a process from signalling others (Landlock, since Linux 6.12).
bool can_confine_signals();

/// From now on this process and its children can neither signal nor trace a process outside.   False: the
/// kernel can't.
bool confine_signals();

} // namespace webots_cloud::guard
