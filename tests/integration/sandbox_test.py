#!/usr/bin/python3
"""What a stranger's project can do to its server, its neighbours and the network, with each sandbox and, to show that the attempts are
worth something, with none. The attempts are in tests/support/sandbox_attempts.py, what is common to all sandboxes in sandbox_contract.py.

Runs in a network namespace of its own, at the end of a cable with an internet of two kinds of machines, public and private.
"""

import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import own_network  # noqa: E402
from support.firejail import require_firejail  # noqa: E402
from support.other_user import NOBODY, as_nobody_with_numbers, require_subordinate_users  # noqa: E402
from support.sandbox_contract import Contract, Unwalled  # noqa: E402
from support.servers import main  # noqa: E402


def for_all_but_root():
    """What kernels such as Debian's keep for who has capabilities, which no simulation has: performance counters."""
    with open("/proc/sys/kernel/perf_event_paranoid") as level:
        return {"count_performance": ("EACCES",)} if int(level.read()) > 2 else {}


def setUpModule():
    unittest.enterModuleContext(own_network.Outside())


class Bubblewrap(Contract, unittest.TestCase):
    sandbox = "bubblewrap"
    keys = {"sandbox": "bubblewrap"}
    needs = ("bwrap", "slirp4netns", "ip")
    description = "bubblewrap, public internet only"
    expected = {"connect_public": ("done",)}


class BubblewrapOfAnotherUserWithoutNetwork(Contract, unittest.TestCase):
    sandbox = "bubblewrap"
    variant = 'with `"network": "none"`'
    keys = {"sandbox": "bubblewrap", "network": "none"}
    needs = ("bwrap",)
    user = NOBODY
    description = "bubblewrap, no network"


class BubblewrapInTheMachinesNetwork(Contract, unittest.TestCase):
    sandbox = "bubblewrap"
    variant = 'with `"network": "host"`'
    keys = {"sandbox": "bubblewrap", "network": "host"}
    has_network = False
    needs = ("bwrap",)
    description = "bubblewrap, network of this machine"
    expected = dict.fromkeys(("connect_loopback", "connect_ipv6_loopback", "connect_server", "connect_neighbour", "connect_own_address",
                              "connect_abstract", "connect_private", "connect_shared", "connect_metadata", "send_private_datagram",
                              "connect_public"), ("done",))


class Firejail(Contract, unittest.TestCase):
    """As bubblewrap, but its filter of system calls forbids some of it before the kernel looks for the victim."""

    sandbox = "firejail"
    keys = {"sandbox": "firejail"}
    needs = ("firejail", "slirp4netns", "ip")
    description = "firejail, public internet only"
    expected = {"connect_public": ("done",), "enter_namespace": ("EACCES",),
                **dict.fromkeys(("trace_neighbour", "trace_own_guard", "read_memory"), ("EPERM",))}

    @classmethod
    def setUpClass(cls):
        require_firejail()
        super().setUpClass()


class NoSandbox(Unwalled, unittest.TestCase):
    sandbox = "none"
    keys = {"sandbox": "none"}
    description = '"sandbox":"none; root"'
    expected = {**Unwalled.expected, **for_all_but_root()}


class NoSandboxOfAnotherUser(Unwalled, unittest.TestCase):
    sandbox = "none"
    variant = "where the server is another user's"
    keys = {"sandbox": "none"}
    user = NOBODY
    description = '"sandbox":"none; the server'
    expected = {**Unwalled.expected, **for_all_but_root(),
                **dict.fromkeys(("read_shadow", "write_usr", "write_etc", "write_core_pattern", "write_sysrq", "write_sys", "write_disk",
                                 "write_kernel_log"), ("EACCES",)),
                **dict.fromkeys(("open_packet_socket", "open_raw_socket", "change_root"), ("EPERM",)),
                "have_capabilities": ("none",)}


class OtherUsers(Unwalled, unittest.TestCase):
    """Without a sandbox each simulation of root's server is a user of its own."""

    sandbox = "none, other users"
    keys = {"sandbox": "none", "simulationUser": "auto"}
    description = '"sandbox":"none; another user for each simulation"'
    expected = {**Unwalled.expected, **for_all_but_root(),
                **dict.fromkeys(("read_shadow", "read_configuration", "read_key", "read_log", "read_home", "read_state", "read_by_link",
                                 "read_neighbour", "write_neighbour", "write_server_folder", "write_instances", "write_usr", "write_etc",
                                 "ask_as_operator", "write_core_pattern", "write_sysrq", "write_sys", "write_disk", "write_kernel_log"),
                                ("EACCES", "EROFS", "ENOENT")),
                "hard_link": ("EXDEV", "EPERM", "EACCES"),
                **dict.fromkeys(("open_packet_socket", "open_raw_socket", "change_root"), ("EPERM",)),
                "have_capabilities": ("none",)}


class SubordinateUsers(OtherUsers):
    """So are those of a server that is not root, but has numbers of /etc/subuid."""

    variant = "with subordinate numbers"
    keys = {"sandbox": "none", "simulationUser": "subordinate", "display": "none"}
    user = NOBODY
    wrapper = as_nobody_with_numbers()

    @classmethod
    def setUpClass(cls):
        require_subordinate_users()
        super().setUpClass()


if __name__ == "__main__":
    own_network.enter()
    main()
