// Descriptors that lead to another process.
#pragma once

#include <sys/types.h>

namespace webots_cloud::guard {

/// Sends a descriptor (SCM_RIGHTS) with one byte over a Unix socket. `flags`: those of sendmsg.
/// Returns: whether it was taken; errno says why not.
bool send_descriptor(int socket, int descriptor, int flags = 0);

/// Waits until `child` has written to the other end of `descriptor`, or closed it. Wakes it (SIGCONT) now and
/// then: somebody may have stopped it, and we hear nothing else meanwhile, not even that we are to end.
void await_word_of(pid_t child, int descriptor);

} // namespace webots_cloud::guard
