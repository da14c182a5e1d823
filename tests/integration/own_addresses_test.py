#!/usr/bin/python3
"""A program that reaches the public internet alone reaches no address of this machine, not even one that this gets while the program runs.

Runs in a network namespace of its own, at the end of a cable with an internet."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import own_network  # noqa: E402
from support.other_user import NOBODY  # noqa: E402
from support.servers import descendants, main, program, wait_until  # noqa: E402

EARLY, LATE, LATER = "93.184.216.1", "93.184.216.2", "93.184.216.3"  # public addresses, of nobody's in here
FORBIDDEN = "EHOSTUNREACH"

# Says again and again what comes of a connection to each address: "ADDRESS OUTCOME".
TRY = r"""
import errno, socket, sys
while True:
    for address in sys.argv[2:]:
        outcome = "done"
        with socket.socket() as one:
            one.settimeout(0.2)
            try:
                one.connect((address, int(sys.argv[1])))
                outcome = one.recv(10).decode() or "closed"
            except OSError as error:
                outcome = errno.errorcode.get(error.errno, "silence")
        print(address, outcome, flush=True)
"""


def setUpModule():
    unittest.enterModuleContext(own_network.Outside())


def name(process):
    with open(f"/proc/{process}/comm", encoding="utf-8") as file:
        return file.read().strip()


def parent(process):
    with open(f"/proc/{process}/stat", encoding="utf-8") as file:
        return int(file.read().rpartition(")")[2].split()[1])


class Program:
    """Runs in such a network, and tries to connect."""

    def __init__(self, user, port, *addresses):
        tools = [shutil.which(each, path="/usr/bin:/usr/sbin:/bin:/sbin") for each in ("slirp4netns", "ip")]
        if None in tools:
            raise unittest.SkipTest("slirp4netns or ip is missing (packages slirp4netns, iproute2)")
        self.outcomes = {each: [] for each in addresses}
        with tempfile.NamedTemporaryFile("w") as rules:
            os.chmod(rules.name, 0o644)
            self.guard = subprocess.Popen([program("webots-process-guard"), "--network", "internet", "0", *tools, rules.name, "200",
                                           sys.executable, "-c", TRY, str(port), *addresses], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, user=user, group=user)
            self.others = []
            self.reader = threading.Thread(target=self._read)
            self.reader.start()
            try:
                wait_until(lambda: all(self.outcomes.values()) or self.others, "the program tries nothing")
                if self.others:
                    raise AssertionError(self.others)
            except AssertionError:
                self.close()
                raise

    def _read(self):
        for line in self.guard.stdout:
            words = line.split()
            if len(words) == 2 and words[0] in self.outcomes:
                self.outcomes[words[0]].append(words[1])
            else:
                self.others.append(line)

    def next(self, to, number):
        """So many outcomes from now on, without the one that may be under way."""
        begin = len(self.outcomes[to]) + 1
        wait_until(lambda: len(self.outcomes[to]) >= begin + number, "the program tries no more")
        return self.outcomes[to][begin:begin + number]

    def close(self):
        self.guard.kill()
        self.reader.join()
        self.guard.stdin.close()
        self.guard.stdout.close()
        self.guard.wait()


class OwnAddresses(unittest.TestCase):
    user = None  # root

    def setUp(self):
        self.service = socket.create_server(("0.0.0.0", 0), backlog=100)
        self.addCleanup(self.service.close)
        self.port = self.service.getsockname()[1]
        threading.Thread(target=self.serve, daemon=True).start()

    def add(self, address):
        """To the machine, until the test ends."""
        change = lambda action: subprocess.run(["ip", "address", action, f"{address}/32", "dev", "lo"], check=True)  # noqa: E731
        change("add")
        self.addCleanup(change, "del")

    def serve(self):
        while True:
            try:
                with self.service.accept()[0] as one:
                    one.sendall(b"service")
            except OSError:
                return

    def test_what_the_machine_has_when_the_program_starts_and_gets_while_it_runs_is_out_of_reach(self):
        self.add(EARLY)
        running = Program(self.user, self.port, EARLY, LATE, LATER)
        self.addCleanup(running.close)
        self.assertEqual(set(running.outcomes[EARLY]), {FORBIDDEN})
        self.assertEqual(set(running.next(LATE, 2)), {"silence"}, "an address of nobody's")
        for new in (LATE, LATER):
            self.add(new)
            with socket.create_connection((new, self.port), timeout=30) as here:
                self.assertEqual(here.recv(10), b"service", "the service listens there")
            wait_until(lambda: FORBIDDEN in running.outcomes[new], lambda: f"it reaches {new}: {running.outcomes[new]}")
            self.assertEqual(set(running.next(new, 5)), {FORBIDDEN})
        self.assertEqual(set(running.next(EARLY, 2)), {FORBIDDEN})

    def test_a_program_ends_with_the_process_that_looks_after_the_addresses(self):
        running = Program(self.user, self.port, LATE)
        self.addCleanup(running.close)
        first, *_ = [each for each in descendants(running.guard.pid) if parent(each) == running.guard.pid and name(each).startswith("webots-process")]
        [watching] = [each for each in descendants(first) if name(each).startswith("webots-process")]
        os.kill(watching, signal.SIGKILL)
        wait_until(lambda: running.guard.poll() is not None, "the program goes on")


class OwnAddressesWithoutPrivileges(OwnAddresses):
    """The network is one of a user namespace."""

    user = NOBODY

    @classmethod
    def setUpClass(cls):
        """Where /dev/net/tun is root's alone, there is one of everybody's in our mount namespace."""
        folder = tempfile.mkdtemp(prefix="webots_cloud_tun_")
        cls.addClassCleanup(os.rmdir, folder)
        subprocess.run(["mount", "-t", "tmpfs", "none", folder], check=True)
        cls.addClassCleanup(subprocess.run, ["umount", "--lazy", folder], check=True)
        device = os.path.join(folder, "tun")
        if subprocess.run(["mknod", "-m", "666", device, "c", "10", "200"], check=False).returncode != 0:
            raise unittest.SkipTest("no device of our own can be made here")
        subprocess.run(["mount", "--bind", device, "/dev/net/tun"], check=True)
        cls.addClassCleanup(subprocess.run, ["umount", "--lazy", "/dev/net/tun"], check=True)


if __name__ == "__main__":
    own_network.enter()
    main()
