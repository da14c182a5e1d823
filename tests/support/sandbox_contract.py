"""What every sandbox promises: a stranger's project, whose controller makes all attempts of sandbox_attempts.py, gets nowhere, while a
neighbour's pictures keep coming.

    class Bubblewrap(Walled, unittest.TestCase):
        sandbox = "bubblewrap"
        ...

Each attempt is a test of its own. What came of them is kept for the table in docs/sandboxes.md: see tests/integration/sandbox_table.py.
"""

import asyncio
import errno
import fcntl
import glob
import json
import os
import select
import shutil
import socket
import stat
import struct
import sys
import termios
import tty
import unittest

from . import own_network, sandbox_attempts
from .browser_client import Browser
from .frames import Frames, running
from .other_user import OwnedServer
from .projects import demo_project
from .sandbox_attempts import ATTEMPTS, DONE, NOT_HERE
from .servers import BIN, is_alive, wait_until

HOSTILE = "local:/projects/hostile/blob/main/worlds/hostile.wbt"
NEIGHBOUR = "local:/projects/neighbour/blob/main/worlds/arena.wbt"
WORLD = """#VRML_SIM R2025a utf8
WorldInfo { }
RectangleArena { }
Robot { name "attacker" controller "attack" }
"""
SIMULATORS = ("webots-demo-sim", "webots")  # as the kernel shortens the name; in containers
GROUPS = "/sys/fs/cgroup"
LIMITS = ("memory.limit_in_bytes", "memory.max", "pids.max", "cpu.cfs_quota_us", "cpu.max")
HERE = os.path.dirname(__file__)
PROJECT = {"worlds/hostile.wbt": None, "controllers/attack/attack": "hostile_controller.py",
           "controllers/attack/sandbox_attempts.py": "sandbox_attempts.py"}

# The server has a controlling terminal, as when it is started by hand, and a key in the keyring of its session, as services have.
KEY = "webots_cloud_secret"
AS_BY_HAND = f"""import ctypes, os, sys
sys.path.insert(0, {HERE!r})
from sandbox_attempts import system_call
os.setsid()
os.open(sys.argv[1], os.O_RDWR)
try:
    system_call("keyctl", 1, 0)
    system_call("add_key", ctypes.c_char_p(b"user"), ctypes.c_char_p(b"{KEY}"), ctypes.c_char_p(b"secret"), 6, -3)
except OSError:
    pass
os.execvp(sys.argv[2], sys.argv[2:])
"""


def has_sockets(family):
    """A target, if the kernel has such sockets."""
    try:
        socket.socket(getattr(socket, family), socket.SOCK_SEQPACKET).close()
        return family
    except OSError as error:
        return None if error.errno == errno.EAFNOSUPPORT else family


def everybody_reads_kernel_log():
    with open("/proc/sys/kernel/dmesg_restrict") as restrict:
        return restrict.read().strip() == "0"


def has_keyrings():
    try:
        sandbox_attempts.system_call("keyctl", 0, -3, 0)
        return True
    except OSError:
        return False


def results_folder():
    return os.path.join(os.path.dirname(BIN), "sandbox_results")


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


def named(process):
    """The program that a process runs."""
    try:
        with open(f"/proc/{process}/comm") as file:
            return file.read().strip()
    except OSError:
        return ""


def victim(process, *more):
    return [process, sandbox_attempts.identity(process), *more]


def first_disk():
    disks = [name for name in os.listdir("/sys/block") if os.path.exists(os.path.join("/dev", name))]
    return os.path.join("/dev", sorted(disks)[0]) if disks else None


def there(path):
    return path if os.path.exists(path) else None


def groups_of(process):
    """The folders of the control groups that it is in, but for those of all processes."""
    with open(f"/proc/{process}/cgroup") as lines:
        groups = [line.strip().split(":", 2)[1:] for line in lines]
    mounts = ("unified", "")  # of version 2
    folders = [os.path.join(GROUPS, mount, path.lstrip("/")) for controllers, path in groups if path != "/"
               for mount in ([controllers.replace("name=", "")] if controllers else mounts)]
    return [each for each in folders if os.path.isdir(each)]


def limits_of(process):
    """The files of its limits, also where a container sees its own group in place of that of all processes."""
    folders = [*groups_of(process), *[os.path.join(GROUPS, each) for each in ("memory", "pids", "cpu", "")]]
    return [path for folder in folders for limit in LIMITS for path in glob.glob(f"{folder}/{limit}")]


def lists_of_processes(process):
    """Of the groups above its own, and of those of all processes, where these limit something."""
    above = [os.path.dirname(each) for each in groups_of(process) if any(glob.glob(f"{each}/{limit}") for limit in LIMITS)]
    of_all = [os.path.join(GROUPS, each) for each in ("memory", "pids", "cpu", "")]
    return [path for folder in (*above, *of_all) for path in glob.glob(f"{folder}/cgroup.procs")]


def start_of_memory(process):
    """An address that can be read in every process of this program."""
    with open(f"/proc/{process}/maps") as maps:
        return int(maps.readline().split("-")[0], 16)


class Contract:
    """Everything is tried once, with one neighbour; each test looks at an outcome."""

    sandbox = None  # the column of the table
    variant = ""  # what is special about this class, as in "with X"; empty: what the column is about
    keys = {}  # of the configuration
    user = None
    wrapper = ()  # that changes to this user; without one the server is started as that
    has_network = True  # of its own, where a gateway and a resolver may be
    needs = ()  # programs
    description = None  # what the monitor has to say
    expected = {}  # attempt -> outcomes, where they are not those of a sandbox

    @classmethod
    def setUpClass(cls):
        cls.forget()
        for needed in cls.needs:
            if not any(shutil.which(needed, path=path) for path in (os.environ["PATH"], "/usr/sbin:/sbin")):
                raise unittest.SkipTest(f"{needed} is not installed")
        cls.listen()
        cls.server = cls.make_server()
        cls.addClassCleanup(cls.server.close)
        cls.place_projects()
        cls.server.start()
        asyncio.run(cls.attack())
        cls.remember()

    @classmethod
    def make_server(cls):
        terminal, slave = os.openpty()
        cls.addClassCleanup(os.close, terminal)
        cls.terminal_name = os.ttyname(slave)
        cls.addClassCleanup(os.close, slave)
        cls.terminal, cls.keyboard = terminal, slave
        tty.setraw(slave)
        os.chmod(cls.terminal_name, 0o666)
        return OwnedServer(cls.user, (sys.executable, "-c", AS_BY_HAND, cls.terminal_name, *cls.wrapper), bool(cls.wrapper), **cls.keys)

    @classmethod
    def listen(cls):
        """Services of this machine: on the loopback, and two with names, as X servers have."""
        def offer(made):
            cls.addClassCleanup(made.close)
            return made

        cls.loopback = offer(socket.create_server(("127.0.0.1", 0), backlog=64))
        cls.loopback_ipv6 = offer(socket.create_server(("::1", 0), family=socket.AF_INET6, backlog=64)) if socket.has_ipv6 else None
        cls.abstract_name = f"webots_cloud_{os.getpid()}_{cls.__name__}"
        offer(socket.socket(socket.AF_UNIX)).bind("\0" + cls.abstract_name)
        cls.abstract = offer(socket.socket(socket.AF_UNIX))
        cls.abstract.bind("\0" + cls.abstract_name + "_listens")
        cls.abstract.listen(8)
        os.makedirs("/tmp/.X11-unix", exist_ok=True)
        cls.display = f"/tmp/.X11-unix/X{10000 + os.getpid() % 10000}"
        cls.x_server = offer(socket.socket(socket.AF_UNIX))
        cls.x_server.bind(cls.display)
        cls.addClassCleanup(os.unlink, cls.display)
        os.chmod(cls.display, 0o777)
        cls.x_server.listen(8)

    @classmethod
    def place_projects(cls):
        folder = os.path.join(cls.server.folder, "projects")
        files = {os.path.join("neighbour", path): content for path, content in demo_project().items()}
        for path, source in PROJECT.items():
            content = WORLD.encode()
            if source:
                with open(os.path.join(HERE, source), "rb") as file:
                    content = file.read()
            files[os.path.join("hostile", path)] = content
        for path, content in files.items():
            path = os.path.join(folder, "projects", path)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "wb") as file:
                file.write(content)
        os.chmod(os.path.join(folder, "projects/hostile/controllers/attack/attack"), 0o755)
        cls.server.config.update(forges=[{"url": "local:", "directory": folder}], allowedRepositories=["local:/projects"])
        # As an operator keeps them: what everybody may read, the users of simulations may, too.
        os.chmod(folder, 0o700)
        os.chmod(cls.server.configure(), 0o600)
        os.close(os.open(cls.server.log_path, os.O_WRONLY | os.O_CREAT, 0o600))
        cls.key, cls.home_file = (os.path.join(cls.server.folder, name) for name in ("key.pem", ".netrc"))
        for path in (cls.key, cls.home_file):
            with open(path, "w") as file:
                file.write("secret")
            os.chmod(path, 0o600)
        os.chmod(cls.server.folder, os.stat(cls.server.folder).st_mode | stat.S_IXOTH)

    @classmethod
    def targets(cls, neighbour_port, others):
        """What the attack can't find out by itself, for each attempt."""
        server = cls.server
        instances = server.instances_folder()
        configuration = os.path.join(server.folder, "config.json")
        neighbour = os.path.join(instances, "1", "worlds", "arena.wbt")
        guard = [pid for pid in others if named(pid).startswith("webots-process")][0]
        simulator = [pid for pid in others if named(pid) in SIMULATORS][-1]
        own = [pid for pid in cls.processes() if pid not in others]
        own_guard = [pid for pid in own if named(pid).startswith("webots-process")][0]
        attacker = [pid for pid in own if named(pid) in SIMULATORS][-1]
        cls.mark = f"777.{os.getpid()}{abs(hash(cls.__name__)) % 1000}"
        path = server.folder
        chosen = {
            "read_shadow": "/etc/shadow", "read_configuration": configuration, "read_key": cls.key, "read_log": server.log_path,
            "read_home": cls.home_file, "read_state": os.path.join(path, "projects/projects/neighbour/worlds/arena.wbt"),
            "read_by_link": configuration, "hard_link": configuration,
            "read_through_server": victim(server.process.pid, configuration),
            "read_neighbour": neighbour, "write_neighbour": neighbour,
            "write_server_folder": os.path.join(path, "planted"), "write_instances": os.path.join(instances, "planted"),
            "write_usr": f"/usr/planted_{os.getpid()}", "write_etc": f"/etc/planted_{os.getpid()}", "write_temporary": f"/tmp/planted_{os.getpid()}",
            "see_processes": [victim(each) for each in (server.process.pid, guard, simulator, os.getpid())],
            "signal_server": victim(server.process.pid), "stop_neighbour": victim(simulator), "signal_neighbours_guard": victim(guard),
            "signal_own_guard": victim(own_guard), "trace_own_guard": victim(own_guard), "open_pidfd": victim(simulator),
            "trace_neighbour": victim(simulator),
            "read_memory": victim(simulator, start_of_memory(simulator)), "open_memory": victim(simulator),
            "read_environment": victim(server.process.pid),
            "connect_loopback": ["127.0.0.1", cls.loopback.getsockname()[1]],
            "connect_ipv6_loopback": ["::1", cls.loopback_ipv6.getsockname()[1]] if cls.loopback_ipv6 else None,
            "connect_server": ["127.0.0.1", server.port], "connect_neighbour": ["127.0.0.1", neighbour_port],
            "connect_own_address": [own_network.OWN, server.port],
            "connect_gateway": ["10.0.2.2", server.port] if cls.has_network else None,
            "connect_resolver": ["10.0.2.3", server.port] if cls.has_network else None, "ask_as_operator": there(cls.operator_socket()),
            "connect_abstract": cls.abstract_name + "_listens",
            "connect_private": [own_network.PRIVATE, 80], "connect_shared": [own_network.SHARED, 80],
            "connect_metadata": [own_network.METADATA, 80], "send_private_datagram": [own_network.PRIVATE, 53],
            "connect_public": [own_network.PUBLIC, 80],
            "see_displays": cls.display, "connect_display": cls.display,
            "write_to_terminal": cls.terminal_name, "outlive": cls.mark,
            "run_set_user_id": there("/usr/bin/su"),
            "leave_group": lists_of_processes(attacker) or None, "run_as_agent": next(iter(glob.glob(f"{GROUPS}/*/release_agent")), None),
            "raise_limits": limits_of(attacker) or None,
            "write_core_pattern": "/proc/sys/kernel/core_pattern", "write_sysrq": there("/proc/sysrq-trigger"),
            "write_sys": there("/sys/kernel/uevent_helper") or there("/sys/kernel/mm/ksm/run"), "write_disk": first_disk(),
            "write_kernel_log": there("/dev/kmsg"), "read_physical_memory": there("/dev/mem"), "make_device": [7, 0],
            "read_kernel_log": "here" if everybody_reads_kernel_log() else None, "open_vsock": has_sockets("AF_VSOCK"),
            "open_crypto_socket": has_sockets("AF_ALG"), "set_host_name": socket.gethostname(),
            "read_key_of_session": KEY if has_keyrings() else None,
            "call_with_32_bits": "here" if os.uname().machine == "x86_64" and os.path.exists("/proc/sys/abi") else None,
        }
        # Attempts without a target are told "here".
        return {each: chosen.get(each, "here") for each in ATTEMPTS if each != "outlive"} | {"outlive": cls.mark}

    @classmethod
    def operator_socket(cls):
        path = cls.server.operator_socket()
        return path if cls.user is None else path.replace(f"webots-{os.geteuid()}", f"webots-{cls.user}")

    @classmethod
    async def attack(cls):
        async with Browser(cls.server) as neighbour, Browser(cls.server) as browser:
            await neighbour.start(NEIGHBOUR)
            port = int((await neighbour.hear("webots:")).rpartition(":")[2])
            others = cls.processes()
            await browser.start(HOSTILE)
            own_port = int((await browser.hear("webots:")).rpartition(":")[2])
            cls.chosen = await asyncio.to_thread(cls.targets, port, others)
            async with running(port), running(own_port):
                await asyncio.to_thread(cls.watch, port, own_port)
        cls.server.wait_until_clean()
        cls.outcomes["outlive"] = DONE if find(cls.mark) else "ended"

    @classmethod
    def processes(cls):
        """Of simulations: simulators, their guards and whatever they have started."""
        return cls.server.simulators()

    @classmethod
    def project(cls):
        """The folder in which the hostile project runs, as this machine sees it."""
        return os.path.join(cls.server.instances_folder(), "2")

    @classmethod
    def watch(cls, neighbour_port, own_port):
        """Lets the attempts begin one after the other, and after each of them waits for a picture of the neighbour."""
        place = os.path.join(cls.project(), "controllers", "attack")
        wait_until(lambda: os.path.exists(os.path.join(place, "go")), lambda: f"it does not attack:\n{cls.server.log()}")
        with open(os.path.join(place, "targets.json"), "w") as file:
            json.dump(cls.chosen, file)
        os.chmod(file.name, 0o644)
        cls.judged = {}
        frames = Frames(neighbour_port)
        try:
            cls.go_on(place)
            for number, name in enumerate(cls.chosen):
                said = cls.said_when(place, "outcomes", number + 1)
                cls.judge(name, said["outcomes"])
                frames.wait_for_next(f"after \"{name}\"")
                cls.go_on(place)
            cls.said = cls.said_when(place, "own")
        finally:
            frames.close()
        cls.outcomes = said["outcomes"]
        cls.outcomes.update(cls.judged)
        own = Frames(own_port)
        own.wait_for_next("but of the attacker")
        own.close()
        cls.is_seen = True
        wait_until(lambda: find(cls.mark), "it does not flee")

    @classmethod
    def said_when(cls, place, key, count=0):
        """What the controller says once it has said this, or so many outcomes."""
        def look():
            try:
                with open(os.path.join(place, "said")) as file:
                    said = json.load(file)
            except FileNotFoundError:
                return None
            return said if key in said and len(said["outcomes"]) >= count else None

        return wait_until(look, lambda: f"it does not attack:\n{cls.server.log()}")

    @staticmethod
    def go_on(place):
        def tell():
            try:
                os.close(os.open(os.path.join(place, "go"), os.O_WRONLY | os.O_NONBLOCK | os.O_NOFOLLOW))
                return True
            except OSError:  # nobody reads yet
                return False

        wait_until(tell, "it does not go on")

    @classmethod
    def judge(cls, name, outcomes):
        """What was written counts when others see it: in a sandbox a file may lie in a folder of its own in memory, and a terminal may
        be one of its own."""
        if not ATTEMPTS[name].writes or outcomes[name] == NOT_HERE:
            return
        seen = {"write_to_terminal": cls.is_on_terminal, "type_into_terminal": cls.is_typed}.get(name, cls.is_in_file)(cls.chosen[name])
        if seen:
            cls.judged[name] = DONE
        elif outcomes[name] == DONE:
            # Whether a container has a terminal of that name depends on how many terminals this machine has.
            cls.judged[name] = "ENOENT" if name == "write_to_terminal" else "private"

    @classmethod
    def is_in_file(cls, path):
        if not os.path.exists(path):
            return False
        with open(path, "rb") as file:
            seen = file.read().endswith(b"x")
        if seen and path != cls.chosen["write_neighbour"]:
            os.unlink(path)
        return seen

    @classmethod
    def is_on_terminal(cls, _):
        return bool(select.select([cls.terminal], [], [], 0)[0]) and b"x" in os.read(cls.terminal, 100)

    @classmethod
    def is_typed(cls, _):
        return struct.unpack("i", fcntl.ioctl(cls.keyboard, termios.FIONREAD, bytes(4)))[0] > 0

    @classmethod
    def results_path(cls):
        return os.path.join(results_folder(), cls.__name__ + ".json")

    @classmethod
    def forget(cls):
        if os.path.exists(cls.results_path()):
            os.unlink(cls.results_path())

    @classmethod
    def remember(cls):
        os.makedirs(results_folder(), exist_ok=True)
        with open(cls.results_path(), "w") as file:
            json.dump({"sandbox": cls.sandbox, "variant": cls.variant, "outcomes": cls.outcomes}, file, indent=1)

    def check(self, name):
        found = self.outcomes[name]
        if found == NOT_HERE:
            self.skipTest(found)
        self.assertIn(found, self.expected.get(name) or self.usual(ATTEMPTS[name]))

    @classmethod
    def usual(cls, attempt):
        """The outcomes that an attempt must have."""
        return attempt.refusals

    def test_it_works_in_its_own_folder(self):
        self.assertTrue(self.said["own"])

    def test_the_pictures_of_its_own_simulation_are_seen(self):
        self.assertTrue(self.is_seen)

    def test_the_monitor_says_what_shuts_it_in(self):
        self.assertIn(self.description, self.server.get("/monitor"))


def _add_test(name):
    def test(self):
        self.check(name)

    test.__doc__ = f"{ATTEMPTS[name].title}: to {sandbox_attempts.ROWS[ATTEMPTS[name].row]}"
    setattr(Contract, f"test_attempt_{name}", test)


for _each in ATTEMPTS:
    _add_test(_each)


class Unwalled(Contract):
    """Without a sandbox the attempts succeed where nothing else forbids them: which shows what they are worth. The guard's namespaces and
    what it leaves of root's capabilities keep out some of it all the same."""

    has_network = False
    rows_kept_out = ("see", "signal", "trace", "outlive", "calls", "routes", "terminal", "control_group", "set_user_id", "mounts")
    expected = {"enter_namespace": ("EPERM", "EACCES"), "read_physical_memory": ("EPERM", "EACCES"), "ask_as_operator": ("refused",)}

    @classmethod
    def usual(cls, attempt):
        return attempt.refusals if attempt.row in cls.rows_kept_out else (DONE,)
