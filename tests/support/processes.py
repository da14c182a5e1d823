"""What the servers that tests start have in common."""

import ctypes
import os
import shutil
import signal
import socket

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
    """Its path, also where only root has it in the PATH; None: it is not installed."""
    return shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")


def end_with_parent():
    """In the child: ends when the test does, even if that is killed."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def listens(port):
    """Whether somebody takes connections on this port of the loopback."""
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
