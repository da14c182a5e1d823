#!/usr/bin/python3
"""What a hostile simulator can do to its server, its guard and the cache: as root, as another user, and where no namespaces are allowed."""

import json
import os
import signal
import stat
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser  # noqa: E402
from support.other_user import NOBODY, WITHOUT_NAMESPACES, WITH_HIDDEN_PROCESSES, OwnedServer, may_make_namespaces, works  # noqa: E402
from support.servers import is_alive, main, wait_until  # noqa: E402

# Opens what it can of its guard and its server, tries to read their memory, to kill them and to write where it should not, prints what
# succeeded, and keeps running.
ATTACKER = r'''#!/usr/bin/python3
import ctypes, json, os, signal
folder = os.environ["WEBOTS_ATTACK"]
with open(folder + "/server.pid") as file:
    server = int(file.read())
libc = ctypes.CDLL(None, use_errno=True)
held, read, seen = [], 0, 0
def command(pid):
    try:
        with open(f"/proc/{pid}/cmdline", "rb") as file:
            return file.read()
    except OSError:
        return b""
victims = {server} | {int(pid) for pid in os.listdir("/proc") if pid.isdigit() and
                      (b"webots-process-guard" in command(pid) or b"webots-simulation-server" in command(pid))}
for victim in sorted(victims):
    seen += victim in (server, os.getppid()) and bool(command(victim))
    try:
        with open(f"/proc/{victim}/mem", "rb"), open(f"/proc/{victim}/environ", "rb") as file:
            read += len(file.read()) > 0
    except OSError:
        pass
    for number in range(64):
        for flags in (os.O_RDWR, os.O_WRONLY, os.O_RDONLY):
            try:
                held.append(os.open(f"/proc/{victim}/fd/{number}", flags | os.O_NONBLOCK))
            except OSError:
                pass
    try:
        process = os.pidfd_open(victim)
    except OSError:
        continue
    for number in range(64):
        copy = libc.syscall(438, process, number, 0)
        if copy >= 0:
            held.append(copy)
def attempt(action, *arguments):
    try:
        action(*arguments)
        return "done"
    except OSError as error:
        return type(error).__name__ + " " + str(error.errno)
def write(path):
    with open(path, "a") as file:
        file.write("x")
said = {"held": len(held), "read": read, "seen": seen, "server": attempt(os.kill, server, 0), "trace": libc.ptrace(16, server, 0, 0),
        "guard": attempt(os.kill, os.getppid(), 0) if os.getppid() > 1 else "ProcessLookupError 3",
        "cache": attempt(write, folder + "/cache/webots_cloud/2000/file"), "log": attempt(write, folder + "/log/simulation/monitor.csv")}
with open(folder + "/attack/said.new", "w") as file:
    json.dump(said, file)
os.rename(folder + "/attack/said.new", folder + "/attack/said")
while True:
    signal.pause()
'''


class Hostile(unittest.IsolatedAsyncioTestCase):
    user = None
    wrapper = ()

    @classmethod
    def setUpClass(cls):
        if cls.user is not None and os.geteuid() != 0:
            raise unittest.SkipTest("the tests run without privileges anyway")
        if cls.wrapper and not works(cls.wrapper):
            raise unittest.SkipTest("user namespaces, with which this is arranged, are not allowed here")

    def setUp(self):
        self.server = OwnedServer(self.user, self.wrapper)
        folder = self.server.folder
        for name in ("attack", "webots", "cache/webots_cloud/2000", "log/simulation"):
            os.makedirs(os.path.join(folder, name))
        with open(os.path.join(folder, "cache/webots_cloud/2000/file"), "w") as file:
            file.write("fetched")
        webots = os.path.join(folder, "webots", "webots")
        with open(webots, "w") as file:
            file.write(ATTACKER)
        os.chmod(webots, 0o755)
        os.chmod(folder, os.stat(folder).st_mode | stat.S_IXOTH)
        self.server.config["webotsHome"] = os.path.join(folder, "webots")
        self.server.environment["WEBOTS_ATTACK"] = folder
        self.addCleanup(self.server.close)
        self.server.start()
        with open(os.path.join(folder, "server.pid"), "w") as file:
            file.write(str(self.server.process.pid))

    async def attack(self, browser):
        """The simulator's report of its attack."""
        await browser.start()
        said = os.path.join(self.server.folder, "attack", "said")
        wait_until(lambda: os.path.exists(said), lambda: f"it does not attack:\n{self.server.log()}")
        with open(said) as file:
            return json.load(file)

    @staticmethod
    def kill(processes):
        for process in processes:
            if is_alive(process):
                os.kill(process, signal.SIGKILL)

    def warning(self):
        """The server's warnings about missing isolation."""
        return self.server.ask("/readyz")[1].removeprefix("ready").removeprefix(", but: ")

    async def test_nothing_outlives_a_server_that_is_killed_whatever_a_simulator_holds_open(self):
        async with Browser(self.server) as browser:
            await self.attack(browser)
            processes = self.server.simulators()
            self.assertGreaterEqual(len(processes), 2)
            self.addCleanup(self.kill, processes)
            self.server.stop(signal.SIGKILL)
            wait_until(lambda: not [pid for pid in processes if is_alive(pid)], "they live on")

    async def test_a_simulator_gets_nothing_of_its_server_and_its_guard(self):
        async with Browser(self.server) as browser:
            said = await self.attack(browser)
        self.assertEqual((said["held"], said["read"], said["trace"]), (0, 0, -1), said)

    async def test_a_simulator_can_not_signal_its_server_and_its_guard(self):
        if "are not kept apart" in self.warning():
            self.skipTest("this kernel has neither namespaces nor Landlock for it")
        async with Browser(self.server) as browser:
            said = await self.attack(browser)
        self.assertIn(said["server"], ("ProcessLookupError 3", "PermissionError 1"))
        self.assertIn(said["guard"], ("ProcessLookupError 3", "PermissionError 1"))

    async def test_a_simulator_can_not_change_the_cache_and_the_logs(self):
        if self.warning() or "no mount namespace" in self.server.log():
            self.skipTest("no mount namespace may be made here")
        async with Browser(self.server) as browser:
            said = await self.attack(browser)
        self.assertEqual((said["cache"], said["log"]), ("OSError 30", "OSError 30"))

    def test_what_is_missing_is_said_where_operators_look(self):
        warning = self.warning()
        if not self.wrapper:  # or a server that has forgotten how to make a namespace would only be told about
            self.assertEqual(bool(warning), not may_make_namespaces(self.user), warning)
        self.assertEqual(self.server.ask("/readyz")[0], 200)
        self.assertEqual("Simulations are" in self.server.get("/monitor"), bool(warning))
        self.assertIn(f"webots_simulations_isolated {0 if warning else 1}\n", self.server.get("/metrics"))
        self.assertEqual("[WARNING]  Simulations are" in self.server.log(), bool(warning))
        if self.wrapper:
            self.assertIn("no PID namespace can be made (No space left on device)", warning)
            self.assertIn("docs/machine.md", warning)


class HostileToSomebodyElse(Hostile):
    user = NOBODY


class HostileWithoutNamespaces(Hostile):
    wrapper = WITHOUT_NAMESPACES


class HostileToSomebodyElseWithoutNamespaces(Hostile):
    user = NOBODY
    wrapper = WITHOUT_NAMESPACES


class HiddenProcesses(unittest.IsolatedAsyncioTestCase):
    async def test_simulations_are_found_where_proc_hides_processes_that_can_not_be_traced(self):
        if os.geteuid() != 0 or not works(WITH_HIDDEN_PROCESSES):
            self.skipTest("no /proc with hidepid may be mounted here")
        with OwnedServer(NOBODY, WITH_HIDDEN_PROCESSES, wrapper_drops_privileges=True) as server:
            async with Browser(server) as browser:
                await browser.start()
                await browser.hear("webots:")


if __name__ == "__main__":
    main()
