// Passes connections from a port of the machine on to the same port of the program's own network.
#pragma once

namespace webots_cloud::guard {

/// Binds a port of the machine, on all of its IPv4 addresses, and does not listen yet: nobody else can take
/// it, and whoever connects is refused.   -1: `errno` says why not.
int bind_port(int port);

/// From now on connections to a socket of `bind_port` are made, and wait for `relay`, which calls this
/// itself. False: `errno` says why not.
bool start_listening(int acceptor);

/// Waits until somebody listens on `port` in our own network namespace. Then accepts connections on
/// `acceptor`, a socket of `bind_port` from the machine's namespace, and passes their bytes on. What cannot
/// be written yet is not read, so a slow peer costs one buffer. Does not return.
///
/// Nobody may trace us from now on: who had our sockets would have the network of the machine.
[[noreturn]] void relay(int acceptor, int port);

} // namespace webots_cloud::guard
