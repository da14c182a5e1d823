// Passes open files to another process.
#pragma once

namespace webots_cloud::guard {

/// Sends a descriptor (SCM_RIGHTS) with one byte over a Unix socket. `flags`: those of sendmsg.
/// Returns: whether it was taken; errno says why not.
bool send_descriptor(int socket, int descriptor, int flags = 0);

} // namespace webots_cloud::guard
