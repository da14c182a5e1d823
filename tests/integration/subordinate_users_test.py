#!/usr/bin/python3
"""Where the server is not root, but /etc/subuid gives its user numbers, or root has made users for its service, its simulations run as other
users: what they can't do even where nothing else confines them, and that the server is still master of their files.

The lines of /etc/subuid are seen by these servers alone: each has a mount namespace with files of its own there.
"""

import asyncio
import contextlib
import json
import os
import signal
import shutil
import stat
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
sys.path.insert(0, os.path.dirname(__file__))
from simulation_user_test import ATTACK, OUTSIDE, WORLD, Attack, users_of  # noqa: E402
from support.browser_client import Browser  # noqa: E402
from support.other_user import AS_OF_A_UNIT, FIRST, GREEDY_USER, NOBODY, PINNED, RANGE, OwnedServer, ServiceServer, as_nobody_with_numbers, require_subordinate_users  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import SimulationServer, is_alive, main, program, wait_until  # noqa: E402

NEIGHBOUR = "local:/projects/neighbour/blob/main/worlds/arena.wbt"
HOSTILE = "local:/projects/hostile/blob/main/worlds/hostile.wbt"
FILLING = "local:/projects/filling/blob/main/worlds/hostile.wbt"
GREEDY = "local:/projects/greedy/blob/main/worlds/hostile.wbt"
DISK = 10  # MB
# What it leaves is to be hard to remove; and it leads who puts files back to a folder of the server's.
LITTER = r'''
here = os.getcwd()
for _ in range(50):
    os.mkdir("deep")
    os.chdir("deep")
os.chdir(here)
os.makedirs("locked/inner")
open("locked/inner/file", "w").close()
os.chmod("locked/inner/file", 0)
os.chmod("locked/inner", 0)
os.chmod("locked", 0)
with open("attack", "a") as file:
    file.write("# changed")
import shutil, subprocess
def privileges(*command):
    return subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL).stdout
def become(user, group):
    os.chown("shell", user, group)
SHOW = "-pc", "grep -E '^(Uid|Gid|CapPrm|CapEff)' /proc/self/status"  # -p: it would give back itself what it has gained
own, group = os.getuid(), os.getgid()
shutil.copy("/bin/sh", "shell")
said = {"given": [each for each in ([0, -1], [-1, 0], [own + 1, -1], [-1, group + 1]) if can(become, *each)]}
os.chmod("shell", 0o6755)
said["without"], said["with"] = privileges("/bin/sh", *SHOW), privileges("./shell", *SHOW)
su = subprocess.Popen(["su"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
with open(f"/proc/{su.pid}/status") as status:
    said["su"] = "".join(line for line in status if line.startswith(("Uid", "Gid", "CapPrm", "CapEff")))
su.kill()
with open("set_user_id", "w") as file:
    json.dump(said, file)
os.remove("../linked/file")
os.rmdir("../linked")
os.symlink(targets["link"], "../linked")
os.chmod("..", 0o700)
'''
FILL = r'''#!/usr/bin/python3
import os, signal
os.mkdir("hidden", 0o700)
for i in range(3):
    with open(f"hidden/{i}", "wb") as file:
        file.write(b"x" * (8 << 20))
signal.pause()
'''
# Takes all watches (epoll) that the kernel gives its user, with as many processes as that needs, and holds them.
GREED = r'''#!/usr/bin/python3
import errno, json, os, select, signal, time
end = time.monotonic() + 60
held = []
def take():
    source = os.eventfd(0)
    copies = [os.dup(source) for _ in range(1500)]
    while time.monotonic() < end and len(held) < 1500:
        held.append(select.epoll())
        for copy in copies:
            try:
                held[-1].register(copy, 0)
            except OSError as error:
                return errno.errorcode[error.errno]
    return "not all"
for _ in range(15):
    reading, writing = os.pipe()
    if os.fork() == 0:
        os.write(writing, take().encode())
        signal.pause()
    said = os.read(reading, 100).decode()
    if said != "not all":
        break
with open("taking", "w") as file:
    json.dump(said, file)
os.rename("taking", "taken")
signal.pause()
'''


def setUpModule():
    require_subordinate_users()


def frame(address):
    """Whether the simulator at this address serves a picture."""
    return Attack.frame(int(address.rpartition(":")[2]))


def subordinate_server(lines=RANGE, mask="022", **keys):
    return with_projects(OwnedServer(NOBODY, as_nobody_with_numbers(lines, mask), True, **common(keys)))


def service_server(mask="022", user=NOBODY, **keys):
    return with_projects(ServiceServer(mask, user, **common(keys)))


def common(keys):
    return {"simulationUser": "auto", "debug": False, "simulationDisk": DISK, "display": "none", **keys}


def with_projects(made):
    folder = os.path.join(made.folder, "projects")
    files = {os.path.join("neighbour", path): content for path, content in demo_project().items()}
    for name, controller in (("hostile", ATTACK + LITTER), ("filling", FILL), ("greedy", GREED)):
        files[f"{name}/worlds/hostile.wbt"] = WORLD.encode()
        files[f"{name}/controllers/attack/attack"] = controller.encode()
    files["hostile/controllers/linked/file"] = b"pristine"
    for path, content in files.items():
        path = os.path.join(folder, "projects", path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(content)
        os.chmod(path, 0o755)
    made.config.update(forges=[{"url": "local:", "directory": folder}], allowedRepositories=["local:/projects"])
    return made


def log_of(server):
    with open(os.path.join(server.folder, "log", "simulation", "output.log")) as file:
        return file.read() + server.log()


def monitor_of(server):
    return wait_until(lambda: server.get("/monitor"), "there is no /monitor")


def guards(server):
    found = []
    for pid in server.simulators():
        with contextlib.suppress(OSError), open(f"/proc/{pid}/comm") as name:
            if name.read().startswith("webots-process"):
                found.append(pid)
    return found


def set_user_ids(folder):
    """Users and groups as whom programs below would run."""
    found = set()
    for path, _, names in os.walk(folder):
        for status in (os.lstat(os.path.join(path, name)) for name in names):
            if status.st_mode & (stat.S_ISUID | stat.S_ISGID):
                found.update((status.st_uid, status.st_gid))
    return found


def taken_by_the_only_one(server):
    """What has ended the greed of the simulation that runs."""
    place = os.path.join(server.instances_folder(), server.instances()[0], "controllers", "attack", "taken")
    wait_until(lambda: os.path.exists(place), lambda: f"it takes nothing:\n{log_of(server)}", 90)
    with open(place) as file:
        return json.load(file)


class Attacked(Attack):
    """The attempts of simulation_user_test, and what only such users make hard."""

    mask = "022"  # of the server (umask)
    make_server = staticmethod(subordinate_server)
    first = FIRST  # of the numbers

    @classmethod
    def setUpClass(cls):
        cls.server = cls.make_server(mask=cls.mask, **{"display": ":0", **cls.keys})
        cls.addClassCleanup(cls.server.close)
        folder = cls.server.folder
        secrets = [os.path.join(folder, name) for name in ("key.pem", "operator-token", "authority")]
        for path in secrets:
            with open(path, "w") as file:
                file.write("secret")
            os.chmod(path, 0o600)
        cls.server.environment["XAUTHORITY"] = secrets[2]
        os.chmod(folder, cls.mode)
        cls.server.configure()
        os.chmod(os.path.join(folder, "config.json"), 0o600)
        cls.other = cls.make_server(**cls.keys)
        cls.addClassCleanup(cls.other.close)
        cls.other.start()
        instances = cls.server.instances_folder()
        cls.neighbour = os.path.join(instances, "1")
        log = os.path.join(folder, "log", "simulation", "output.log")
        path = os.path.join(folder, "projects/projects/hostile/controllers/attack/targets.json")
        cls.server.start()
        cls.targets = {
            "read": [*secrets, os.path.join(folder, "config.json"), log, "/etc/shadow", os.path.join(cls.neighbour, "worlds/arena.wbt"),
                     f"/proc/{cls.server.process.pid}/environ"],
            "write": [log, os.path.join(instances, "planted"), os.path.join(folder, "planted"), "/usr/planted",
                      os.path.join(cls.neighbour, "worlds/arena.wbt")],
            "list": [instances, cls.neighbour, os.path.join(cls.server.state_folder(), str(cls.server.port))],
            "signal": [cls.server.process.pid], "link": folder}
        with open(path, "w") as file:
            json.dump(cls.targets, file)
        os.chmod(path, 0o644)
        asyncio.run(cls.attack())

    @classmethod
    async def attack(cls):
        async with Browser(cls.other) as others:
            await others.start(NEIGHBOUR)
            cls.others_address = await others.hear("webots:")
            async with Browser(cls.server) as neighbour, Browser(cls.server) as browser:
                await neighbour.start(NEIGHBOUR)
                address = await neighbour.hear("webots:")
                before = cls.server.simulators()
                await browser.start(HOSTILE)
                await browser.hear("webots:")
                place = os.path.join(cls.server.instances_folder(), "2", "controllers")
                wait_until(lambda: os.path.islink(os.path.join(place, "linked")), lambda: f"it does not attack:\n{log_of(cls.server)}")
                with open(os.path.join(place, "attack", "said")) as file:
                    cls.said = json.load(file)
                with open(os.path.join(place, "attack", "set_user_id")) as file:
                    cls.set_user_id = json.load(file)
                cls.neighbours = users_of(before)
                number = os.lstat(os.path.join(place, "attack", "said")).st_uid
                cls.outer_number = number
                cls.outside = json.loads(subprocess.run(
                    ["setpriv", f"--reuid={number}", f"--regid={number}", "--clear-groups", sys.executable, "-c", OUTSIDE,
                     json.dumps({"processes": [cls.server.process.pid, *before], "folder": cls.neighbour, "socket": cls.operator_socket()})],
                    check=True, capture_output=True, text=True, cwd="/").stdout)
                cls.monitor = monitor_of(cls.server)
                await cls.put_back(browser, place)
                cls.alive = await frame(address)
                cls.planted = [each for each in cls.targets["write"] if each.endswith("planted") and os.path.exists(each)]
            cls.server.wait_until_clean()
            await cls.attack_more()
            await cls.kill_guard()
            await cls.kill_server()
            cls.others_alive = await frame(cls.others_address)
            cls.other_instances = cls.other.instances()
        cls.other.wait_until_clean()

    @classmethod
    def operator_socket(cls):
        return cls.server.operator_socket().replace(f"webots-{os.geteuid()}", f"webots-{NOBODY}")

    @classmethod
    async def put_back(cls, browser, place):
        await browser.socket.send(json.dumps({"reset controller": "attack/attack"}))
        await browser.hear("reset controller: attack/attack")
        path = os.path.join(place, "attack", "attack")
        with open(path) as file:
            cls.restored = file.read()
        status = os.lstat(path)
        cls.restored_as = (status.st_uid, status.st_gid, status.st_mode & 0o777)
        await browser.socket.send(json.dumps({"reset controller": "linked/file"}))
        cls.refusal = await browser.hear("loading: Error:")
        cls.led_astray = os.path.exists(os.path.join(cls.server.folder, "file"))
        cls.scratch = [name for name in cls.server.instances() if name.startswith("restored")]

    @classmethod
    async def attack_more(cls):
        """Where a sandbox makes no difference, without one alone."""

    @classmethod
    async def kill_guard(cls):
        """Then nobody gives the folder back."""
        async with Browser(cls.server) as browser:
            await browser.start(NEIGHBOUR)
            await browser.hear("webots:")
            for pid in guards(cls.server):
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            await browser.hear_all()
        cls.server.wait_until_clean()

    @classmethod
    async def kill_server(cls):
        """First with its guards, so that nobody gives back anything before its next start; then alone."""
        for with_guards in (True, False):
            async with Browser(cls.server) as browser:
                await browser.start(HOSTILE)
                await browser.hear("webots:")
                instance = os.path.join(cls.server.instances_folder(), cls.server.instances()[0])
                wait_until(lambda: os.path.islink(os.path.join(instance, "controllers", "linked")), "it leaves nothing")
                tree = cls.server.simulators()
                cls.server.process.send_signal(signal.SIGSTOP)
                for pid in guards(cls.server) if with_guards else ():
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(pid, signal.SIGKILL)
                cls.server.process.kill()
                cls.server.process.wait()
            wait_until(lambda: not any(is_alive(pid) for pid in tree), "processes are left")
            if with_guards:
                cls.left = os.lstat(instance).st_uid
            else:
                cls.given_back = os.lstat(instance).st_uid
                cls.set_user_ids = set_user_ids(instance)
            SimulationServer.start(cls.server)  # not OwnedServer's: that changes owners
            wait_until(lambda: not cls.server.instances(), lambda: f"directories are left: {cls.server.instances()}\n{log_of(cls.server)}")

    def test_it_is_a_user_whom_nobody_else_is(self):
        real, effective, group = self.said["user"]
        self.assertEqual((effective, group), (real, real))
        self.assertNotEqual(real, 0)
        self.assertEqual(self.outer_number, self.first + real - 1)
        self.assertNotIn(self.outer_number, self.neighbours)
        self.assertTrue([user for user in self.neighbours if self.first <= user < self.first + 65536], self.neighbours)
        self.assertEqual(self.said["groups"], [real])
        self.assertFalse(self.said["become root"])

    def test_its_files_are_its_own(self):
        self.assertTrue(self.said["own"])

    def test_the_log_says_so(self):
        self.assertIn("Simulations run as other users than this server, each with a number of its own.", log_of(self.server))
        self.assertIn("; another user for each simulation", self.monitor)

    def test_a_file_is_put_back_as_its_own(self):
        self.assertEqual(self.restored, ATTACK + LITTER)
        self.assertEqual(self.restored_as, (self.outer_number, self.outer_number, 0o755))
        self.assertEqual(self.scratch, [])

    def test_no_file_is_put_where_a_link_leads(self):
        self.assertFalse(self.led_astray)
        self.assertTrue(self.refusal)

    def test_what_killed_servers_and_guards_leave_is_removed(self):
        self.assertGreaterEqual(self.left, self.first)  # nobody had given it back

    def test_set_user_id_programs_give_it_nothing(self):
        said = self.set_user_id
        self.assertEqual(said["given"], [], "it has made a file that of another user or group")
        self.assertIn("Uid:", said["without"])
        self.assertEqual(said["with"], said["without"])
        self.assertEqual(said["su"], said["without"])

    def test_no_set_user_id_program_of_its_own_becomes_the_servers_when_its_folder_does(self):
        self.assertEqual(self.given_back, NOBODY)
        self.assertEqual(len(self.set_user_ids), 1, self.set_user_ids)
        self.assertGreaterEqual(self.set_user_ids.pop(), self.first)

    def test_another_server_of_the_same_user_is_not_disturbed(self):
        self.assertTrue(self.others_alive)
        self.assertEqual(self.other_instances, ["1"])


class WithoutSandbox(Attacked, unittest.TestCase):
    keys = {"sandbox": "none"}

    @classmethod
    async def attack_more(cls):
        """What the server itself can't look into counts."""
        async with Browser(cls.server) as browser:
            await browser.start(FILLING)
            cls.filled = await browser.hear("loading: Error:")
        cls.server.wait_until_clean()

    def test_what_only_it_can_look_into_counts(self):
        self.assertIn(f"more than {DISK} MB", self.filled)


class InBubblewrap(Attacked, unittest.TestCase):
    keys = {"sandbox": "bubblewrap", "network": "none", "simulationUser": "subordinate"}
    mode = 0o700  # the way to its own files leads through a folder that it may not enter
    mask = "077"  # also for what is made for others on that way
    has_folders_in_memory = True

    @classmethod
    def setUpClass(cls):
        if not os.access("/usr/bin/bwrap", os.X_OK):
            raise unittest.SkipTest("bubblewrap is not installed")
        super().setUpClass()


class OfAService(Attacked, unittest.TestCase):
    """Root has made its users, as ExecStartPre= of the unit does, since the service can't gain privileges."""

    keys = {"sandbox": "none", "simulationUser": "subordinate"}
    make_server = staticmethod(service_server)
    first = PINNED

    @classmethod
    async def attack_more(cls):
        """What its user may have of the kernel is not the server's: by then it has all of that."""
        async with Browser(cls.server) as browser:
            await browser.start(GREEDY)
            await browser.hear("webots:")
            cls.taken = taken_by_the_only_one(cls.server)
            async with Browser(cls.server) as neighbour:
                await neighbour.start(NEIGHBOUR)
                cls.started_beside = await frame(await neighbour.hear("webots:"))
            cls.answers = [cls.server.get("/load") for _ in range(50)]
        cls.server.wait_until_clean()

    def test_a_simulation_that_takes_all_watches_of_its_user_leaves_the_server_its_own(self):
        self.assertEqual(self.taken, "ENOSPC")
        self.assertTrue(self.started_beside)
        self.assertNotIn(None, self.answers)
        self.assertNotIn("Can't accept a connection", log_of(self.server))


class OfAServiceInBubblewrap(InBubblewrap):
    """As its unit runs it where bubblewrap is installed."""

    make_server = staticmethod(service_server)
    first = PINNED


class Pinned(unittest.TestCase):
    """What root makes for a service, as its unit says."""

    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)
        self.addCleanup(self.guard, "--unpin-users")
        os.chown(self.folder, NOBODY, NOBODY)
        self.file = f"{self.folder}.users"

    def guard(self, option, user=None, folder=None):
        done = subprocess.run([*(() if user else AS_OF_A_UNIT), program("webots-process-guard"), option, folder or self.folder], capture_output=True, text=True,
                              timeout=30, user=user)
        return done.returncode, done.stderr

    def mounts(self):
        with open("/proc/self/mountinfo") as mounts:
            return [line.split()[3] for line in mounts if line.split()[4] == self.file]

    def enter(self, user):
        """The maps of users as a program sees them that enters the namespace as a service's can."""
        done = subprocess.run(["setpriv", f"--reuid={user}", f"--regid={user}", "--clear-groups", "--no-new-privs", "--bounding-set=-all",
                               "nsenter", f"--user={self.file}", "cat", "/proc/self/uid_map", "/proc/self/gid_map"], capture_output=True, text=True)
        return [list(map(int, line.split())) for line in done.stdout.splitlines()]

    def test_the_owner_of_the_folder_may_enter_it_and_nobody_else(self):
        self.assertEqual(self.guard("--pin-users"), (0, ""))
        maps = [[0, NOBODY, 1], [1, PINNED, 65536]]
        self.assertEqual(self.enter(NOBODY), maps + maps)
        self.assertEqual(self.enter(NOBODY - 1), [])

    def test_nothing_stays_of_one_that_is_made_again_or_removed(self):
        self.guard("--pin-users")
        first = self.mounts()
        self.assertRegex("".join(first), r"^user:\[\d+\]$")
        self.addCleanup(os.close, os.open(self.file, os.O_RDONLY))  # while the first one lives, no other has its number
        self.assertEqual(self.guard("--pin-users"), (0, ""))
        self.assertEqual(len(self.mounts()), 1)
        self.assertNotEqual(self.mounts(), first)
        self.assertEqual(self.guard("--unpin-users"), (0, ""))
        self.assertEqual((self.mounts(), os.path.lexists(self.file)), ([], False))
        self.assertEqual(self.guard("--unpin-users"), (0, ""))

    def test_what_others_have_put_there_is_replaced_and_links_lead_nowhere(self):
        target = os.path.join(self.folder, "target")
        with open(target, "w"):
            os.symlink(target, self.file)
        self.assertEqual(self.guard("--pin-users"), (0, ""))
        self.assertFalse(os.path.islink(self.file))
        self.assertEqual(os.stat(target).st_size, 0)
        self.guard("--unpin-users")
        os.mkdir(self.file)
        self.addCleanup(os.rmdir, self.file)
        status, said = self.guard("--pin-users")
        self.assertEqual(status, 1)
        self.assertIn(f"simulations will share the server's user: {self.file}: what is there can't be removed: ", said)

    def test_a_folder_of_roots_stays_as_it_is(self):
        os.chown(self.folder, 0, 0)
        self.assertEqual(self.guard("--pin-users"), (0, ""))
        self.assertFalse(os.path.lexists(self.file))

    def test_the_folder_can_be_given_to_another_user_as_systemd_does(self):
        self.guard("--pin-users")
        subprocess.run(["chown", "--recursive", f"{NOBODY - 1}:{NOBODY - 1}", self.folder], check=True)
        self.assertEqual(self.guard("--pin-users"), (0, ""))
        self.assertEqual(self.enter(NOBODY), [])
        self.assertEqual(self.enter(NOBODY - 1)[0], [0, NOBODY - 1, 1])

    def test_two_users_do_not_have_the_same_numbers(self):
        rival = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, rival)
        os.chown(rival, NOBODY - 1024, NOBODY - 1024)
        self.assertEqual(self.guard("--pin-users"), (0, ""))
        self.addCleanup(self.guard, "--unpin-users", folder=rival)
        status, said = self.guard("--pin-users", folder=rival)
        self.assertEqual(status, 1)
        self.assertIn(f"simulations will share the server's user: a service of user {NOBODY} has the numbers of user {NOBODY - 1024}", said)
        self.assertFalse(os.path.lexists(f"{rival}.users"))
        os.chown(rival, NOBODY, NOBODY)  # one user's servers share their numbers
        self.assertEqual(self.guard("--pin-users", folder=rival), (0, ""))
        os.chown(rival, NOBODY - 1024, NOBODY - 1024)
        self.guard("--unpin-users")
        self.assertEqual(self.guard("--pin-users", folder=rival), (0, ""))

    def test_who_is_not_root_is_told_that_this_is_roots_affair(self):
        os.chmod(self.folder, 0o777)
        status, said = self.guard("--pin-users", NOBODY)
        self.assertEqual(status, 1)
        self.assertIn("simulations will share the server's user", said)
        self.assertEqual(self.mounts(), [])


class Choice(unittest.IsolatedAsyncioTestCase):
    """What the key says, and what becomes of it."""

    async def test_where_there_is_no_range_the_server_says_which_line_to_add(self):
        with subordinate_server("ada:300000:65536\n") as simulation:
            async with Browser(simulation) as browser:
                await browser.start(NEIGHBOUR)
                await browser.hear("webots:")
                self.assertEqual(users_of(simulation.simulators()), {NOBODY})
            told = 'add the line "nobody:365536:65536" to /etc/subuid and to /etc/subgid'
            self.assertIn(f"Simulations run as this server's own user. For other users: {told}", log_of(simulation))
            self.assertIn(json.dumps(told)[1:-1], monitor_of(simulation))
            simulation.wait_until_clean()

    async def test_a_service_without_users_runs_and_says_what_that_means(self):
        simulation = service_server()
        self.addCleanup(simulation.close)
        simulation.guard = lambda option: ""
        simulation.start()
        log = log_of(simulation)
        self.assertIn("Simulations run as this server's own user. For other users: no_new_privs, as systemd's NoNewPrivileges= sets it, forbids "
                      f"newuidmap, and there is no {simulation.runtime}.users", log)
        self.assertIn("Each of them can take all that the kernel gives this server's user, epoll watches above all", log)
        doctor = subprocess.run([*simulation.wrapper, simulation.program(), "--doctor", "--json", os.path.join(simulation.folder, "config.json")],
                                env={**os.environ, "TMPDIR": os.path.join(simulation.folder, "tmp"), **simulation.environment}, capture_output=True,
                                text=True, timeout=60, cwd=simulation.folder)
        user = next(each for each in json.loads(doctor.stdout)["findings"] if each["subject"] == "user")
        self.assertEqual(user["verdict"], "warning")
        self.assertIn("each of them can take all that the kernel gives this server's user", user["found"])

    async def test_where_a_simulation_shares_the_servers_user_and_takes_all_watches_pages_are_served_from_a_reserve(self):
        simulation = service_server(user=GREEDY_USER)
        self.addCleanup(simulation.close)
        simulation.guard = lambda option: ""
        simulation.start()
        async with Browser(simulation) as browser:
            await browser.start(GREEDY)
            await browser.hear("webots:")
            self.assertEqual(taken_by_the_only_one(simulation), "ENOSPC")
            answers = [simulation.get("/load") for _ in range(100)]
            self.assertIn("the server's own user", simulation.get("/monitor"))
            async with Browser(simulation) as another:
                await another.start(NEIGHBOUR)
                self.assertIn("Unable to start Webots: other programs of the server's user have all watches (epoll)", await another.hear("loading: Error:"))
        self.assertNotIn(None, answers)
        self.assertNotIn("Can't accept a connection", log_of(simulation))
        simulation.wait_until_clean()

    async def test_the_operator_may_want_the_servers_own_user(self):
        with subordinate_server(simulationUser="none") as simulation:
            async with Browser(simulation) as browser:
                await browser.start(NEIGHBOUR)
                await browser.hear("webots:")
                self.assertEqual(users_of(simulation.simulators()), {NOBODY})

    async def test_a_display_that_may_admit_the_server_alone_is_not_lost(self):
        with subordinate_server(display=":0") as simulation:
            self.assertIn("For other users: the display :0 has no password (XAUTHORITY) that they could be given", log_of(simulation))

    def refused(self, simulation):
        self.addCleanup(simulation.close)
        with self.assertRaises(AssertionError):
            simulation.start()
        return simulation.log()

    def test_who_asks_for_them_gets_them_or_is_told_why_not(self):
        self.assertIn('"simulationUser": "subordinate" does not work here: add the line "nobody:100000:65536" to /etc/subuid',
                      self.refused(subordinate_server("", simulationUser="subordinate", debug=True)))
        self.assertIn('"simulationUser": "subordinate" is for servers that are not root',
                      self.refused(OwnedServer(simulationUser="subordinate")))


if __name__ == "__main__":
    main()
