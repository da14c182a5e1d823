// Leads from the machine to a port of the program's own network: passes connections on, or hands sockets out.
#pragma once

namespace webots_cloud::guard {

/// Binds a port of the machine, on all of its IPv4 addresses, and does not listen yet: nobody else can take
/// it, and whoever connects is refused.   -1: `errno` says why not.
int bind_port(int port);

/// Binds a Unix socket, and does not listen yet. What is there by that name is removed: its folder is the
/// server's alone.   -1: `errno` says why not.
int bind_broker(char const* path);

/// From now on connections to a socket of `bind_port` or `bind_broker` are made, and wait for `relay` or
/// `hand_out`, which call this themselves. False: `errno` says why not.
bool start_listening(int acceptor);

/// Waits until somebody listens on `port` in our own network namespace. Then accepts connections on
/// `acceptor`, a socket of `bind_port` from the machine's namespace, and passes their bytes on. What cannot
/// be written yet is not read, so a slow peer costs one buffer. Does not return.
///
/// `report` gets a byte, and is closed, as soon as connections are accepted; -1: nobody wants to know.
/// Nobody may trace us from now on: with our sockets a program would have the network of the machine.
[[noreturn]] void relay(int acceptor, int port, int report);

/// As `relay`, on a socket of `bind_broker`; but whoever connects gets a socket that is connected to the
/// program (SCM_RIGHTS), and then the end of the conversation; the end alone when the program can't be
/// reached. No byte of theirs passes through us, and no port of the machine is open.
[[noreturn]] void hand_out(int acceptor, int port, int report);

} // namespace webots_cloud::guard
