// Users for programs of a guard that is not root: the numbers that /etc/subuid and /etc/subgid give its user.
#pragma once

namespace webots_cloud::guard {

/// A user namespace in which we are root (0), and 1 and so on are the numbers that we have been given: made
/// by `newuidmap` and `newgidmap`, which alone may do that. Its descriptor is sent over standard input, a
/// Unix socket; it exists for as long as somebody has that open. Where it can't be made, the reason is
/// printed.
/// `words`: NEWUIDMAP NEWGIDMAP FIRST_USER FIRST_GROUP COUNT, both programs absolute.
/// Returns the exit status of the guard.
int make_user_namespace(char** words);

/// From now on we are root in the namespace whose descriptor this is, and closes it. Outside we remain who we
/// are.   False: `errno` says why not.
bool enter_user_namespace(int descriptor);

} // namespace webots_cloud::guard
