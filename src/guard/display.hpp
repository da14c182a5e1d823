// A virtual X server for one program alone.
#pragma once

namespace webots_cloud::guard {

/// In a mount namespace of its own: an empty folder in place of the one in which X servers have their
/// sockets. Servers outside have no sockets in there, and those of servers inside are not seen outside.
///
/// Returns: false: `errno` says why not.
bool make_display_folder();

/// Starts `server` (Xvfb) on a display of its own with a password of its own, and executes the program on it,
/// in this process. The folder of displays must be empty, or be missing. Without a program (`argv` is empty)
/// it waits until the server is ready, and exits with 0.
///
/// The server listens on its socket in that folder alone, and ends with the namespaces of the program. When
/// it ends before, the program is killed, after a line which begins with `display has ended`. When it is not
/// ready after `limit_ms`, a line says why, and the program is killed, or not executed at all.
///
/// A server that takes over a socket which listens already (socket activation, `LISTEN_FDS`) gets ready
/// beside the program, whose connections wait for it in the socket; the program waits for any other one.
[[noreturn]] void execute_on_display(char const* server, int limit_ms, char** argv);

} // namespace webots_cloud::guard
