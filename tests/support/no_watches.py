"""Starts a program for which the kernel has no watches of epoll left: `no_watches.py PROGRAM [ARGUMENT ...]`.

A filter of system calls answers as the kernel does where other programs of the user have taken all that `fs.epoll.max_user_watches` gives it.
To take them really needs a gigabyte of the kernel's memory, and all other programs of the user.
"""

import ctypes
import errno
import os
import struct
import sys

PR_SET_NO_NEW_PRIVS, PR_SET_SECCOMP, SECCOMP_MODE_FILTER = 38, 22, 2
EPOLL_CTL = {"x86_64": 233, "aarch64": 21}
EPOLL_CTL_ADD = 1
LOAD, JUMP_UNLESS_EQUAL, ANSWER = 0x20, 0x15, 0x06
NUMBER, SECOND_ARGUMENT = 0, 24  # in struct seccomp_data
ERROR, ALLOW = 0x00050000, 0x7FFF0000


def refuse_watches():
    program = b"".join(struct.pack("=HBBI", *line) for line in (
        (LOAD, 0, 0, NUMBER), (JUMP_UNLESS_EQUAL, 0, 3, EPOLL_CTL[os.uname().machine]),
        (LOAD, 0, 0, SECOND_ARGUMENT), (JUMP_UNLESS_EQUAL, 0, 1, EPOLL_CTL_ADD), (ANSWER, 0, 0, ERROR | errno.ENOSPC), (ANSWER, 0, 0, ALLOW)))
    lines = ctypes.create_string_buffer(program)
    filter_ = ctypes.create_string_buffer(struct.pack("HL", 6, ctypes.addressof(lines)))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 or libc.prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, filter_, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "no filter of system calls")


if __name__ == "__main__":
    refuse_watches()
    os.execv(sys.argv[1], sys.argv[1:])
