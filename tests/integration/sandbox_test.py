#!/usr/bin/python3
"""What a stranger's project can do to its server, its neighbours and the network, with each sandbox and, to show that the attempts are
worth something, with none. The project is hostile: its controller tries everything, and says what came of it.

Runs in a network namespace of its own, at the end of a cable with an internet of two kinds of machines, public and private.
"""

import asyncio
import json
import os
import shutil
import socket
import stat
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import own_network  # noqa: E402
from support.browser_client import Browser  # noqa: E402
from support.other_user import NOBODY, OwnedServer  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import is_alive, main, wait_until  # noqa: E402

HOSTILE = "local:/projects/hostile/blob/main/worlds/hostile.wbt"
WORLD = """#VRML_SIM R2025a utf8
WorldInfo { }
RectangleArena { }
Robot { name "attacker" controller "attack" }
"""

# Says what it can do, as JSON in a file beside itself; then flees from its parents, and stays.
ATTACK = r'''#!/usr/bin/python3
import json, os, socket, sys
with open("targets.json") as file:
    targets = json.load(file)

def can(action, *arguments):
    try:
        return action(*arguments) is not False
    except OSError:
        return False

def connect(host, port):
    with socket.create_connection((host, port), 3):
        pass

def read(path):
    with open(path, "rb") as file:
        file.read(1)

def write(path):
    with open(path, "a") as file:
        file.write("x")

def open_for_writing(path):
    os.close(os.open(path, os.O_WRONLY))

def make_user_namespace():
    if os.spawnlp(os.P_WAIT, "unshare", "unshare", "--user", "true") != 0:
        raise OSError

def connect_abstract(name):
    with socket.socket(socket.AF_UNIX) as end:
        end.connect("\0" + name)

said = {"read": [each for each in targets["read"] if can(read, each)],
        "write": [each for each in targets["write"] if can(write, each)],
        "connect": [each for each in targets["connect"] if can(connect, *each)],
        "open": [each for each in targets["open"] if can(open_for_writing, each)],
        "user namespace": can(make_user_namespace),
        "abstract": can(connect_abstract, targets["abstract"]),
        "signal": [each for each in targets["signal"] if can(os.kill, each, 0)],
        "sees": sorted(int(each) for each in os.listdir("/proc") if each.isdigit()),
        "own": can(write, "own") and can(write, "/tmp/own") and can(write, os.path.expanduser("~/own")),
        "displays": os.listdir("/tmp/.X11-unix") if os.path.isdir("/tmp/.X11-unix") else [],
        "environment": sorted(os.environ)}
with open("said.new", "w") as file:
    json.dump(said, file)
os.rename("said.new", "said")
if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        os.execv("/bin/sleep", ["sleep", targets["mark"]])
    os._exit(0)
'''


def setUpModule():
    unittest.enterModuleContext(own_network.Outside())


def find(mark):
    """Living processes with this in their command line."""
    found = []
    for entry in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{entry}/cmdline", "rb") as line:
                if mark.encode() in line.read() and is_alive(int(entry)):
                    found.append(int(entry))
        except OSError:
            pass
    return found


class Hostile:
    """Everything is tried once, with one neighbour; each test looks at an outcome."""

    keys = {}
    user = None
    needs = ()  # programs
    walled = True

    @classmethod
    def setUpClass(cls):
        for needed in cls.needs:
            if not any(shutil.which(needed, path=path) for path in (os.environ["PATH"], "/usr/sbin:/sbin")):
                raise unittest.SkipTest(f"{needed} is not installed")
        cls.listen()
        cls.server = OwnedServer(cls.user, **cls.keys)
        cls.addClassCleanup(cls.server.close)
        cls.place_projects()
        cls.server.start()
        asyncio.run(cls.attack())

    @classmethod
    def listen(cls):
        """Services of this machine: on the loopback, and one with an abstract name, as X servers have."""
        cls.loopback = socket.create_server(("127.0.0.1", 0), backlog=64)
        cls.addClassCleanup(cls.loopback.close)
        cls.abstract = socket.socket(socket.AF_UNIX)
        cls.addClassCleanup(cls.abstract.close)
        cls.abstract_name = f"webots_cloud_{os.getpid()}_{cls.__name__}"
        cls.abstract.bind("\0" + cls.abstract_name)
        cls.abstract.listen(8)

    @classmethod
    def place_projects(cls):
        folder = os.path.join(cls.server.folder, "projects")
        files = {**{os.path.join("neighbour", path): content for path, content in demo_project().items()},
                 "hostile/worlds/hostile.wbt": WORLD.encode(), "hostile/controllers/attack/attack": ATTACK.encode()}
        for path, content in files.items():
            path = os.path.join(folder, "projects", path)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "wb") as file:
                file.write(content)
        os.chmod(os.path.join(folder, "projects/hostile/controllers/attack/attack"), 0o755)
        cls.server.config.update(forges=[{"url": "local:", "directory": folder}], allowedRepositories=["local:/projects"])
        secret = os.path.join(cls.server.folder, "key.pem")
        with open(secret, "w") as file:
            file.write("secret")
        os.chmod(secret, 0o600)
        cls.secret = secret
        os.chmod(cls.server.folder, os.stat(cls.server.folder).st_mode | stat.S_IXOTH)

    @classmethod
    def aim(cls, neighbour):
        """Tells the attack what it can't find out by itself."""
        server = cls.server
        instances = server.instances_folder()
        cls.mark = f"777.{os.getpid()}{abs(hash(cls.__name__)) % 1000}"
        cls.neighbour_file = os.path.join(instances, "1", "worlds", "arena.wbt")
        cls.config = os.path.join(server.folder, "config.json")
        targets = {
            "read": [cls.config, cls.secret, cls.neighbour_file, "/etc/shadow", server.log_path],
            "write": [os.path.join(server.folder, "planted"), os.path.join(instances, "planted"), "/usr/planted", "/etc/planted",
                      cls.neighbour_file],
            "connect": [["127.0.0.1", cls.loopback.getsockname()[1]], ["127.0.0.1", server.port], ["127.0.0.1", neighbour],
                        ["10.0.2.2", server.port], ["10.0.2.3", server.port], ["10.78.0.1", server.port],
                        [own_network.PRIVATE, 80], [own_network.SHARED, 80], [own_network.METADATA, 80], [own_network.PUBLIC, 80]],
            "open": ["/proc/sys/kernel/core_pattern", "/proc/sysrq-trigger", "/sys/kernel/uevent_helper", "/dev/sda", "/dev/vda", "/dev/mem"],
            "abstract": cls.abstract_name,
            "signal": [server.process.pid, *[pid for pid in server.simulators() if is_alive(pid)]],
            "mark": cls.mark,
        }
        cls.targets = targets
        path = os.path.join(server.folder, "projects/projects/hostile/controllers/attack/targets.json")
        with open(path, "w") as file:
            json.dump(targets, file)
        os.chmod(path, 0o644)

    @classmethod
    async def attack(cls):
        async with Browser(cls.server) as neighbour, Browser(cls.server) as browser:
            await neighbour.start("local:/projects/neighbour/blob/main/worlds/arena.wbt")
            address = await neighbour.hear("webots:")
            port = int(address.rpartition(":")[2])
            cls.aim(port)
            await browser.start(HOSTILE)
            cls.address = await browser.hear("webots:")
            said = os.path.join(cls.server.instances_folder(), "2", "controllers", "attack", "said")
            wait_until(lambda: os.path.exists(said), lambda: f"it does not attack:\n{cls.server.log()}")
            with open(said) as file:
                cls.said = json.load(file)
            wait_until(lambda: find(cls.mark), "it does not flee")
            cls.alive = await cls.frame(port) and await cls.frame(int(cls.address.rpartition(":")[2]))
            cls.written = [each for each in cls.targets["write"] if os.path.exists(each) and cls.is_written(each)]
            for each in cls.targets["write"][:-1]:
                if os.path.exists(each):
                    os.unlink(each)
        cls.server.wait_until_clean()
        cls.left = find(cls.mark)

    @staticmethod
    def is_written(path):
        with open(path, "rb") as file:
            return file.read().endswith(b"x")

    @classmethod
    async def frame(cls, port):
        """Whether the simulator at the port of this machine serves a picture."""
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(b"GET /mjpeg HTTP/1.1\r\nHost: localhost\r\n\r\n")
        received = await asyncio.wait_for(reader.readuntil(b"\xff\xd8\xff"), 60)
        writer.close()
        return bool(received)

    def tried(self, kind, allowed):
        """What of this kind succeeded must be exactly this."""
        self.assertEqual(self.said[kind], [each for each in self.targets[kind] if each in allowed])

    def test_it_works_in_its_own_folder(self):
        self.assertTrue(self.said["own"])

    def test_its_neighbour_and_itself_are_seen_by_browsers(self):
        self.assertTrue(self.alive)

    def test_nothing_of_it_outlives_its_session(self):
        self.assertEqual(self.left, [])

    def test_the_monitor_says_what_shuts_it_in(self):
        self.assertIn(self.description, self.server.get("/monitor"))


class Walled(Hostile):
    """What every sandbox keeps out."""

    reaches = ()

    def test_it_reads_neither_configuration_nor_keys_nor_logs_nor_its_neighbour(self):
        self.tried("read", ())

    def test_it_writes_nowhere_else(self):
        self.assertEqual(self.written, [])  # it may think that it has, in folders of its own in memory

    def test_it_changes_nothing_of_the_kernel(self):
        self.tried("open", ())
        self.assertFalse(self.said["user namespace"])

    def test_it_reaches_what_the_network_key_says(self):
        self.tried("connect", self.reaches)

    def test_it_reaches_no_abstract_sockets(self):
        self.assertEqual(self.said["abstract"], self.shares_network)

    def test_it_sees_and_signals_only_its_own_processes(self):
        self.tried("signal", [pid for pid in self.targets["signal"] if pid in self.said["sees"]])
        self.assertLess(len(self.said["sees"]), 10)

    def test_it_sees_no_display_of_others(self):
        self.assertEqual(self.said["displays"], [])

    shares_network = False


class Bubblewrap(Walled, unittest.TestCase):
    keys = {"sandbox": "bubblewrap"}
    needs = ("bwrap", "slirp4netns", "ip")
    reaches = ([own_network.PUBLIC, 80],)
    description = "bubblewrap, public internet only"


class BubblewrapWithoutNetwork(Walled, unittest.TestCase):
    keys = {"sandbox": "bubblewrap", "network": "none"}
    needs = ("bwrap",)
    description = "bubblewrap, no network"


class BubblewrapOfAnotherUser(Walled, unittest.TestCase):
    keys = {"sandbox": "bubblewrap", "network": "none"}
    needs = ("bwrap",)
    user = NOBODY
    description = "bubblewrap, no network"


class NoSandbox(Hostile, unittest.TestCase):
    """The attempts succeed where nothing forbids them."""

    keys = {"sandbox": "none"}
    description = '<span id="sandbox">none</span>'

    def test_it_reads_what_the_server_reads(self):
        self.tried("read", self.targets["read"])

    def test_it_reaches_what_the_server_reaches(self):
        self.tried("connect", [each for each in self.targets["connect"] if each[0] not in ("10.0.2.2", "10.0.2.3")])
        self.assertTrue(self.said["abstract"])

    def test_it_writes_where_the_server_writes(self):
        self.assertEqual(self.written, self.targets["write"])


if __name__ == "__main__":
    own_network.enter()
    main()
