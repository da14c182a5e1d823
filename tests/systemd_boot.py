"""The units of config/systemd under a systemd that runs them. Only for the Debian that tests/systemd_boot.sh boots: it rules that machine."""

import contextlib
import json
import logging
import os
import pwd
import shutil
import signal
import subprocess
import sys
import unittest
import urllib.request

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from support.browser_client import LOCAL, Browser  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import is_alive, wait_until  # noqa: E402

PORTS = {"session": 1999, "simulation": 2000}


def systemctl(*arguments):
    return subprocess.run(["systemctl", *arguments], check=True, capture_output=True, text=True, timeout=60).stdout.strip()


def user_of(process):
    with open(f"/proc/{process}/status") as status:  # the file of a process that nobody may trace is root's
        return next(int(line.split()[1]) for line in status if line.startswith("Uid:"))


def owned_by(user):
    """Living processes of a user."""
    found = []
    for entry in os.listdir("/proc"):
        with contextlib.suppress(OSError):
            if entry.isdigit() and user_of(entry) == user and is_alive(int(entry)):
                found.append(int(entry))
    return found


def pinned():
    """Files to which user namespaces are pinned."""
    with open("/proc/self/mountinfo") as mounts:
        return [line.split()[4] for line in mounts if line.split()[3].startswith("user:")]


class Unit:
    """One of the two services."""

    def __init__(self, kind):
        self.name = f"webots-{kind}-server.service"
        self.address = f"localhost:{PORTS[kind]}"
        self.url = f"http://{self.address}"
        self.config = f"/etc/webots-cloud/{kind}.json"
        self.folder = f"/var/lib/webots-cloud/{kind}"
        self.log_path = f"{self.folder}/log/{kind}/output.log"
        self.drop_in = f"/etc/systemd/system/{self.name}.d/test.conf"

    def show(self, name):
        return systemctl("show", "--value", f"--property={name}", self.name)

    @property
    def main(self):
        return int(self.show("MainPID"))

    @property
    def control_group(self):
        return f"/sys/fs/cgroup/system.slice/{self.name}"

    def processes(self):
        """In its control group, and in those that the server makes in there."""
        found = []
        for folder, _, _ in os.walk(self.control_group):
            with contextlib.suppress(OSError), open(os.path.join(folder, "cgroup.procs")) as file:  # it may be removed meanwhile
                found += map(int, file)
        return sorted(found)

    def simulators(self):
        return [process for process in self.processes() if process != self.main]

    def sees(self, folder):
        """What is in a folder as the server has it."""
        return os.listdir(os.path.join("/proc", str(self.main), "root", folder.lstrip("/")))

    def get(self, path, headers=None):
        """The body of an answer; None without an answer."""
        request = urllib.request.Request(self.url + path, headers=headers or {})
        with contextlib.suppress(OSError), urllib.request.urlopen(request, timeout=10) as answer:
            return answer.read().decode()

    def configure(self, **keys):
        with open(self.config) as file:
            config = json.load(file)
        with open(self.config, "w") as file:
            json.dump({**config, **keys}, file)

    def override(self, *lines):
        """Settings of [Service], as `systemctl edit` writes them; none: the unit as it is installed. For the next start."""
        with contextlib.suppress(FileNotFoundError):
            os.remove(self.drop_in)
        if lines:
            os.makedirs(os.path.dirname(self.drop_in), exist_ok=True)
            with open(self.drop_in, "w") as file:
                file.write("\n".join(["[Service]", *lines, ""]))
        systemctl("daemon-reload")

    def restart(self):
        systemctl("restart", self.name)

    def wait_for_another_than(self, process):
        """Waits until systemd has started it again."""
        wait_until(lambda: self.main not in (0, process) and self.show("ActiveState") == "active", f"{self.name} is not started again")

    def logged(self):
        with open(self.log_path) as file:
            return file.read()


class Units(unittest.IsolatedAsyncioTestCase):
    session = Unit("session")
    simulation = Unit("simulation")
    both = (session, simulation)

    @classmethod
    def setUpClass(cls):
        """What docs/operations.md leaves to the operator: names, and the projects that are allowed."""
        cls.session.configure(server="localhost", ssl=False, portRewrite=False, loadRefresh=0.5, loadThreshold=1000,
                              simulationServers=[cls.simulation.address])
        cls.simulation.configure(server="localhost", ssl=False, portRewrite=False, **LOCAL)
        cls.configured = {}
        for unit in cls.both:
            with open(unit.config) as file:
                cls.configured[unit] = json.load(file)

    def setUp(self):
        for unit in self.both:
            unit.override()
            with open(unit.config, "w") as file:
                json.dump(self.configured[unit], file)
            systemctl("reset-failed")
            unit.restart()

    async def start(self, browser):
        """Starts a simulation; returns its address."""
        await browser.start()
        return (await browser.hear("webots:")).partition(":")[2]

    async def check_replaced_after(self, what):
        """Sends the simulation server a signal while a simulation runs: systemd starts another, and of the old one no process is left."""
        main = self.simulation.main
        async with Browser(self.simulation) as browser:
            await self.start(browser)
            old = self.simulation.processes()
            os.kill(main, what)
            self.simulation.wait_for_another_than(main)
            self.assertEqual([process for process in old if is_alive(process)], [])

    def test_both_are_active_and_answer(self):
        for unit in self.both:
            with self.subTest(unit.name):
                self.assertEqual(unit.show("Type"), "notify")
                self.assertEqual(unit.show("ActiveState"), "active")
                self.assertEqual(systemctl("is-enabled", unit.name), "enabled")
                self.assertIsNotNone(unit.get("/load"))
        wait_until(lambda: self.session.get("/session") == f"ws://{self.simulation.address}", "no session is offered")

    def test_root_asks_the_running_servers_over_their_sockets(self):
        def ask(unit, option):
            program = f"/usr/local/bin/{unit.name.removesuffix('.service')}"
            return subprocess.run([program, option, unit.config], capture_output=True, text=True, timeout=60).stdout.strip()

        self.assertIn("decisions", json.loads(ask(self.session, "--decisions", "--json")))
        self.assertEqual(ask(self.simulation, "--drain"), "draining")
        self.assertEqual(ask(self.simulation, "--resume"), "serving")

    def test_simulations_are_kept_apart_under_the_unit(self):
        """Ready means that the sandbox was tried, and kept what it promises."""
        with urllib.request.urlopen(f"{self.simulation.url}/readyz") as answer:
            self.assertEqual(answer.read().decode(), "ready")

    def test_they_run_without_privileges_and_with_short_turns_of_their_event_loop(self):
        for unit in self.both:
            with self.subTest(unit.name):
                with open(f"/proc/{unit.main}/status") as file:
                    status = dict(line.strip().split(":\t", 1) for line in file if ":\t" in line)
                self.assertNotIn("0", status["Uid"].split())
                self.assertEqual([status["CapBnd"].strip("0"), status["NoNewPrivs"], status["Seccomp"]], ["", "1", "2"])
                with open(f"/proc/{unit.main}/sched") as file:
                    slices = [line.split()[-1] for line in file if line.startswith("se.slice ")]
                self.assertIn(slices, [["100000"], []], "nanoseconds; kernels without EEVDF have none")

    async def test_a_browser_starts_a_simulation_which_lives_in_namespaces_of_its_own_and_ends_with_it(self):
        async with Browser(self.simulation) as browser:
            address = await self.start(browser)
            self.assertRegex(address, "^ws://localhost:2000/simulation/[a-z]{28}/2001$")
            guard, *others = self.simulation.simulators()
            named = {}
            for process in others:
                with open(f"/proc/{process}/comm") as file:
                    named[file.read().strip()] = process
            simulator = named["webots-demo-sim"]  # a name has 15 characters
            for name in ("pid", "user", "mnt", "net"):
                server, of_guard, of_simulator = (os.readlink(f"/proc/{process}/ns/{name}")
                                                  for process in (self.simulation.main, guard, simulator))
                (self.assertNotEqual if name == "user" else self.assertEqual)(of_guard, server)
                self.assertNotIn(of_simulator, (server, of_guard))
            self.assertIn("bwrap", named)
            self.assertIn("slirp4netns", named)
            self.assertIn(self.simulation.address, self.session.get("/monitor"))
        wait_until(lambda: not self.simulation.simulators(), "processes of the simulation are left")

    async def check_has_users_of(self, name):
        """A simulation runs as a number that the unit gives to those of this user."""
        async with Browser(self.simulation) as browser:
            await self.start(browser)
            users = {user_of(process) for process in self.simulation.simulators()}
        own = pwd.getpwnam(name).pw_uid
        first = 0x74000000 + own % 1024 * 65536
        self.assertEqual([user for user in users if user != own], [first + 2001], users)  # its port
        wait_until(lambda: not self.simulation.simulators(), "processes of the simulation are left")

    async def test_each_simulation_has_a_user_of_its_own_and_that_goes_with_the_service(self):
        await self.check_has_users_of("webots-cloud")
        self.assertIn("; another user for each simulation", self.simulation.get("/monitor"))
        self.assertEqual(pinned(), ["/run/webots-cloud/simulation.users"])
        main = self.simulation.main
        os.kill(main, signal.SIGKILL)
        self.simulation.wait_for_another_than(main)
        self.assertEqual(pinned(), ["/run/webots-cloud/simulation.users"])
        await self.check_has_users_of("webots-cloud")
        systemctl("stop", self.simulation.name)
        self.assertEqual(pinned(), [])
        self.assertEqual([name for name in os.listdir("/run/webots-cloud") if name.startswith("simulation")], [])

    async def test_a_service_of_another_user_has_users_too(self):
        subprocess.run(["useradd", "--create-home", "teacher"], check=True)
        self.addCleanup(subprocess.run, ["userdel", "--remove", "teacher"], check=True, capture_output=True)
        self.addCleanup(systemctl, "stop", self.simulation.name)
        self.simulation.override("User=teacher")
        self.simulation.restart()
        await self.check_has_users_of("teacher")

    async def test_where_they_can_not_be_made_the_server_runs_and_says_so(self):
        before = self.simulation.logged()
        self.simulation.override("ExecStartPre=", "ExecStartPre=-+/bin/false")
        self.simulation.restart()
        async with Browser(self.simulation) as browser:
            await self.start(browser)
            own = pwd.getpwnam("webots-cloud").pw_uid
            self.assertEqual({user_of(process) for process in self.simulation.simulators()}, {own})
        self.assertIn("Simulations run as this server's own user. For other users: no_new_privs", self.simulation.logged()[len(before):])
        self.assertEqual(self.examined("user")["verdict"], "warning")

    def examined(self, subject):
        """What root's doctor says of it."""
        done = subprocess.run(["/usr/local/bin/webots-simulation-server", "--doctor", "--json", self.simulation.config], capture_output=True,
                              text=True, timeout=60)
        return {each["subject"]: each for each in json.loads(done.stdout)["findings"]}[subject]

    def test_the_doctor_of_the_service_has_users_too_and_leaves_none(self):
        for is_running in (True, False):
            with self.subTest(is_running=is_running):
                found = self.examined("user")
                self.assertEqual((found["verdict"], found["found"]), ("ok", "simulations run as another user for each simulation"))
                self.assertEqual(pinned(), ["/run/webots-cloud/simulation.users"] if is_running else [])
                self.assertEqual([name for name in os.listdir("/run/webots-cloud") if name.startswith("doctor")], [])
                systemctl("stop", self.simulation.name)

    async def test_a_project_is_fetched_with_git(self):
        with GitServer() as git:
            git.add_repository("school", "class", demo_project())
            self.simulation.configure(forges=[git.url], allowedRepositories=[git.url])
            self.simulation.restart()
            async with Browser(self.simulation) as browser:
                await browser.start(f"{git.url}/school/class/blob/main/worlds/arena.wbt")
                await browser.hear("webots:")
            self.assertTrue(git.requests())
            self.assertTrue(os.listdir("/var/cache/webots-cloud/simulation"))

    def test_simulations_can_not_read_what_the_session_server_is_told(self):
        replaced = self.session.config + ".new"
        status = os.stat(self.session.config)
        self.assertEqual(status.st_mode & 0o007, 0)
        shutil.copy(self.session.config, replaced)
        os.chown(replaced, status.st_uid, status.st_gid)
        os.replace(replaced, self.session.config)  # as editors do
        read = subprocess.run(["runuser", "-u", "webots-cloud", "--", "cat", self.session.config], capture_output=True, text=True)
        self.assertEqual((read.returncode, read.stdout), (1, ""))
        self.assertIn("Permission denied", read.stderr)

    def test_reload_reads_the_configuration_again(self):
        for unit in self.both:
            with self.subTest(unit.name):
                main, before = unit.main, unit.logged()
                unit.configure(port=1)
                systemctl("reload", unit.name)
                wait_until(lambda: "take effect at the next start: port" in unit.logged()[len(before):], "it was not read")
                self.assertEqual(unit.main, main)
                self.assertIsNotNone(unit.get("/load"))

    async def test_the_watchdog_replaces_a_server_that_stands_still_and_its_simulations_end(self):
        self.simulation.override("WatchdogSec=3")
        self.simulation.restart()
        await self.check_replaced_after(signal.SIGSTOP)
        self.assertIn("Watchdog timeout", self.journal(self.simulation))
        async with Browser(self.simulation) as browser:
            await self.start(browser)

    def test_the_watchdog_replaces_a_session_server_that_stands_still(self):
        self.session.override("WatchdogSec=3")
        self.session.restart()
        main = self.session.main
        os.kill(main, signal.SIGSTOP)
        self.session.wait_for_another_than(main)
        self.assertIsNotNone(self.session.get("/load"))

    @staticmethod
    def journal(unit):
        return subprocess.run(["journalctl", "--no-pager", "--unit", unit.name], check=True, capture_output=True, text=True).stdout

    async def test_a_server_that_is_killed_takes_its_simulations_along_and_is_started_again(self):
        await self.check_replaced_after(signal.SIGKILL)
        self.assertEqual(self.simulation.processes(), [self.simulation.main])
        async with Browser(self.simulation) as browser:
            await self.start(browser)

    async def test_stop_ends_simulations_in_order_and_leaves_nothing_behind(self):
        async with Browser(self.simulation) as browser:
            await self.start(browser)
            systemctl("stop", *(unit.name for unit in self.both))
            self.assertIn(await browser.hear_all(), (1000, 1001, 1011, 1012))
        for unit in self.both:
            self.assertEqual([unit.show("ActiveState"), unit.show("Result"), unit.show("ExecMainStatus")], ["inactive", "success", "0"])
            self.assertFalse(os.path.exists(unit.control_group))
        self.assertEqual(owned_by(pwd.getpwnam("webots-cloud").pw_uid), [])
        self.assertEqual([name for name in os.listdir("/tmp") if "webots" in name], [])

    def test_an_unusable_configuration_is_not_tried_again_and_again(self):
        for unit in self.both:
            with self.subTest(unit.name):
                unit.configure(port="none")
                with self.assertRaises(subprocess.CalledProcessError):
                    unit.restart()
                self.assertEqual([unit.show("ActiveState"), unit.show("ExecMainStatus")], ["failed", "2"])
                self.assertIn("port", self.journal(unit))

    def test_what_the_filter_forbids_is_refused_and_kills_nobody(self):
        for unit in self.both:
            with self.subTest(unit.name):
                unit.override("ExecStartPre=/bin/sh -c 'date --set=now; echo $$? > status'")
                unit.restart()
                with open(os.path.join(unit.folder, "status")) as file:
                    self.assertEqual(file.read(), "1\n")

    def test_the_display_of_a_user_is_within_reach_where_the_operator_says_so(self):
        os.makedirs("/tmp/.X11-unix", exist_ok=True)
        with open("/tmp/.X11-unix/X0", "w"):
            self.simulation.restart()
            self.assertNotIn(".X11-unix", self.simulation.sees("/tmp"))
            self.simulation.override("Environment=DISPLAY=:0", "BindReadOnlyPaths=/tmp/.X11-unix")
            self.simulation.restart()
            self.assertEqual(self.simulation.sees("/tmp/.X11-unix"), ["X0"])
            self.assertIn("All simulations draw on the display :0", self.simulation.logged())


if __name__ == "__main__":
    logging.getLogger("asyncio").setLevel(logging.ERROR)  # systemctl is waited for where coroutines run
    unittest.main(verbosity=2)
