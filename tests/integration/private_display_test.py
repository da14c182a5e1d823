#!/usr/bin/python3
"""A virtual display for each simulation, which nobody else sees: docs/sandboxes.md. With the real Xvfb."""

import asyncio
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser  # noqa: E402
from support.firejail import require_firejail  # noqa: E402
from support.other_user import NOBODY, WITHOUT_NAMESPACES, OwnedServer, may_make_namespaces, works  # noqa: E402
from support.refusals import error_line  # noqa: E402
from support.servers import is_alive, is_sanitized, main, program, wait_until  # noqa: E402
from support.x_display import X_DISPLAY  # noqa: E402

XVFB = shutil.which("Xvfb")
LOOKER = "local:/projects/looker/blob/main/worlds/looker.wbt"
WORLD = """#VRML_SIM R2025a utf8
WorldInfo { }
RectangleArena { }
Robot { name "looker" controller "look" }
"""

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
KILL_XVFB = X_DISPLAY + r'''
import os, signal, sys
enter_display(*own_display())  # so it is there
print("half a line", end="", flush=True)
for each in filter(str.isdigit, os.listdir("/proc")):
    with open("/proc/" + each + "/cmdline") as line:
        if line.read().split("\0")[0].endswith("Xvfb"):
            os.kill(int(each), signal.SIGKILL)
signal.pause()
'''

# The first line of a script in place of an X server that is built with systemd's library, as its file shows.
TAKES_SOCKETS = "# sd_listen_fds\n"
CONNECT = r'''
import os, socket
display = socket.socket(socket.AF_UNIX)
display.connect("/tmp/.X11-unix/X" + os.environ["DISPLAY"][1:])
'''
# What such a server does with the socket, but for X.
ANSWER = ("import os, signal, socket; assert os.environ['LISTEN_FDS'] == '1' and os.environ['LISTEN_PID'] == str(os.getpid());"
          "client, _ = socket.socket(fileno=3).accept(); client.sendall(b'answered'); signal.pause()")


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

    def start_plain(self, *argv):
        """Without a display."""
        started = subprocess.Popen([self.guard, "--own-displays", "200", *argv], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                                   user=self.user, group=self.user, extra_groups=self.user and [])
        self.addCleanup(self.end, started)
        return started

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

    def test_the_end_of_the_program_is_the_end_of_the_display(self):
        """Also where no namespace ends: here the display is started beside the program that waits for it."""
        script = f'"{self.guard}" --display "{self.xvfb}" 20000 /bin/true; echo done; exec sleep 600'
        started = self.start_plain("/bin/sh", "-c", script)
        self.assertEqual(started.stdout.readline(), "done\n")
        wait_until(lambda: not running_servers(self.xvfb), "Xvfb is left")

    def test_the_end_of_the_guard_is_the_end_of_the_display(self):
        started = self.start("/bin/sh", "-c", "echo ready; exec sleep 600")
        self.assertEqual(started.stdout.readline(), "ready\n")
        wait_until(lambda: running_servers(self.xvfb), "there is no Xvfb")
        self.assertEqual(len(running_servers(self.xvfb)), 1)
        started.send_signal(signal.SIGKILL)
        wait_until(lambda: not running_servers(self.xvfb), "Xvfb is left")

    def test_the_end_of_the_display_is_the_end_of_the_program(self):
        printed, status = self.outcome(sys.executable, "-c", KILL_XVFB)
        self.assertTrue(printed.startswith("half a line\ndisplay has ended: "), printed)
        self.assertEqual(status, -signal.SIGKILL)

    def test_a_display_that_does_not_start_says_why(self):
        server = self.server("echo '(EE) Fatal server error: no memory left' >&2\necho '(EE) ' >&2\nexit 1\n")
        printed, status = self.outcome("/bin/echo", "runs", server=server)
        self.assertEqual(printed, "can't start a display for the simulation: (EE) Fatal server error: no memory left\n")
        self.assertEqual(status, 1)

    def test_a_program_does_not_wait_for_a_display_that_takes_over_a_socket(self):
        """Its connections do, in that socket. What the display never does here: get ready."""
        server = self.server(f"{TAKES_SOCKETS}exec sleep 600\n")
        printed, status = self.outcome(sys.executable, "-c", CONNECT + "print('connected')", server=server)
        self.assertEqual(printed, "connected\n")
        self.assertEqual(status, 0)

    def test_a_display_gets_the_socket_that_the_program_has_connected_to(self):
        server = self.server(f'{TAKES_SOCKETS}exec {sys.executable} -c "{ANSWER}"\n')
        printed, status = self.outcome(sys.executable, "-c", CONNECT + "print(display.recv(100).decode(), flush=True)", server=server)
        self.assertEqual(printed, "answered\n")
        self.assertEqual(status, 0)

    def test_a_program_that_waits_for_a_display_that_fails_is_ended_and_it_is_said_why(self):
        """It is not left to the program to say that it can't connect."""
        server = self.server(f"{TAKES_SOCKETS}read line < {self.folder}/go\necho '(EE) no memory left' >&2\nexit 1\n")
        go = os.path.join(self.folder, "go")
        os.mkfifo(go)
        os.chmod(go, 0o666)
        self.addCleanup(os.remove, go)
        started = self.start(sys.executable, "-c", CONNECT + "print('connected', flush=True); print(display.recv(100))", server=server)
        self.assertEqual(started.stdout.readline(), "connected\n")
        with open(go, "w"):
            pass
        self.assertEqual(started.stdout.read(), "\ndisplay has ended: (EE) no memory left\n")
        self.assertEqual(started.wait(30), -signal.SIGKILL)

    def test_a_display_is_tried_without_a_program(self):
        self.assertEqual(self.outcome(), ("", 0))
        printed, status = self.outcome(server=self.server(f"{TAKES_SOCKETS}echo '(EE) no memory left' >&2\nexit 1\n"))
        self.assertEqual(printed, "can't start a display for the simulation: (EE) no memory left\n")
        self.assertEqual(status, 1)

    def test_a_display_that_is_not_there_says_so(self):
        printed, status = self.outcome("/bin/echo", "runs", server="/nowhere/Xvfb")
        self.assertIn("can't run /nowhere/Xvfb: No such file or directory", printed)
        self.assertEqual(status, 1)

    def test_what_a_display_has_started_is_not_waited_for(self):
        printed, status = self.outcome("/bin/echo", "runs", server=self.server("sleep 600 &\necho '(EE) no memory left'\nexit 1\n"), limit=500)
        self.assertEqual(status, 1)
        self.assertIn("can't start a display for the simulation: ", printed)

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


# A controller that looks at displays: its own, and that of its neighbour, of which it has been told all.
LOOKING_CONTROLLER = "#!/usr/bin/python3\n" + X_DISPLAY + r'''
import json, signal
def attempt(address, key):
    try:
        return enter_display(address, key)
    except OSError:
        return None
said = {"display": os.environ.get("DISPLAY"), "wayland": os.environ.get("WAYLAND_DISPLAY")}
if os.path.isdir("/tmp/.X11-unix"):
    said["sockets"] = [each for each in os.listdir("/tmp/.X11-unix") if each.startswith("X")]
if "XAUTHORITY" in os.environ:
    address, key = own_display()
    said.update(address=address, key=key.hex(), enters=attempt(address, key))
if os.path.exists("neighbour"):
    with open("neighbour") as file:
        neighbour = json.load(file)
    address, key = neighbour["address"], bytes.fromhex(neighbour["key"])
    there = [each + "/root" + address for each in map("/proc/".__add__, filter(str.isdigit, os.listdir("/proc")))]
    said["neighbour"] = [each for each in [address, "\0" + address, *there] if attempt(each, key)]
with open("said.new", "w") as file:
    json.dump(said, file)
os.rename("said.new", "said")
signal.pause()
'''


class Simulations(unittest.IsolatedAsyncioTestCase):
    """Simulations on displays of their own, without a sandbox."""

    keys = {"sandbox": "none"}
    user = None

    @classmethod
    def setUpClass(cls):
        if not XVFB:
            raise unittest.SkipTest("Xvfb is not installed (package xvfb)")
        if cls.keys["sandbox"] != "none" and not shutil.which(cls.keys["sandbox"].replace("bubblewrap", "bwrap")):
            raise unittest.SkipTest(f"{cls.keys['sandbox']} is not installed")
        if not may_make_namespaces(cls.user):
            raise unittest.SkipTest("namespaces are not allowed")

    def server(self, **keys):
        server = OwnedServer(self.user, **{"display": "private", **self.keys, **keys})
        self.addCleanup(server.close)
        self.folder = os.path.join(server.folder, "projects")
        self.put("looker/worlds/looker.wbt", WORLD)
        os.chmod(self.put("looker/controllers/look/look", LOOKING_CONTROLLER), 0o755)
        server.config.update(forges=[{"url": "local:", "directory": self.folder}], allowedRepositories=["local:/projects"])
        return server

    def put(self, path, text):
        path = os.path.join(self.folder, "projects", path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w") as file:
            file.write(text)
        return path

    async def look(self, server, browser, instance):
        """What the controller of a simulation says."""
        await browser.start(LOOKER)
        await browser.hear("webots:")
        said = os.path.join(server.instances_folder(), str(instance), "controllers/look/said")
        wait_until(lambda: os.path.exists(said), lambda: f"it does not look:\n{server.log()}")
        with open(said) as file:
            return json.load(file)

    @staticmethod
    def displays(server):
        """The X servers below the server."""
        return [each for each in server.simulators() if b"Xvfb" in Simulations.program_of(each)]

    @staticmethod
    def program_of(process):
        try:
            with open(f"/proc/{process}/cmdline", "rb") as line:
                return line.read().split(b"\0")[0]
        except OSError:
            return b""

    async def test_each_has_a_display_which_its_neighbour_can_not_enter(self):
        server = self.server()
        server.start()
        async with Browser(server) as browser, Browser(server) as other:
            first = await self.look(server, browser, 1)
            self.put("looker/controllers/look/neighbour", json.dumps(first))
            second = await self.look(server, other, 2)
            for said in (first, second):
                self.assertTrue(said["enters"])
                self.assertEqual(said["sockets"], [os.path.basename(said["address"])])
                self.assertIsNone(said["wayland"])
            self.assertNotEqual(first["key"], second["key"])
            self.assertEqual(second["neighbour"], [])
            self.assertEqual(len(self.displays(server)), 2)
            self.assertIn('"display":"private (Xvfb)"', server.get("/monitor"))
        server.wait_until_clean()
        self.assertRegex(server.log(), r"INFO.*Each simulation has a virtual display of its own")

    async def test_displays_end_with_a_server_that_is_killed(self):
        server = self.server()
        server.start()
        async with Browser(server) as browser:
            await self.look(server, browser, 1)
            displays = self.displays(server)
            self.assertEqual(len(displays), 1)
            server.stop(signal.SIGKILL)
            wait_until(lambda: not any(map(is_alive, displays)), "Xvfb is left")

    async def test_the_browser_is_told_that_its_display_has_ended(self):
        server = self.server()
        server.start()
        async with Browser(server) as browser, Browser(server) as other:
            await self.look(server, browser, 1)
            display, = self.displays(server)
            await self.look(server, other, 2)
            os.kill(display, signal.SIGKILL)
            self.assertEqual(await browser.hear("loading: Error:"), error_line("display_ended"))
            await asyncio.wait_for(browser.hear_all(), 30)
            self.assertEqual(len(self.displays(server)), 1)  # the neighbour's


class SimulationsOfAnotherUser(Simulations):
    user = NOBODY
    test_the_browser_is_told_that_its_display_has_ended = None

    @classmethod
    def setUpClass(cls):
        if os.geteuid() != 0:
            raise unittest.SkipTest("only root can become another user")
        super().setUpClass()


class SimulationsInBubblewrap(Simulations):
    keys = {"sandbox": "bubblewrap", "network": "none"}


class SimulationsInFirejail(Simulations):
    keys = {"sandbox": "firejail", "network": "none"}
    test_displays_end_with_a_server_that_is_killed = None

    @classmethod
    def setUpClass(cls):
        require_firejail()
        if is_sanitized("webots-simulation-server"):
            raise unittest.SkipTest("what looks for leaks traces its process, which firejail forbids")
        super().setUpClass()

    async def test_a_simulator_that_quits_is_not_outlived_by_its_display(self):
        server = self.server()
        server.environment["WEBOTS_DEMO_FAULTS"] = "exit-after-ready=200"
        server.start()
        async with Browser(server) as browser:
            await browser.start(LOOKER)
            self.assertEqual(await browser.hear("loading: Error:"), error_line("quit"))
        server.wait_until_clean()


class SimulationsInBubblewrapOnTheNetwork(Simulations):
    """Where all abstract sockets of the machine are reached."""

    keys = {"sandbox": "bubblewrap", "network": "host"}
    test_displays_end_with_a_server_that_is_killed = None
    test_the_browser_is_told_that_its_display_has_ended = None


class Choice(Simulations):
    """What the key says, and what happens without it."""

    def programs(self, server, script=None):
        """The server's PATH, without Xvfb, or with a program of that name."""
        folder = os.path.join(server.folder, "bin")
        os.makedirs(folder, exist_ok=True)
        if script:
            path = os.path.join(folder, "Xvfb")
            with open(path, "w") as file:
                file.write("#!/bin/sh\n" + script)
            os.chmod(path, 0o755)
        server.environment["PATH"] = folder

    def refusal(self, server):
        with self.assertRaises(AssertionError) as refused:
            server.start()
        return str(refused.exception)

    async def look_once(self, server):
        server.start()
        async with Browser(server) as browser:
            said = await self.look(server, browser, 1)
        server.wait_until_clean()
        return said

    def test_a_private_display_needs_xvfb(self):
        server = self.server()
        self.programs(server)
        self.assertIn('"display": "private" does not work here: Xvfb is not installed', self.refusal(server))

    def test_a_private_display_is_tried_at_the_start(self):
        server = self.server()
        self.programs(server, "echo '(EE) no memory left'; exit 1")
        self.assertIn("does not work here: can't start a display for the simulation: (EE) no memory left", self.refusal(server))

    async def test_a_display_that_does_not_start_is_a_sentence_for_the_browser(self):
        server = self.server()
        self.programs(server, f"[ ! -e {server.folder}/broken ] || {{ echo '(EE) no memory left'; exit 1; }}\nexec {XVFB} \"$@\"")
        server.start()
        with open(f"{server.folder}/broken", "w"):
            pass
        async with Browser(server) as browser:
            await browser.start(LOOKER)
            self.assertEqual(await browser.hear("loading: Error:"), 
                             error_line("ended_early_saying", how="it exited with status 1", words="can't start a display for the simulation: (EE) no memory left"))
        server.wait_until_clean()

    async def test_without_a_display_there_is_none(self):
        said = await self.look_once(self.server(display="none"))
        self.assertIsNone(said["display"])

    async def test_without_the_key_the_environment_counts(self):
        server = self.server(display="")
        server.environment["DISPLAY"] = ":7"
        self.assertEqual((await self.look_once(server))["display"], ":7")
        self.assertIn(":7, shared by all", server.get("/monitor"))

    async def test_without_key_and_screen_each_has_a_display_of_its_own(self):
        if os.path.exists("/tmp/.X11-unix/X0"):
            self.skipTest("this machine has an X server")
        server = self.server(display="")
        server.environment["DISPLAY"] = ""
        self.assertTrue((await self.look_once(server))["enters"])

    async def test_where_there_is_no_other_it_is_the_usual_one(self):
        server = self.server(display="")
        self.programs(server, "echo '(EE) no memory left'; exit 1")
        server.environment["DISPLAY"] = ""
        if os.path.exists("/tmp/.X11-unix/X0"):
            self.skipTest("this machine has an X server")
        self.assertEqual((await self.look_once(server))["display"], ":0")
        self.assertRegex(server.log(), r"WARNING.*There is no display, and simulations can't have virtual ones of their own: .*no memory left")

    test_each_has_a_display_which_its_neighbour_can_not_enter = None
    test_displays_end_with_a_server_that_is_killed = None
    test_the_browser_is_told_that_its_display_has_ended = None


if __name__ == "__main__":
    main()
