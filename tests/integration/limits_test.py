#!/usr/bin/python3
"""The limits of a simulation: controllers that take all the memory, fill the disk, start processes without end and open files without
end. Each of them is ended with a sentence to its own browser, or gets no further, while a neighbour's pictures keep coming. With
control groups, and where there are none.
"""

import asyncio
import glob
import json
import os
import shutil
import signal
import sys
import unittest
import urllib.parse

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser, websockets  # noqa: E402
from support.cgroup import DelegatedGroups  # noqa: E402
from support.firejail import require_firejail  # noqa: E402
from support.frames import Frames  # noqa: E402
from support.other_user import NOBODY, OwnedServer, as_nobody_with_numbers, require_subordinate_users, works  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.refusals import error_line  # noqa: E402
from support.servers import PATIENCE, is_sanitized, main, wait_until  # noqa: E402

NEIGHBOUR = "local:/projects/neighbour/blob/main/worlds/arena.wbt"
WORLD = """#VRML_SIM R2025a utf8
WorldInfo { }
RectangleArena { }
Robot { name "attacker" controller "attack" }
"""

# Each is bounded, should the limits not hold. What can't go on stays, with what it has.
ATTACKS = {
    "memory": r'''
taken = []
try:
    for _ in range(600):
        taken.append(b"x" * (16 << 20))
except MemoryError:
    pass
''',
    "files_in_memory": r'''
held = []
for _ in range(40):
    held.append(os.memfd_create("held"))
    os.write(held[-1], b"x" * (10 << 20))
''',
    "shared_pages": r'''
import mmap
held = mmap.mmap(-1, 400 << 20)
for i in range(0, len(held), 4096):
    held[i] = 1
''',
    "threads_alone": r'''
import ctypes, threading, time
first = threading.get_native_id()

def take():  # when the first thread has ended
    while " Z " not in open(f"/proc/self/task/{first}/stat").read():
        time.sleep(0.01)
    taken = []
    try:
        for _ in range(600):
            taken.append(b"x" * (16 << 20))
    except MemoryError:
        threading.Event().wait()

threading.Thread(target=take).start()
ctypes.CDLL(None).syscall(ctypes.c_long(60 if os.uname().machine == "x86_64" else 93), 0)
''',
    "processes": r'''
def start_all():  # in a thread, where children are harder to find
    for _ in range(300):
        try:
            if os.fork() == 0:
                os.execv("/bin/sleep", ["sleep", "600"])
        except OSError:
            break

import threading
threading.Thread(target=start_all).start()
''',
    "disk": r'''
for i in range(200):
    with open(f"filling{i}", "wb") as file:
        file.write(b"x" * (1 << 20))
''',
    "one_file": r'''
with open("filling", "wb") as file:
    for i in range(200):
        file.write(b"x" * (1 << 20))
        file.flush()
''',
    "files": r'''
opened = []
try:
    for _ in range(5000):
        opened.append(open("/dev/null"))
except OSError as error:
    count = len(opened)
    opened.clear()
    with open("said.new", "w") as file:
        file.write(f"{count} {error.strerror}")
    os.rename("said.new", "said")
''',
}
MEMORY_ATTACKS = ("memory", "files_in_memory", "shared_pages", "threads_alone")
# Of a sandbox, which has such a folder to itself.
SANDBOX_ATTACKS = {
    "private_folder": r'''
for i in range(40):
    with open(f"/tmp/filling{i}", "wb") as file:
        file.write(b"x" * (10 << 20))
''',
}
# Like a machine without control groups.
WITHOUT_GROUPS = ("unshare", "--mount", "sh", "-c", 'mount -t tmpfs -o ro none /sys/fs/cgroup && exec "$@"', "sh")
TOKEN = "a-token-of-the-operator"
MEMORY = 200
PROCESSES = 60
FILES = 100
DISK = 10
LIMITS = {"simulationMemory": MEMORY, "simulationProcesses": PROCESSES, "simulationFiles": FILES, "simulationDisk": DISK}


def groups_of(server):
    """Control groups that a server has made for simulations."""
    found = []
    for folder, names, _ in os.walk("/sys/fs/cgroup"):
        found += [os.path.join(folder, name) for name in names if name.startswith(f"webots_cloud-{server}-")]
    return found


def share_of(group):
    """Of processors, in a group that some process is in; None: it limits something else."""
    names = {"cpu.cfs_quota_us": "cpu.cfs_period_us", "cpu.max": None}
    for quota, period in names.items():
        if os.path.exists(os.path.join(group, quota)):
            numbers = " ".join(read(os.path.join(group, name)) for name in (quota, period) if name).split()
            assert read(os.path.join(group, "cgroup.procs")), "nothing is in it"
            return int(numbers[0]) / int(numbers[1])
    return None


def read(path):
    with open(path) as file:
        return file.read()


def may_make_groups():
    """Whether this machine has control groups that we may use; asked in the way of the server's start."""
    return bool(glob.glob("/sys/fs/cgroup/memory/cgroup.procs") + glob.glob("/sys/fs/cgroup/cgroup.subtree_control")) and \
        os.geteuid() == 0 and os.access("/sys/fs/cgroup", os.W_OK)


def place_projects(folder):
    """A project for each attack, and the neighbour's; returns the keys that let them run."""
    files = {os.path.join("neighbour", path): content for path, content in demo_project().items()}
    for name, attack in {**ATTACKS, **SANDBOX_ATTACKS}.items():
        files[f"{name}/worlds/hostile.wbt"] = WORLD.encode()
        files[f"{name}/controllers/attack/attack"] = f"#!/usr/bin/python3\nimport os, signal{attack}\nsignal.pause()\n".encode()
    for path, content in files.items():
        path = os.path.join(folder, "projects", path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(content)
        os.chmod(path, 0o755)
    return {"forges": [{"url": "local:", "directory": folder}], "allowedRepositories": ["local:/projects"]}


class LimitedServer(OwnedServer):
    """With a project for each attack."""

    def __init__(self, *arguments, **keys):
        super().__init__(*arguments, **{**LIMITS, **keys})
        self.config.update(place_projects(os.path.join(self.folder, "projects")))
        os.chmod(self.folder, 0o755)


class Limits:
    """Everything is tried at once, with one neighbour; each test looks at an outcome."""

    keys = {}
    user = None
    wrapper = ()
    drops_privileges = False  # by the wrapper
    enforced = "looked at every second"
    attacks = ATTACKS
    memory_attacks = MEMORY_ATTACKS

    @classmethod
    def setUpClass(cls):
        cls.check()
        cls.server = cls.make_server()
        cls.addClassCleanup(cls.server.close)
        cls.server.start()
        asyncio.run(cls.attack())

    @classmethod
    def make_server(cls):
        return LimitedServer(cls.user, cls.wrapper, cls.drops_privileges, **cls.keys)

    @classmethod
    def check(cls):
        if os.geteuid() != 0:
            raise unittest.SkipTest("other users and mount namespaces need root")

    @classmethod
    async def attack(cls):
        async with Browser(cls.server) as neighbour:
            await neighbour.start(NEIGHBOUR)
            address = urllib.parse.urlsplit((await neighbour.hear("webots:")).partition(":")[2])
            async with websockets.connect(address.geturl(), max_size=None) as viewer:
                await viewer.send("mjpeg: 320x240")
                await asyncio.wait_for(viewer.recv(), PATIENCE)
                await viewer.send("real-time:-1")
                frames = Frames(address.port, address.path.rstrip("/") + "/mjpeg")
                names = list(cls.attacks)
                cls.told = dict(zip(names, await asyncio.gather(*map(cls.overrun, names))))
                await asyncio.to_thread(frames.wait_for_next, "after the others have ended")
                frames.close()
            cls.neighbour_errors = [each for each in neighbour.told if "Error" in each]
            cls.figures = cls.server.get("/metrics")
            cls.rows = json.loads(cls.server.get("/monitor", {"Accept": "application/json"}))["simulations"]
            cls.groups = groups_of(cls.server.process.pid)
        cls.server.wait_until_clean()

    @classmethod
    async def overrun(cls, name):
        """What the browser of this project was told before it was sent away; of files, what the controller has said."""
        async with Browser(cls.server) as browser:
            await browser.start(f"local:/projects/{name}/blob/main/worlds/hostile.wbt")
            if name == "files":
                await browser.hear("webots:")
                return await asyncio.to_thread(cls.said)
            try:
                await asyncio.wait_for(browser.hear_all(), PATIENCE)
            except TimeoutError:
                return "It goes on."
            return browser.told[-1]

    @classmethod
    def said(cls):
        pattern = os.path.join(cls.server.instances_folder(), "*", "controllers", "attack", "said")
        path = wait_until(lambda: glob.glob(pattern), lambda: f"no limit of files:\n{cls.server.log()}")[0]
        with open(path) as file:
            return file.read()

    def test_the_browser_is_told_of_the_memory(self):
        for attack in self.memory_attacks:
            with self.subTest(attack):
                self.assertEqual(self.told[attack], error_line("memory_overrun", max=MEMORY))

    def test_the_browser_is_told_of_the_processes(self):
        self.assertEqual(self.told["processes"], error_line("process_overrun", max=PROCESSES))

    def test_the_browser_is_told_of_the_disk(self):
        for attack in ("disk", "one_file"):
            self.assertEqual(self.told[attack], error_line("disk_overrun", max=DISK))

    def test_no_process_has_more_files_than_it_may(self):
        opened, _, why = self.told["files"].partition(" ")
        self.assertLessEqual(int(opened), FILES)
        self.assertEqual(why, "Too many open files")

    def test_the_neighbour_notices_nothing(self):
        self.assertEqual(self.neighbour_errors, [])

    def test_the_monitor_shows_what_simulations_use(self):
        row = next(each for each in self.rows if "neighbour" in each["world"])
        self.assertGreater(row["memory"], 1)
        self.assertGreater(row["processes"], 0)

    def test_the_metrics_count_the_ended_and_sum_up_the_others(self):
        for limit, ended in (("memory", len(self.memory_attacks)), ("processes", 1), ("disk", 2)):
            self.assertIn(f'simulations_over_limit_total{{limit="{limit}"}} {ended}\n', self.figures)
        self.assertRegex(self.figures, r"simulations_memory_bytes [1-9]")
        self.assertRegex(self.figures, r"simulations_processes [1-9]")

    def test_the_log_says_who_keeps_the_limits(self):
        self.assertIn(f"The limits of each simulation: {MEMORY} MB of memory ({self.enforced}", self.server.log())


class InSandbox:
    """Comes before the class that says how the server runs."""

    sandbox = "bubblewrap"
    program = "bwrap"
    attacks = {**ATTACKS, **SANDBOX_ATTACKS}
    memory_attacks = (*MEMORY_ATTACKS, *SANDBOX_ATTACKS)

    @classmethod
    def check(cls):
        super().check()
        if not shutil.which(cls.program):
            raise unittest.SkipTest(f"{cls.sandbox} is not installed")


class WithGroups(Limits):
    enforced = "control groups, version "

    @classmethod
    def check(cls):
        if not may_make_groups():
            raise unittest.SkipTest("control groups can't be made here")

    def test_the_simulations_were_in_groups_which_are_gone_with_them(self):
        self.assertTrue(self.groups)
        wait_until(lambda: not groups_of(self.server.process.pid), lambda: f"groups are left: {groups_of(self.server.process.pid)}")


class ControlGroups(WithGroups, unittest.TestCase):
    keys = {"sandbox": "none"}


class ControlGroupsOfOtherUsers(WithGroups, unittest.TestCase):
    """Who may not write to the groups that they are put into."""

    keys = {"sandbox": "none", "simulationUser": "auto"}


class ControlGroupsWithBubblewrap(InSandbox, WithGroups, unittest.TestCase):
    keys = {"sandbox": "bubblewrap", "network": "none"}


class DelegatedControlGroups(WithGroups):
    """As systemd delegates them to the user of a service: who is not root makes groups in the server's own."""

    user = NOBODY

    @classmethod
    def check(cls):
        super().check()
        cls.delegated = cls.enterClassContext(DelegatedGroups(NOBODY))

    @classmethod
    def make_server(cls):
        return LimitedServer(NOBODY, cls.delegated.joining(*cls.change_user()), True, **cls.keys)

    @classmethod
    def change_user(cls):
        """The command line that the server's is put behind."""
        return ("setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups")


class ControlGroupsOfAnotherUser(DelegatedControlGroups, unittest.TestCase):
    keys = {"sandbox": "none"}


class ControlGroupsOfAnotherUserWithBubblewrap(InSandbox, DelegatedControlGroups, unittest.TestCase):
    keys = {"sandbox": "bubblewrap", "network": "none"}


class ControlGroupsOfSubordinateUsers(DelegatedControlGroups, unittest.TestCase):
    """Guards enter the groups of their simulations as the server's user, in a user namespace."""

    keys = {"sandbox": "none", "simulationUser": "subordinate", "display": "none"}

    @classmethod
    def check(cls):
        require_subordinate_users()
        super().check()

    @classmethod
    def change_user(cls):
        return as_nobody_with_numbers()


class WithoutGroups(Limits):
    @classmethod
    def check(cls):
        super().check()
        if is_sanitized("webots-simulation-server"):
            raise unittest.SkipTest("sanitizers reserve terabytes, which count as memory here")

    @classmethod
    def make_server(cls):
        server = super().make_server()
        server.config["operatorTokenFile"] = os.path.join(server.folder, "token")
        with open(server.config["operatorTokenFile"], "w") as file:
            file.write(f"{TOKEN}\n")
        os.chmod(file.name, 0o600)
        return server

    def test_the_doctor_warns_of_the_limits_that_are_not_kept(self):
        authorized = {"Authorization": f"Bearer {TOKEN}"}
        wait_until(lambda: json.loads(self.server.ask("/api/doctor", headers=authorized)[1])["examined"], "nobody has looked")
        findings = json.loads(self.server.ask("/api/doctor?last", headers=authorized)[1])["findings"]
        limits, = [each for each in findings if each["subject"] == "limits"]
        self.assertEqual(limits["verdict"], "warning")
        self.assertIn("memory and processes are looked at every second only", limits["found"])

    def test_log_and_monitor_say_which_limits_are_not_kept(self):
        warning = "memory and processes are looked at every second only"
        self.assertIn(warning, self.server.log())
        self.assertIn(warning, self.server.get("/monitor"))


class RootWithoutGroups(WithoutGroups, unittest.TestCase):
    wrapper = WITHOUT_GROUPS

    @classmethod
    def check(cls):
        super().check()
        if not works(WITHOUT_GROUPS):
            raise unittest.SkipTest("control groups can't be hidden here")


class RootWithoutGroupsWithBubblewrap(InSandbox, RootWithoutGroups):
    keys = {"sandbox": "bubblewrap", "network": "none"}


class RootWithoutGroupsWithFirejail(InSandbox, RootWithoutGroups):
    sandbox = program = "firejail"
    keys = {"sandbox": "firejail", "network": "none"}

    @classmethod
    def check(cls):
        require_firejail()
        super().check()


class AnotherUser(WithoutGroups, unittest.TestCase):
    """Who may make no groups."""

    user = NOBODY


class AnotherUserWithBubblewrap(InSandbox, AnotherUser):
    keys = {"sandbox": "bubblewrap", "network": "none"}


class SubordinateUsers(WithoutGroups, unittest.TestCase):
    """Whose files in memory the server does not see, unless they are mapped: docs/sandboxes.md says so, and so does the server."""

    keys = {"sandbox": "none", "simulationUser": "subordinate", "display": "none"}
    attacks = {name: attack for name, attack in ATTACKS.items() if name != "files_in_memory"}
    memory_attacks = tuple(name for name in MEMORY_ATTACKS if name != "files_in_memory")
    drops_privileges = True

    @classmethod
    def check(cls):
        require_subordinate_users()
        super().check()
        cls.user, cls.wrapper = NOBODY, as_nobody_with_numbers()

    def test_log_and_monitor_say_what_is_not_counted(self):
        for text in (self.server.log(), self.server.get("/monitor")):
            self.assertIn("files in memory without a name are counted as far as they are mapped only", text)


class Processors(unittest.TestCase):
    def test_a_simulation_gets_no_more_than_its_share(self):
        if not may_make_groups():
            self.skipTest("control groups can't be made here")
        server = LimitedServer(simulationCpus=0.5)
        self.addCleanup(server.close)
        server.start()

        async def shares():
            async with Browser(server) as browser:
                await browser.start(NEIGHBOUR)
                await browser.hear("webots:")
                return list(filter(None, map(share_of, groups_of(server.process.pid))))

        self.assertEqual(asyncio.run(shares()), [0.5])

    def test_where_that_can_not_be_kept_the_log_warns(self):
        if os.geteuid() != 0 or not works(WITHOUT_GROUPS):
            self.skipTest("control groups can't be hidden here")
        server = LimitedServer(None, WITHOUT_GROUPS, simulationCpus=0.5)
        self.addCleanup(server.close)
        server.start()
        self.assertIn('"simulationCpus" has no effect', server.log())


class KilledServer(unittest.TestCase):
    def test_its_groups_go_with_its_simulations(self):
        if not may_make_groups():
            self.skipTest("control groups can't be made here")
        server = LimitedServer()
        self.addCleanup(server.close)
        server.start()
        pid = server.process.pid

        async def start():
            async with Browser(server) as browser:
                await browser.start(NEIGHBOUR)
                await browser.hear("webots:")
                self.assertTrue(groups_of(pid))
                os.kill(pid, signal.SIGKILL)

        asyncio.run(start())
        server.process.wait()
        wait_until(lambda: not groups_of(pid), lambda: f"groups are left: {groups_of(pid)}")

    def test_what_is_left_of_it_is_removed_at_the_next_start(self):
        if not may_make_groups():
            self.skipTest("control groups can't be made here")
        server = LimitedServer()
        self.addCleanup(server.close)
        server.start()

        async def groups():
            async with Browser(server) as browser:
                await browser.start(NEIGHBOUR)
                await browser.hear("webots:")
                return groups_of(server.process.pid)

        group = asyncio.run(groups())[0]
        server.stop()
        wait_until(lambda: not os.path.exists(group), lambda: f"it is left: {group}")
        os.mkdir(group)
        self.addCleanup(lambda: os.path.isdir(group) and os.rmdir(group))
        os.utime(group, (0, 0))  # a young one may be about to be used by a server in another PID namespace
        server.start()
        self.assertFalse(os.path.exists(group))


if __name__ == "__main__":
    main()
