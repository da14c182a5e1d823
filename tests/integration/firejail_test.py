#!/usr/bin/python3
"""Simulations in firejail, apart from what every sandbox promises: its processes, its own files, and where it is refused.

firejail makes its own PID namespace and is a set-user-ID program, so the guard does less for it than for others, and only as root.
"""

import asyncio
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import WORLD, Browser  # noqa: E402
from support.firejail import require_firejail  # noqa: E402
from support.other_user import NOBODY, OwnedServer  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import descendants, is_alive, main, program, wait_until  # noqa: E402

FILES = "/run/firejail"
FLEE = "setsid sleep 612 & (setsid sleep 612 &) ; trap '' TERM; echo ready; sleep 612; sleep 612"


def named(process):
    """The program that a process runs."""
    try:
        with open(f"/proc/{process}/comm") as name:
            return name.read().strip()
    except OSError:
        return ""


def setUpModule():
    require_firejail()
    os.makedirs(FILES, exist_ok=True)


class Tree(unittest.TestCase):
    """The guard with firejail below it."""

    def start(self, script, options=("--own-sandbox", FILES), user=None):
        folder = tempfile.mkdtemp(prefix="webots_cloud_firejail_")
        self.addCleanup(shutil.rmtree, folder)
        os.chmod(folder, 0o755)
        guard = shutil.copy(program("webots-process-guard"), folder)
        started = subprocess.Popen([guard, *options, "200", shutil.which("firejail"), "--quiet", "--noprofile",
                                    "--deterministic-shutdown", "--deterministic-exit-code", "--", "/bin/sh", "-c", script],
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, user=user, group=user)
        self.addCleanup(started.wait, 30)
        self.addCleanup(started.stdin.close)
        self.addCleanup(started.stdout.close)
        return started

    def start_family(self, options=()):
        started = self.start(FLEE, (*options, "--own-sandbox", FILES))
        self.assertEqual(started.stdout.readline(), "ready\n")
        wait_until(lambda: len(self.sleepers(started)) >= 3, "the family is not complete")
        return started, descendants(started.pid)

    @staticmethod
    def sleepers(started):
        return [pid for pid in descendants(started.pid) if named(pid) == "sleep"]

    def test_nothing_outlives_the_server(self):
        started, family = self.start_family()
        started.stdin.close()
        started.wait(30)
        self.assertEqual([pid for pid in family if is_alive(pid)], [])

    def test_nothing_outlives_the_grace(self):
        started, family = self.start_family()
        started.stdin.write("T")
        started.stdin.flush()
        started.wait(30)
        self.assertEqual([pid for pid in family if is_alive(pid)], [])

    def test_nothing_outlives_a_killed_guard_not_even_its_relay(self):
        started, family = self.start_family(["--network", "none", str(free_port())])
        started.send_signal(signal.SIGKILL)
        started.wait(30)
        wait_until(lambda: not [pid for pid in family if is_alive(pid)], "some of it lives on")

    def test_nothing_outlives_the_program(self):
        self.assertEqual(self.start("setsid sleep 612 & exit 7").wait(30), 7)

    def test_its_status_is_the_programs(self):
        self.assertEqual(self.start("exit 7").wait(30), 7)

    def test_it_keeps_its_files_in_a_folder_of_its_own(self):
        before = sorted(os.listdir(FILES))
        started = self.start(f"echo x > {FILES}/planted && cat {FILES}/planted")
        self.assertEqual(started.stdout.read(), "x\n")  # whoever is root in there can
        self.assertEqual(sorted(os.listdir(FILES)), before)

    def test_without_root_it_is_not_started(self):
        started = self.start("echo it runs", user=NOBODY)
        self.assertRegex(started.stdout.read(), "^can't start .*firejail in a mount namespace of its own: ")
        self.assertEqual(started.wait(30), 127)

    def test_without_a_folder_for_its_files_it_is_not_started(self):
        started = self.start("echo it runs", ("--own-sandbox", "/nowhere"))
        self.assertRegex(started.stdout.read(), "^can't start ")


class Choice(unittest.TestCase):
    """Which sandbox the server takes, and what it says."""

    def server(self, **arguments):
        server = OwnedServer(**{"network": "none", **arguments})
        self.addCleanup(server.close)
        return server

    def test_auto_takes_firejail_where_there_is_no_bubblewrap_and_says_why(self):
        server = self.server(sandbox="auto")
        programs = os.path.join(server.folder, "programs")
        os.mkdir(programs)
        os.symlink(shutil.which("firejail"), os.path.join(programs, "firejail"))
        server.environment["PATH"] = programs
        server.start()
        self.assertIn("Simulations run in a sandbox: firejail, no network.", server.log())
        self.assertIn("bubblewrap is not installed", server.log())
        self.assertIn("firejail, no network", server.get("/monitor"))

    def test_each_simulation_has_a_display_of_its_own(self):
        if not shutil.which("Xvfb"):
            self.skipTest("Xvfb is not installed")
        server = self.server(sandbox="firejail", display="private")
        server.start()  # which tries a display in the sandbox
        self.assertIn("private (Xvfb)", server.get("/monitor"))

        async def start():
            async with Browser(server) as browser:
                await browser.start(WORLD)
                await browser.hear("webots:")
                displays = [pid for pid in server.simulators() if named(pid) == "Xvfb"]
                self.assertEqual(len(displays), 1)
        asyncio.run(start())
        server.wait_until_clean()

    def test_a_firejail_that_confines_nothing_is_not_taken(self):
        """In a PID namespace it takes itself to be in a sandbox already, and runs programs as they are."""
        server = self.server(sandbox="firejail")
        server.wrapper = ("unshare", "--pid", "--fork", "--kill-child", "--mount-proc")
        with self.assertRaisesRegex(AssertionError, '"firejail" does not work here: .*a simulation could .*read files of the server'):
            server.start()

    def test_auto_goes_on_without_it_and_names_both_reasons(self):
        server = self.server(sandbox="auto")
        server.wrapper = ("unshare", "--pid", "--fork", "--kill-child", "--mount-proc")
        programs = os.path.join(server.folder, "programs")
        os.mkdir(programs)
        for name in ("firejail", "unshare"):
            os.symlink(shutil.which(name), os.path.join(programs, name))
        server.environment["PATH"] = programs
        server.start()
        self.addCleanup(server.process.kill)  # unshare ignores SIGTERM
        self.assertRegex(server.log(), "without a sandbox.*bubblewrap: bubblewrap is not installed; firejail: .*a simulation could")

    def test_servers_of_others_than_root_are_told_to_take_bubblewrap(self):
        server = self.server(user=NOBODY, sandbox="firejail")
        with self.assertRaisesRegex(AssertionError, "only where the server runs as root; bubblewrap does not need that"):
            server.start()


if __name__ == "__main__":
    main()
