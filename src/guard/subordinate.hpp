// Users for programs of a guard that is not root: the numbers that /etc/subuid and /etc/subgid give its user,
// or those that root gives it.
#pragma once

namespace webots_cloud::guard {

/// A user namespace in which we are root (0), and 1 and so on are the numbers that we have been given: made
/// by `newuidmap` and `newgidmap`, which alone may do that. Its descriptor is sent over standard input, a
/// Unix socket; it exists for as long as somebody has that open. Where it can't be made, the reason is
/// printed.
/// `words`: NEWUIDMAP NEWGIDMAP FIRST_USER FIRST_GROUP COUNT, both programs absolute.
/// Returns the exit status of the guard.
int make_user_namespace(char** words);

/// For a service whose user may not use `newuidmap`: run by root before the service starts. Makes such a user
/// namespace for the user who owns `folder`, who may enter it, with 65536 numbers that nobody else has, and
/// pins it to the file `folder`.users, so that no process has to stay in it. Beside the folder, since systemd
/// gives all that is in there to another user when the unit's user changes. Nothing is made for root. Where
/// it can't be made, the reason goes to standard error. Returns the exit status of the guard.
int pin_user_namespace(char const* folder);

/// Removes that file again, after which the namespace ends with the last process in it.
/// Returns the exit status of the guard.
int unpin_user_namespace(char const* folder);

/// From now on we are root in the namespace whose descriptor this is, and closes it. Outside we remain who we
/// are.   False: `errno` says why not.
bool enter_user_namespace(int descriptor);

} // namespace webots_cloud::guard
