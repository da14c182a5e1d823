#!/usr/bin/python3
"""The units of config/systemd: systemd accepts them and rates their exposure, and the servers report to it."""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import server  # noqa: E402
from support.servers import SessionServer, main, program  # noqa: E402

UNITS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "config", "systemd")
# The highest exposure that systemd may find, in tenths: for the session server, and for the simulation server, which runs programs of
# others on a display, in sandboxes that need namespaces, a /proc of their own and openat2 (0.2 of it: RestrictSUIDSGID= takes that away),
# and in control groups that it makes (0.2).
EXPOSURE = {"webots-session-server": 15, "webots-simulation-server": 37}


class Units(unittest.TestCase):
    def setUp(self):
        if not shutil.which("systemd-analyze"):
            self.skipTest("systemd-analyze is missing (package systemd)")
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_units_")
        self.addCleanup(shutil.rmtree, self.folder)

    def unit(self, name):
        """The unit as it is installed, except for the path of the program and the user, which do not exist here."""
        with open(os.path.join(UNITS, f"{name}.service")) as file:
            text = file.read()
        self.assertIn(f"ExecStart=/usr/local/bin/{name} ", text)
        path = os.path.join(self.folder, f"{name}.service")
        with open(path, "w") as file:
            file.write(text.replace(f"/usr/local/bin/{name}", program(name)).replace("User=webots-cloud", "User=daemon"))
        return path

    def analyze(self, *arguments):
        return subprocess.run(["systemd-analyze", *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60)

    def test_systemd_accepts_them(self):
        for name in EXPOSURE:
            with self.subTest(name):
                finished = self.analyze("verify", "--man=no", "--recursive-errors=no", self.unit(name))
                self.assertEqual(finished.returncode, 0, finished.stdout)
                self.assertNotIn(f"{name}.service:", finished.stdout)

    def test_systemd_finds_them_hardened(self):
        for name, most in EXPOSURE.items():
            with self.subTest(name):
                finished = self.analyze("security", "--offline=yes", f"--threshold={most}", "--no-pager", self.unit(name))
                if "unrecognized option" in finished.stdout:
                    self.skipTest("this systemd can't judge units offline")
                self.assertEqual(finished.returncode, 0, finished.stdout)


    def test_sandboxes_have_the_call_that_they_mount_by(self):
        """bubblewrap 0.12 makes none without openat2. Who could set the user id of a program instead must not get at it."""
        with open(self.unit("webots-simulation-server")) as file:
            lines = file.read().splitlines()
        self.assertFalse([line for line in lines if line.startswith("RestrictSUIDSGID=")])
        for kept in ("StateDirectoryMode=0750", "CacheDirectoryMode=0750", "RuntimeDirectoryMode=0700", "NoNewPrivileges=yes"):
            self.assertIn(kept, lines)


class Reports(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_notify_")
        self.addCleanup(shutil.rmtree, self.folder)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.addCleanup(self.socket.close)
        self.socket.settimeout(30)

    def environment(self, **more):
        return {"NOTIFY_SOCKET": self.address, **more}

    def listen(self, abstract=False):
        self.address = "@" + self.folder if abstract else os.path.join(self.folder, "notify")
        self.socket.bind("\0" + self.folder if abstract else self.address)

    def hear(self):
        return self.socket.recv(1000).decode()

    def test_the_simulation_server_is_ready_alive_and_stopping(self):
        self.listen()
        with server(environment=self.environment(WATCHDOG_USEC="200000")) as simulation:
            self.assertEqual([self.hear() for _ in range(3)], ["READY=1", "WATCHDOG=1", "WATCHDOG=1"])
            simulation.stop()
            self.assertLessEqual(set(iter(self.hear, "STOPPING=1")), {"WATCHDOG=1"})

    def test_the_session_server_is_ready_and_stopping_on_an_abstract_socket(self):
        self.listen(abstract=True)
        with SessionServer(["localhost:1"], environment=self.environment()) as session:
            self.assertEqual(self.hear(), "READY=1")
            session.stop()
            self.assertEqual(self.hear(), "STOPPING=1")

    def test_a_watchdog_that_is_meant_for_another_process_is_left_alone(self):
        self.listen()
        with server(environment=self.environment(WATCHDOG_USEC="1000", WATCHDOG_PID="1")) as simulation:
            self.assertEqual(self.hear(), "READY=1")
            simulation.stop()
            self.assertEqual(self.hear(), "STOPPING=1")

    def test_a_manager_that_is_gone_troubles_nobody(self):
        self.address = os.path.join(self.folder, "nobody")
        with server(environment=self.environment(WATCHDOG_USEC="20000")) as simulation:
            self.assertEqual(simulation.stop(), 0)


if __name__ == "__main__":
    main()
