// System calls that simulators do without, and that sandboxes of namespaces leave to everybody.
#pragma once

namespace webots_cloud::guard {

/// Executes a program, argv[0], which can't use these system calls, nor can anything that it starts; does
/// not return.
///
/// Refused with EPERM: keys (the session keyring of the server is inherited), io_uring, BPF, userfaultfd,
/// performance counters and the kernel's log. Sockets are those of this machine and of the Internet; a VSOCK,
/// for one, would reach the host of a virtual machine around every network rule. Programs of other
/// architectures (32 bits) can't run: their system calls have other numbers.
[[noreturn]] void execute_filtered(char** argv);

} // namespace webots_cloud::guard
