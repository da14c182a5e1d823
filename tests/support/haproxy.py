"""HAProxy in front of other servers, in the foreground, on the loopback; it names its clients by `option forwardfor`."""

import contextlib
import os
import subprocess
import tempfile

from .processes import listens, required_program
from .servers import end, wait_until

CONFIGURATION = """
defaults
    mode http
    option forwardfor
    timeout connect 30s
    timeout client 60s
    timeout server 60s
    timeout tunnel 60s
"""

FRONTEND = """
frontend port_{port}
    bind 127.0.0.1:{port}
    default_backend server_{target}
backend server_{target}
    server the_one 127.0.0.1:{target}
"""

# Who is at a server that has died learns it at once, and finds another one behind the same address.
BALANCED = """
frontend port_{port}
    bind 127.0.0.1:{port}
    default_backend all_of_{port}
backend all_of_{port}
    balance roundrobin
    option httpchk GET /readyz
    option redispatch
    retries 3
    default-server check inter 200ms fall 1 rise 1 on-marked-down shutdown-sessions
"""


def program():
    """The path of HAProxy; SkipTest where it is not installed."""
    return required_program("haproxy", "haproxy")


def proxies(targets):
    """Passes connections to some ports of the loopback on to others: `targets` maps the ones to the others."""
    return _running("".join(FRONTEND.format(port=port, target=target) for port, target in targets.items()), targets)


def balancer(port, targets):
    """Shares the connections to a port of the loopback among those of `targets` that are ready."""
    servers = "".join(f"    server number_{number} 127.0.0.1:{target}\n" for number, target in enumerate(targets))
    return _running(BALANCED.format(port=port) + servers, [port])


@contextlib.contextmanager
def _running(frontends, ports):
    executable = program()
    with tempfile.TemporaryDirectory(prefix="webots_cloud_haproxy_") as folder:
        path = os.path.join(folder, "haproxy.cfg")
        with open(path, "w") as file:
            file.write(CONFIGURATION + frontends)
        log = os.path.join(folder, "output.log")
        with open(log, "wb") as output:
            process = subprocess.Popen([executable, "-db", "-f", path], stdin=subprocess.DEVNULL, stdout=output, stderr=output)
        try:
            wait_until(lambda: process.poll() is not None or all(map(listens, ports)), "HAProxy does not listen")
            if process.poll() is not None:
                with open(log) as file:
                    raise AssertionError(f"HAProxy ended at once:\n{file.read()}")
            yield
        finally:
            end(process)
