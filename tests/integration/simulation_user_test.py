#!/usr/bin/python3
"""Where the server is root, its simulations run as other users: what they can't do even where nothing else confines them."""

import asyncio
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser, server  # noqa: E402
from support.frames import running  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.other_user import NOBODY, OwnedServer  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import main, program, wait_until  # noqa: E402

HOSTILE = "local:/projects/hostile/blob/main/worlds/hostile.wbt"
NEIGHBOUR = "local:/projects/neighbour/blob/main/worlds/arena.wbt"
WORLD = """#VRML_SIM R2025a utf8
WorldInfo { }
RectangleArena { }
Robot { name "attacker" controller "attack" }
"""
ATTACK = r'''#!/usr/bin/python3
import json, os
with open("targets.json") as file:
    targets = json.load(file)

def can(action, *arguments):
    try:
        action(*arguments)
        return True
    except OSError:
        return False

def read(path):
    with open(path, "rb") as file:
        file.read(1)

def write(path):
    with open(path, "a") as file:
        file.write("x")

said = {"read": [each for each in targets["read"] if can(read, each)],
        "write": [each for each in targets["write"] if can(write, each)],
        "list": [each for each in targets["list"] if can(os.listdir, each)],
        "signal": [each for each in targets["signal"] if can(os.kill, each, 0)],
        "become root": can(os.setuid, 0),
        "own": can(write, "own") and can(write, "../../worlds/hostile.wbt") and can(write, os.path.expanduser("~/own")),
        "user": [os.getuid(), os.geteuid(), os.getgid()], "groups": os.getgroups(),
        "environment": dict(os.environ)}
with open("said.new", "w") as file:
    json.dump(said, file)
os.rename("said.new", "said")
'''

# Run by us as the user of a simulation, but outside of its namespaces: what then forbids things is the user alone.
OUTSIDE = r'''
import json, os, signal, socket, sys
wanted = json.loads(sys.argv[1])
def attempt(action, *arguments):
    try:
        action(*arguments)
        return "done"
    except OSError as error:
        return type(error).__name__
def drain(path):
    with socket.socket(socket.AF_UNIX) as end:
        end.connect(path)
said = {"signal": {attempt(os.kill, each, signal.SIGSTOP) for each in wanted["processes"]},
        "memory": {attempt(open, f"/proc/{each}/mem", "rb") for each in wanted["processes"]},
        "environment": {attempt(open, f"/proc/{each}/environ", "rb") for each in wanted["processes"]},
        "folder": {attempt(os.listdir, wanted["folder"])}, "socket": {attempt(drain, wanted["socket"])}}
print(json.dumps({key: sorted(value) for key, value in said.items()}))
'''


def setUpModule():
    if os.geteuid() != 0:
        raise unittest.SkipTest("only root's servers run simulations as other users")


def users_of(pids):
    found = set()
    for pid in pids:
        with contextlib.suppress(OSError), open(f"/proc/{pid}/status") as status:
            found.add(int(next(line for line in status if line.startswith("Uid:")).split()[1]))
    return found


class Projects:
    """A hostile project and a neighbour, in a folder that only root may look into."""

    @classmethod
    def place_projects(cls, server):
        folder = os.path.join(server.folder, "projects")
        files = {**{os.path.join("neighbour", path): content for path, content in demo_project().items()},
                 "hostile/worlds/hostile.wbt": WORLD.encode(), "hostile/controllers/attack/attack": ATTACK.encode()}
        for path, content in files.items():
            path = os.path.join(folder, "projects", path)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "wb") as file:
                file.write(content)
        os.chmod(os.path.join(folder, "projects/hostile/controllers/attack/attack"), 0o755)
        server.config.update(forges=[{"url": "local:", "directory": folder}], allowedRepositories=["local:/projects"])
        return folder


class Attack(Projects):
    """Everything is tried once, with one neighbour; each test looks at an outcome."""

    keys = {}
    mode = 0o755  # of the folder with all that is the server's
    has_folders_in_memory = False  # in place of those above its own: it may think that it has written into them

    @classmethod
    def setUpClass(cls):
        cls.server = OwnedServer(simulationUser="auto", debug=False, **cls.keys)
        cls.addClassCleanup(cls.server.close)
        projects = cls.place_projects(cls.server)
        folder = cls.server.folder
        cls.secrets = [os.path.join(folder, name) for name in ("key.pem", "operator-token")]
        for path in cls.secrets:
            with open(path, "w") as file:
                file.write("secret")
            os.chmod(path, 0o600)
        cache = os.path.join(folder, "cache", "webots_cloud", "2000", "file")
        os.makedirs(os.path.dirname(cache))
        with open(cache, "w") as file:
            file.write("fetched")
        authority = os.path.join(folder, "authority")
        with open(authority, "w") as file:
            file.write("cookie")
        os.chmod(authority, 0o600)
        cls.server.environment["XAUTHORITY"] = authority
        os.chmod(folder, cls.mode)
        cls.server.configure()
        os.chmod(os.path.join(folder, "config.json"), 0o600)
        cls.server.start()
        instances = cls.server.instances_folder()
        cls.neighbour = os.path.join(instances, "1")
        cls.targets = {
            "read": [*cls.secrets, os.path.join(folder, "config.json"), cache, cls.log_file(), "/etc/shadow", authority,
                     os.path.join(cls.neighbour, "worlds/arena.wbt"), f"/proc/{cls.server.process.pid}/environ"],
            "write": [cache, cls.log_file(), os.path.join(instances, "planted"), os.path.join(folder, "planted"), "/usr/planted",
                      os.path.join(cls.neighbour, "worlds/arena.wbt")],
            "list": [instances, cls.neighbour, os.path.join(cls.server.state_folder(), str(cls.server.port)), "../../../../.."],
            "signal": [cls.server.process.pid]}
        path = os.path.join(projects, "projects/hostile/controllers/attack/targets.json")
        with open(path, "w") as file:
            json.dump(cls.targets, file)
        asyncio.run(cls.attack())

    @classmethod
    def log_file(cls):
        return os.path.join(cls.server.folder, "log", "simulation", "output.log")

    @classmethod
    async def attack(cls):
        async with Browser(cls.server) as neighbour, Browser(cls.server) as browser:
            await neighbour.start(NEIGHBOUR)
            address = await neighbour.hear("webots:")
            before = cls.server.simulators()
            await browser.start(HOSTILE)
            await browser.hear("webots:")
            said = os.path.join(cls.server.instances_folder(), "2", "controllers", "attack", "said")
            wait_until(lambda: os.path.exists(said), lambda: f"it does not attack:\n{cls.server_log()}")
            with open(said) as file:
                cls.said = json.load(file)
            cls.neighbours = users_of(before)
            cls.owners = {os.lstat(os.path.join(folder, name)).st_uid
                          for folder, _, names in os.walk(os.path.join(cls.server.instances_folder(), "2")) for name in names}
            cls.outside = json.loads(subprocess.run(
                ["setpriv", f"--reuid={cls.said['user'][0]}", f"--regid={cls.said['user'][0]}", "--clear-groups", sys.executable, "-c",
                 OUTSIDE, json.dumps({"processes": [cls.server.process.pid, *before], "folder": cls.neighbour,
                                      "socket": cls.server.operator_socket()})],
                check=True, capture_output=True, text=True, cwd="/").stdout)
            cls.alive = await cls.frame(int(address.rpartition(":")[2]))
            cls.planted = [each for each in cls.targets["write"] if each.endswith("planted") and os.path.exists(each)]
        cls.server.wait_until_clean()

    @classmethod
    def server_log(cls):
        with open(cls.log_file()) as file:
            return file.read() + cls.server.log()

    @staticmethod
    async def frame(port):
        """Whether the simulator at the port serves a picture."""
        async with running(port):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(b"GET /mjpeg HTTP/1.1\r\nHost: localhost\r\n\r\n")
            received = await asyncio.wait_for(reader.readuntil(b"\xff\xd8\xff"), 60)
            writer.close()
        return bool(received)

    def test_it_is_a_user_whom_nobody_else_is(self):
        real, effective, group = self.said["user"]
        self.assertEqual((effective, group), (real, real))
        self.assertGreaterEqual(real, 0x70000000)
        self.assertNotIn(real, self.neighbours)
        self.assertTrue([user for user in self.neighbours if user >= 0x70000000], self.neighbours)
        self.assertFalse(self.said["become root"])

    def test_its_files_are_its_own(self):
        self.assertTrue(self.said["own"])
        self.assertEqual(self.owners, {self.said["user"][0]})

    def test_it_reads_neither_configuration_nor_keys_nor_logs_nor_its_neighbour(self):
        self.assertEqual(self.said["read"], [])
        if not self.has_folders_in_memory:
            self.assertEqual(self.said["list"], [])

    def test_it_writes_nowhere_else(self):
        self.assertEqual(self.planted, [])
        if not self.has_folders_in_memory:
            self.assertEqual(self.said["write"], [])

    def test_it_signals_nobody(self):
        self.assertEqual(self.said["signal"], [])

    def test_it_has_the_password_of_its_display_and_no_other_folder_of_the_servers_user(self):
        environment = self.said["environment"]
        with_home = {name: value for name, value in environment.items() if self.server.folder in value}
        self.assertIn("/.webots_cloud-home/Xauthority", with_home.pop("XAUTHORITY"))
        self.assertEqual({name for name, value in with_home.items() if "/instances/2" not in value}, set())
        self.assertEqual(environment["USER"], "simulation")

    def test_its_user_alone_keeps_it_from_server_guards_and_neighbours(self):
        """Were there no namespaces."""
        self.assertEqual(self.outside, {"signal": ["PermissionError"], "memory": ["PermissionError"], "environment": ["PermissionError"],
                                        "folder": ["PermissionError"], "socket": ["PermissionError"]})
        self.assertTrue(self.alive)

    def test_the_log_says_so(self):
        self.assertIn("Simulations run as other users than this server, each with a number of its own.", self.server_log())
        self.assertNotIn("This server runs as root, and simulations with it", self.server_log())


class WithoutSandbox(Attack, unittest.TestCase):
    keys = {"sandbox": "none"}


class BelowAFolderOfRoots(Attack, unittest.TestCase):
    """As below `/root`: the way to its own files leads through a folder that it may not enter."""

    keys = {"sandbox": "none"}
    mode = 0o700


class InBubblewrap(Attack, unittest.TestCase):
    keys = {"sandbox": "bubblewrap", "network": "none"}
    mode = 0o700
    has_folders_in_memory = True

    @classmethod
    def setUpClass(cls):
        if not os.access("/usr/bin/bwrap", os.X_OK):
            raise unittest.SkipTest("bubblewrap is not installed")
        super().setUpClass()


class FromGit(unittest.IsolatedAsyncioTestCase):
    async def test_a_mounted_project_is_the_users_own_but_for_what_is_below_the_mount(self):
        """Of large repositories only what changes is copied: the rest is the cache's, mounted."""
        files = {path: ("100755" if content.startswith(b"#!") else "100644", content) for path, content in demo_project().items()}
        files["worlds/hostile.wbt"] = ("100644", WORLD.encode())
        files["controllers/attack/attack"] = ("100755", ATTACK.encode())
        targets = {"read": [], "write": ["../../worlds/arena.wbt"], "list": ["../../../.overlay", "../.."], "signal": []}
        files["controllers/attack/targets.json"] = ("100644", json.dumps(targets).encode())
        with GitServer() as git:
            git.add_repository("o", "robots", files)
            with server(simulationUser="auto", forges=[git.url], allowedRepositories=[git.url]) as simulation:
                for _ in range(2):  # the second time from the cache, which must still be as it was
                    async with Browser(simulation) as browser:
                        await browser.start(f"{git.url}/o/robots/blob/main/worlds/hostile.wbt")
                        await browser.hear("webots:")
                        instance = os.path.join(simulation.instances_folder(), simulation.instances()[0])
                        found = lambda: [os.path.join(folder, "said") for folder, _, names in os.walk(instance) if "said" in names]  # noqa: E731
                        wait_until(found, lambda: f"it does not attack:\n{simulation.log()}")
                        with open(found()[0]) as file:
                            said = json.load(file)
                        self.assertTrue(said["own"])
                        self.assertEqual(said["write"], targets["write"])
                        self.assertEqual(said["list"], ["../.."])
                        scratch = os.path.join(instance, ".overlay")  # there is none where projects are copied
                        self.assertTrue(not os.path.exists(scratch) or os.lstat(scratch).st_uid == 0)
                    simulation.wait_until_clean()
                self.assertNotIn("damaged", simulation.log())


class Choice(unittest.IsolatedAsyncioTestCase):
    """What the key says, and what becomes of it."""

    def refused(self, settings, user=None):
        refusing = OwnedServer(user, **settings)
        self.addCleanup(refusing.close)
        with self.assertRaises(AssertionError):
            refusing.start()
        return refusing.log()

    async def test_a_user_of_the_machine_runs_all_simulations(self):
        with server(simulationUser="nobody") as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                self.assertEqual(users_of(simulation.simulators()), {0, NOBODY})  # 0: the guard
                self.assertIn("Simulations run as the user nobody.", simulation.log())
            simulation.wait_until_clean()

    async def test_the_servers_own_user_runs_them_where_the_operator_wants_that(self):
        with server(simulationUser="none") as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                self.assertEqual(users_of(simulation.simulators()), {0})
            self.assertIn("This server runs as root, and simulations with it", simulation.log())

    def test_a_user_that_can_not_be_had_is_refused(self):
        self.assertIn('key "simulationUser": this machine has no user "nobody-of-this-name", and the server does not start without',
                      self.refused({"simulationUser": "nobody-of-this-name"}))
        self.assertIn('"simulationUser": "daemon" does not work here: only a server that runs as root can start simulations as another '
                      "user", self.refused({"simulationUser": "daemon"}, NOBODY))

    async def test_a_server_of_another_user_runs_them_as_itself(self):
        with OwnedServer(NOBODY, simulationUser="auto") as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                self.assertEqual(users_of(simulation.simulators()), {NOBODY})

    async def test_where_other_users_can_not_run_webots_root_does_and_the_log_says_so(self):
        simulation = server(simulationUser="auto")
        home = os.path.join(simulation.folder, "webots")
        os.mkdir(home)
        with open(os.path.join(home, "webots"), "w") as file:
            file.write(f"#!/bin/sh\nexec {program('webots-demo-simulator')} \"$@\"\n")
        os.chmod(os.path.join(home, "webots"), 0o700)
        simulation.config["webotsHome"] = home
        with simulation:
            self.assertIn("No other user can be had for simulations, and they run as root: another user can't run ", simulation.log())
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                self.assertEqual(users_of(simulation.simulators()), {0})

    def test_a_secret_that_everybody_may_read_is_warned_about(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "config.json")
            with open(path, "w") as file:
                json.dump({"server": "localhost", "port": 1999, "simulationServers": [], "monitorPassword": "open sesame"}, file)
            for of_folder, of_file, warned in ((0o755, 0o644, True), (0o700, 0o644, False), (0o755, 0o640, False)):
                os.chmod(folder, of_folder)
                os.chmod(path, of_file)
                told = subprocess.run([program("webots-session-server"), "--check-config", path], capture_output=True, text=True, timeout=60)
                self.assertEqual(told.returncode, 0, told.stderr)
                self.assertEqual(f'{path}: everybody on this machine may read it, simulations too, and "monitorPassword" is in it' in told.stderr,
                                 warned, told.stderr)

    async def test_a_project_does_not_lead_root_astray_by_a_link(self):
        """In the place of the folder that root makes in the project."""
        simulation = server(simulationUser="auto")
        Projects.place_projects(simulation)
        with simulation:
            link = os.path.join(simulation.folder, "projects/projects/neighbour/.webots_cloud-home")
            os.makedirs(link)  # links of folders are not copied: the name alone must do
            async with Browser(simulation) as browser:
                await browser.start(NEIGHBOUR)
                told = await browser.hear("loading: Error:")
                self.assertIn("File exists", told)
            simulation.wait_until_clean()


if __name__ == "__main__":
    main()
