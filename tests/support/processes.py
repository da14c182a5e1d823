"""What all servers that tests start share."""

import ctypes
import os
import shutil
import signal
import socket
import unittest

PR_SET_PDEATHSIG = 1


class Startable:
    """A context that starts at its beginning and closes at its end, also when the start fails."""

    def __enter__(self):
        try:
            self.start()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_):
        self.close()


def find_program(name):
    """The path of a program, also when it is only in root's PATH; None when it is not installed."""
    return shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")


def required_program(name, package):
    """The path of a program; SkipTest when it is not installed."""
    found = find_program(name)
    if not found:
        raise unittest.SkipTest(f"{name} is missing (package {package})")
    return found


def end_with_parent():
    """In the child: has it end with the test, even if the test is killed."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def listens(port):
    """Whether a server accepts connections on this port of the loopback interface."""
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
