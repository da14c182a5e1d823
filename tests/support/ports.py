"""Ports for tests that nothing else on the machine takes between looking for them and listening on them.

A bind to port 0 takes from the range that outgoing connections use too, of which this suite makes thousands. Here a test leases whole
blocks of ports below that range. A lease is an abstract Unix socket: no other test can have it, and it ends with the process that holds it.
"""

import atexit
import contextlib
import random
import socket

FIRST, BLOCK = 10000, 16

# The next port to try: neighbouring leases leave room for long rows, which scattered ones would not.
_next_block = None
_leases = contextlib.ExitStack()
atexit.register(_leases.close)


def free_port(following=0):
    """A port that is free, and so are the `following` ones after it; no other caller gets them while this process lives."""
    global _next_block
    blocks = following // BLOCK + 1
    last = (_first_of_outgoing_connections() - FIRST) // BLOCK - blocks
    for _ in range(1000):
        block = _next_block if _next_block is not None and _next_block <= last else random.randint(0, last)
        _next_block = None  # elsewhere, if these are taken
        first = FIRST + block * BLOCK
        with contextlib.suppress(OSError), contextlib.ExitStack() as attempt:
            for number in range(block, block + blocks):
                lease = attempt.enter_context(socket.socket(socket.AF_UNIX))
                lease.bind(f"\0webots_cloud_test_ports_{number}")
            with contextlib.ExitStack() as probes:
                for port in range(first, first + following + 1):
                    probes.enter_context(socket.socket()).bind(("0.0.0.0", port))
            _leases.enter_context(attempt.pop_all())
            _next_block = block + blocks
            return first
    raise AssertionError(f"no {following + 1} free ports in a row between {FIRST} and {_first_of_outgoing_connections()}")


def _first_of_outgoing_connections():
    with open("/proc/sys/net/ipv4/ip_local_port_range") as file:
        return int(file.read().split()[0])
