"""HAProxy in front of another server, in the foreground, on the loopback."""

import contextlib
import os
import subprocess
import tempfile
import unittest

from .ports import free_port
from .processes import find_program, listens
from .servers import end, wait_until

CONFIGURATION = """
global
    maxconn 100
defaults
    mode http
    option forwardfor
    timeout connect 10s
    timeout client 60s
    timeout server 60s
frontend site
    bind 127.0.0.1:{port}
    default_backend server
backend server
    server one 127.0.0.1:{target}
"""


@contextlib.contextmanager
def reverse_proxy(target):
    """The port of a HAProxy that passes everything on to this port of the loopback, with X-Forwarded-For. Without it: SkipTest."""
    executable = find_program("haproxy")
    if not executable:
        raise unittest.SkipTest("haproxy is missing (package haproxy)")
    port = free_port()
    with tempfile.TemporaryDirectory(prefix="webots_cloud_haproxy_") as folder:
        path = os.path.join(folder, "haproxy.cfg")
        with open(path, "w") as file:
            file.write(CONFIGURATION.format(port=port, target=target))
        log = open(os.path.join(folder, "output.log"), "w+")
        process = subprocess.Popen([executable, "-db", "-f", path], stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        try:
            wait_until(lambda: process.poll() is not None or listens(port), "HAProxy does not listen")
            if process.poll() is not None:
                log.seek(0)
                raise AssertionError(f"HAProxy ended at once:\n{log.read()}")
            yield port
        finally:
            end(process)
            log.close()
