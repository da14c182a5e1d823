"""The walls on a machine of its own: a kernel of Debian's, control groups of version 2 alone, systemd, udev, and our Debian packages. Only for
the virtual machine that tests/virtual_machine.sh boots: it rules that machine."""

import asyncio
import glob
import logging
import os
import signal
import subprocess
import sys
import types
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
sys.path.insert(0, os.path.join(HERE, "integration"))
from limits_test import LIMITS, NEIGHBOUR, WithGroups, groups_of, place_projects, read  # noqa: E402
from support.browser_client import Browser  # noqa: E402
from support.servers import wait_until  # noqa: E402
from systemd_boot import Unit, systemctl  # noqa: E402


def setUpModule():
    subprocess.run(["dpkg", "--install", *glob.glob("/srv/packages/*.deb")], check=True, stdout=subprocess.DEVNULL)
    systemctl("stop", "webots-session-server")


class Machine(unittest.TestCase):
    """What is special about it: were it otherwise, the other tests would say nothing new."""

    def test_it_has_control_groups_of_version_2_alone(self):
        with open("/proc/mounts") as mounts:
            kinds = [line.split()[2] for line in mounts]
        self.assertIn("cgroup2", kinds)
        self.assertNotIn("cgroup", kinds)
        self.assertLessEqual({"memory", "pids", "cpu"}, set(read("/sys/fs/cgroup/cgroup.controllers").split()))

    def test_it_has_landlock(self):
        self.assertIn("landlock", read("/sys/kernel/security/lsm").split(","))

    def test_udev_lets_everybody_make_network_devices(self):
        self.assertEqual(os.stat("/dev/net/tun").st_mode & 0o777, 0o666)


class Scripts(unittest.TestCase):
    """Tests of the suite, whose servers are root's and others', and none of them a service."""

    def check(self, name, *arguments, may_skip=()):
        done = subprocess.run([sys.executable, "-B", f"{HERE}/integration/{name}", *arguments], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True)
        print(done.stdout, flush=True)
        self.assertEqual(done.returncode, 0)
        skipped = [line for line in done.stdout.splitlines() if " skipped " in line]
        self.assertEqual([line for line in skipped if not any(reason in line for reason in may_skip)], [])

    def test_limits(self):
        self.check("limits_test.py")

    def test_what_sandboxes_keep_out(self):
        self.check("sandbox_test.py", may_skip=["there is no such thing on this machine"])

    def test_users_of_roots_servers(self):
        self.check("simulation_user_test.py")

    def test_users_of_other_servers(self):
        self.check("subordinate_users_test.py")

    def test_what_confines_the_servers_themselves(self):
        self.check("own_confinement_test.py")


class UnitServer(Unit):
    """The simulation server as it is installed, for tests that start servers of their own elsewhere."""

    def __init__(self, **keys):
        super().__init__("simulation")
        self.keys = keys
        self.installed = read(self.config)

    def start(self):
        self.configure(**{**self.keys, **place_projects("/srv/limited")})
        self.restart()

    def close(self):
        self.override()
        with open(self.config, "w") as file:
            file.write(self.installed)
        systemctl("reset-failed", self.name)
        self.restart()

    def instances_folder(self):
        return glob.glob(f"{self.folder}/**/2000/instances", recursive=True)[0]

    def wait_until_clean(self):
        wait_until(lambda: not self.simulators(), "processes are left")
        wait_until(lambda: not os.listdir(self.instances_folder()), "directories are left")

    def log(self):
        return self.logged()

    @property
    def process(self):
        return types.SimpleNamespace(pid=self.main)


class UnderTheUnit(WithGroups, unittest.TestCase):
    """As installed: `Delegate=` gives the user of the server control groups, bubblewrap is found, and the gateway leads in."""

    keys = {}

    @classmethod
    def check(cls):
        pass

    @classmethod
    def make_server(cls):
        return UnitServer(**LIMITS, **cls.keys)

    def test_the_groups_are_those_of_the_unit(self):
        self.assertTrue(self.groups)
        for group in self.groups:
            self.assertTrue(group.startswith(self.server.control_group + "/"), group)

    def test_simulations_are_in_the_sandbox_that_the_machine_has(self):
        self.assertIn("bubblewrap", self.server.get("/monitor"))
        self.assertIn("bubblewrap", self.server.log())


class ServiceWithGroups(unittest.IsolatedAsyncioTestCase):
    """systemd puts processes of its own into the group of the service, where the kernel wants none beside groups with controllers."""

    def setUp(self):
        self.server = UnitServer()
        self.addCleanup(self.server.close)
        self.server.start()

    async def start_a_simulation(self):
        async with Browser(self.server) as browser:
            await browser.start(NEIGHBOUR)
            await browser.hear("webots:")
            self.assertTrue(groups_of(self.server.main))
        await asyncio.to_thread(self.server.wait_until_clean)

    async def test_a_killed_server_is_started_again_and_has_groups_again(self):
        for _ in range(2):
            main = self.server.main
            async with Browser(self.server) as browser:
                await browser.start(NEIGHBOUR)
                await browser.hear("webots:")
                os.kill(main, signal.SIGKILL)
                await asyncio.to_thread(self.server.wait_for_another_than, main)
            self.assertEqual(groups_of(main), [])
            await self.start_a_simulation()

    async def test_it_is_reloaded_and_restarted(self):
        for how in ("reload", "restart"):
            systemctl(how, self.server.name)
            self.assertEqual(self.server.show("ActiveState"), "active")
            await self.start_a_simulation()

    async def test_root_has_groups_in_a_service_without_delegation(self):
        self.server.override("User=root", "Delegate=no")
        self.server.restart()
        await self.start_a_simulation()


if __name__ == "__main__":
    logging.getLogger("asyncio").setLevel(logging.ERROR)
    result = unittest.main(verbosity=2, exit=False).result
    print("exit status", int(not result.wasSuccessful()), flush=True)
