#!/usr/bin/python3
"""A virtual display for each simulation, which nobody else sees: docs/sandboxes.md. With the real Xvfb."""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.other_user import NOBODY, WITHOUT_NAMESPACES, may_make_namespaces, works  # noqa: E402
from support.servers import is_alive, main, program, wait_until  # noqa: E402
from support.x_display import X_DISPLAY  # noqa: E402

XVFB = shutil.which("Xvfb")

# Says in a line of JSON what it sees of displays.
LOOK = X_DISPLAY + r'''
import json, sys
def attempt(address, key):
    try:
        return enter_display(address, key)
    except OSError:
        return None
address, key = own_display()
file = os.stat(os.environ["XAUTHORITY"])
said = {"enters": attempt(address, key), "without key": attempt(address, b""), "wrong key": attempt(address, bytes(16)),
        "abstract": attempt("\0" + address, key), "sockets": [each for each in os.listdir("/tmp/.X11-unix") if each.startswith("X")],
        "socket": os.path.basename(address), "key": key.hex(), "mode": oct(file.st_mode), "number": os.getpid(),
        "wayland": "WAYLAND_DISPLAY" in os.environ}
print(json.dumps(said), flush=True)
'''
KILL_XVFB = r'''
import os, signal, sys
for each in filter(str.isdigit, os.listdir("/proc")):
    with open("/proc/" + each + "/cmdline") as line:
        if line.read().split("\0")[0].endswith("Xvfb"):
            os.kill(int(each), signal.SIGKILL)
signal.pause()
'''


def running_servers(mark):
    """The living X servers that were started by this name."""
    found = []
    for entry in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{entry}/cmdline") as line:
                if line.read().split("\0")[0] == mark and is_alive(int(entry)):
                    found.append(int(entry))
        except OSError:
            pass
    return found


class Guard(unittest.TestCase):
    """webots-process-guard alone."""

    user = None

    @classmethod
    def setUpClass(cls):
        if not XVFB:
            raise unittest.SkipTest("Xvfb is not installed (package xvfb)")
        if not may_make_namespaces(cls.user):
            raise unittest.SkipTest("namespaces are not allowed")
        cls.folder = tempfile.mkdtemp(prefix="webots_cloud_display_")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        os.chmod(cls.folder, 0o755)
        cls.guard = shutil.copy(program("webots-process-guard"), cls.folder)  # where everybody may reach it
        cls.xvfb = os.path.join(cls.folder, "Xvfb")  # by a name of its own, so that it is found again
        os.symlink(XVFB, cls.xvfb)

    def server(self, script):
        """A program in place of Xvfb."""
        path = os.path.join(self.folder, f"{self.id()}.sh")
        with open(path, "w") as file:
            file.write("#!/bin/sh\n" + script)
        os.chmod(path, 0o755)
        return path

    def start(self, *argv, server=None, limit=20_000, options=("--own-displays",), wrapper=(), environment=None):
        started = subprocess.Popen([*wrapper, self.guard, *options, "200", self.guard, "--display", server or self.xvfb, str(limit), *argv],
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, user=self.user,
                                   group=self.user, extra_groups=self.user and [], env={**os.environ, **(environment or {})})
        self.addCleanup(self.end, started)
        return started

    @staticmethod
    def end(started):
        for pipe in (started.stdin, started.stdout):
            pipe.close()
        started.wait(30)

    def outcome(self, *argv, **how):
        """What was printed, and the exit status."""
        started = self.start(*argv, **how)
        printed = started.stdout.read()
        return printed, started.wait(30)

    def test_a_program_has_a_display_that_needs_its_password(self):
        started = self.start(sys.executable, "-c", LOOK, environment={"WAYLAND_DISPLAY": "wayland-0"})
        said = json.loads(started.stdout.readline())
        self.assertTrue(said["enters"])
        self.assertFalse(said["without key"])
        self.assertFalse(said["wrong key"])
        self.assertEqual(said["mode"], "0o100600")
        self.assertFalse(said["wayland"])

    def test_of_two_programs_each_has_a_display_and_sees_no_other(self):
        wait = LOOK + "sys.stdin = None\nimport signal; signal.pause()\n"
        first, second = (self.start(sys.executable, "-c", wait) for _ in range(2))
        one, other = (json.loads(each.stdout.readline()) for each in (first, second))
        for said in (one, other):
            self.assertTrue(said["enters"])
            self.assertEqual(said["sockets"], [said["socket"]])
            self.assertIsNone(said["abstract"])
            self.assertFalse(os.path.exists(f"/tmp/.X11-unix/{said['socket']}"))
        self.assertNotEqual(one["key"], other["key"])
        self.assertNotEqual(one["socket"], other["socket"])  # files in /tmp are named after the number

    def test_a_program_runs_as_it_would_without(self):
        started = self.start(sys.executable, "-c", LOOK + "sys.exit(7)")
        self.assertEqual(json.loads(started.stdout.readline())["number"], started.pid)
        self.assertEqual(started.wait(30), 7)
        self.assertEqual(running_servers(self.xvfb), [])

    def test_the_end_of_the_guard_is_the_end_of_the_display(self):
        started = self.start("/bin/sh", "-c", "echo ready; exec sleep 600")
        self.assertEqual(started.stdout.readline(), "ready\n")
        self.assertEqual(len(running_servers(self.xvfb)), 1)
        started.send_signal(signal.SIGKILL)
        wait_until(lambda: not running_servers(self.xvfb), "Xvfb is left")

    def test_the_end_of_the_display_is_the_end_of_the_program(self):
        printed, status = self.outcome(sys.executable, "-c", KILL_XVFB)
        self.assertTrue(printed.startswith("display has ended: "), printed)
        self.assertEqual(status, -signal.SIGKILL)

    def test_a_display_that_does_not_start_says_why(self):
        server = self.server("echo '(EE) Fatal server error: no memory left' >&2\necho '(EE) ' >&2\nexit 1\n")
        printed, status = self.outcome("/bin/echo", "runs", server=server)
        self.assertEqual(printed, "can't start a display for the simulation: (EE) Fatal server error: no memory left\n")
        self.assertEqual(status, 1)

    def test_a_display_that_is_not_there_says_so(self):
        printed, status = self.outcome("/bin/echo", "runs", server="/nowhere/Xvfb")
        self.assertIn("can't run /nowhere/Xvfb: No such file or directory", printed)
        self.assertEqual(status, 1)

    def test_a_display_that_does_not_get_ready_says_so(self):
        printed, status = self.outcome("/bin/echo", "runs", server=self.server("exec sleep 600\n"), limit=50)
        self.assertEqual(printed, "can't start a display for the simulation: it does not get ready\n")
        self.assertEqual(status, 1)

    def test_no_program_runs_beside_the_displays_of_others(self):
        if not works(WITHOUT_NAMESPACES):
            self.skipTest("a user namespace of our own is not allowed")
        printed, status = self.outcome("/bin/echo", "runs", wrapper=WITHOUT_NAMESPACES)
        self.assertIn("with displays of its own", printed)
        self.assertEqual(status, 127)


class GuardOfAnotherUser(Guard):
    user = NOBODY

    @classmethod
    def setUpClass(cls):
        if os.geteuid() != 0:
            raise unittest.SkipTest("only root can become another user")
        super().setUpClass()


if __name__ == "__main__":
    main()
