"""HAProxy in front of other servers, in the foreground, on the loopback; it names its clients by `option forwardfor`."""

import contextlib
import csv
import os
import socket
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


# What is not HTTP, as docs/controllers.md has it.
STREAM = """
listen stream_{port}
    mode tcp
    bind 127.0.0.1:{port}
    timeout connect 5s
    timeout client 1h
    timeout server 1h
    server machine_1 127.0.0.1:{target}
"""

# As its manual begins: what it asks is left to it, unless `check` says more.
CHECKED = """
frontend port_{port}
    bind 127.0.0.1:{port}
    default_backend checked
backend checked
    option httpchk {check}
    default-server check inter 100ms fall 1 rise 1
    server the_one 127.0.0.1:{target}
"""


def program():
    """The path of HAProxy; SkipTest where it is not installed."""
    return required_program("haproxy", "haproxy")


def proxies(targets):
    """Passes connections to some ports of the loopback on to others: `targets` maps the ones to the others."""
    return _running("".join(FRONTEND.format(port=port, target=target) for port, target in targets.items()), targets)


def streams(targets):
    """The same for protocols that HAProxy does not know."""
    return _running("".join(STREAM.format(port=port, target=target) for port, target in targets.items()), targets)


def balancer(port, targets):
    """Shares the connections to a port of the loopback among those of `targets` that are ready."""
    servers = "".join(f"    server number_{number} 127.0.0.1:{target}\n" for number, target in enumerate(targets))
    return _running(BALANCED.format(port=port) + servers, [port])


@contextlib.contextmanager
def health(port, target, check=""):
    """Yields a function that returns what HAProxy thinks of the server at `target`, which it asks by `option httpchk`: the status of the
    server, and that of its last check as in `L7OK`; an empty string before the first one."""
    with _running(CHECKED.format(port=port, target=target, check=check), [port]) as control:
        def look():
            with socket.socket(socket.AF_UNIX) as connection:
                connection.connect(control)
                connection.sendall(b"show stat\n")
                lines = connection.makefile().read().splitlines()
            row = next(row for row in csv.DictReader([lines[0].removeprefix("# "), *lines[1:]]) if row["svname"] == "the_one")
            return row["status"], row["check_status"].removeprefix("* ").replace("INI", "")
        yield look


@contextlib.contextmanager
def _running(frontends, ports):
    executable = program()
    with tempfile.TemporaryDirectory(prefix="webots_cloud_haproxy_") as folder:
        path, log, control = (os.path.join(folder, name) for name in ("haproxy.cfg", "output.log", "control"))
        with open(path, "w") as file:
            file.write(f"global\n    stats socket {control}\n" + CONFIGURATION + frontends)
        with open(log, "wb") as output:
            process = subprocess.Popen([executable, "-db", "-f", path], stdin=subprocess.DEVNULL, stdout=output, stderr=output)
        try:
            wait_until(lambda: process.poll() is not None or all(map(listens, ports)) and os.path.exists(control), "HAProxy does not listen")
            if process.poll() is not None:
                with open(log) as file:
                    raise AssertionError(f"HAProxy ended at once:\n{file.read()}")
            yield control
        finally:
            end(process)
