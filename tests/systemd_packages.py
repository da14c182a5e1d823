"""The Debian packages under a systemd and a dpkg that run. Only for the Debian that tests/systemd_boot.sh boots: it rules that machine."""

import contextlib
import glob
import grp
import json
import logging
import os
import pwd
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from support.browser_client import Browser  # noqa: E402
from support.servers import wait_until  # noqa: E402
from systemd_boot import Unit, owned_by, systemctl  # noqa: E402

FIRST, LATER = "/srv/packages/1", "/srv/packages/2"
NAMES = ("webots-cloud-session-server", "webots-cloud-simulation-server", "webots-cloud-demo")
# What machines write while packages come and go, and what stays after a purge as Debian has it: the users, and that the helper was used.
NOT_OURS = ("/proc/", "/sys/", "/dev/", "/run/", "/tmp/", "/put_old/", "/srv/", "/var/lib/dpkg/", "/var/lib/apt/", "/var/cache/apt/", "/var/cache/debconf/",
            "/var/log/apt/", "/var/log/dpkg.log", "/var/log/journal", "/var/lib/systemd/", "/etc/passwd-", "/etc/group-", "/etc/shadow-",
            "/etc/gshadow-", "/etc/.pwd.lock", "/var/cache/ldconfig/", "/root/")


def apt(*arguments, **more):
    """The output of apt-get, which asks nobody."""
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive", "LC_ALL": "C"}
    done = subprocess.run(["apt-get", "--yes", "--quiet", *arguments], env=environment, text=True, timeout=300,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode != more.get("status", 0):
        raise AssertionError(f"apt-get {' '.join(arguments)}: exit status {done.returncode}\n{done.stdout}")
    return done.stdout


def install(folder, *options, **more):
    """What our packages recommend is there, but not what that recommends: there is no network."""
    return apt("install", "--no-install-recommends", *options, *sorted(glob.glob(f"{folder}/webots-*.deb")), **more)


def all_files():
    found = set()
    for folder, folders, names in os.walk("/"):
        found.update(os.path.join(folder, name) for name in [*names, *folders])
        folders[:] = [name for name in folders if not (os.path.join(folder, name) + "/").startswith(NOT_OURS)]
    return {path for path in found if not (path + "/").startswith(NOT_OURS) and not path.startswith(NOT_OURS)}


def read(path):
    with open(path) as file:
        return file.read()


def write(path, text):
    with open(path, "w") as file:
        file.write(text)


class Packages(unittest.IsolatedAsyncioTestCase):
    session = Unit("session")
    simulation = Unit("simulation")
    both = (session, simulation)

    def setUp(self):
        self.addCleanup(subprocess.run, ["dpkg", "--purge", *NAMES], check=True, capture_output=True)
        self.before = all_files()
        install(FIRST)

    def edit(self, unit):
        """As an operator does; returns the text."""
        unit.configure(connectionsPerAddress=77)
        return read(unit.config)

    def version(self, unit):
        return subprocess.run(["dpkg-query", "--show", "--showformat=${Version}", unit.name.replace("webots-", "webots-cloud-").removesuffix(".service")],
                              check=True, capture_output=True, text=True).stdout

    def check_serves(self):
        for unit in self.both:
            with self.subTest(unit.name):
                self.assertEqual(unit.show("ActiveState"), "active")
                self.assertIsNotNone(unit.get("/load"))

    async def check_starts_a_simulation(self, server=None):
        async with Browser(server or self.simulation) as browser:
            await browser.start()
            address = (await browser.hear("webots:")).partition(":")[2]
            self.assertRegex(address, "^ws://localhost:2000/simulation/[a-z]{28}/2001$")
        wait_until(lambda: not self.simulation.simulators(), "processes of the simulation are left")

    async def test_the_site_answers_with_nothing_edited(self):
        self.check_serves()
        for unit in self.both:
            self.assertEqual(systemctl("is-enabled", unit.name), "enabled")
        self.assertIn("<html", self.session.get("/viewer/"))
        await self.check_starts_a_simulation()
        self.assertIn("this server runs the demo simulator", self.simulation.logged())

    def test_root_is_told_what_the_services_see(self):
        for unit in self.both:
            with self.subTest(unit.name):
                done = subprocess.run([f"/usr/bin/{unit.name.removesuffix('.service')}", "--doctor", "--json"], capture_output=True, text=True, timeout=60)
                found = {each["subject"]: each for each in json.loads(done.stdout)["findings"]}
                self.assertEqual(found["service"]["verdict"], "ok", found)
                self.assertRegex(found["public address"]["found"], r"/livez leads here$")
        self.assertEqual(found["user"]["found"], "simulations run as another user for each simulation")  # of the simulation server

    async def test_a_simulation_is_started_by_way_of_the_session_server_as_the_page_does(self):
        self.session.configure(loadThreshold=1000)  # the machine that runs the tests may be busy
        systemctl("reload", self.session.name)
        wait_until(lambda: self.session.get("/") == "1", "no machine is free")
        await self.check_starts_a_simulation(self.session)

    def test_simulations_have_walls_and_displays_of_their_own(self):
        self.assertEqual(self.simulation.get("/readyz"), "ready")
        page = self.simulation.get("/monitor")
        self.assertIn("bubblewrap", page)
        self.assertIn("private (Xvfb)", page)

    def test_a_new_site_listens_for_this_machine_alone(self):
        with open("/proc/net/tcp") as four, open("/proc/net/tcp6") as six:
            local = [line.split()[1] for line in [*four, *six] if line.split()[3] == "0A"]
        self.assertLessEqual({"0100007F:07CF", "0100007F:07D0"}, set(local))
        self.assertEqual([each for each in local if each.endswith((":07CF", ":07D0")) and not each.startswith("0100007F:")], [])

    def test_simulations_can_not_read_what_the_session_server_is_told(self):
        found = os.stat(self.session.config)
        self.assertEqual((found.st_mode & 0o777, found.st_uid, found.st_gid), (0o640, 0, grp.getgrnam("webots-session").gr_gid))
        done = subprocess.run(["runuser", "-u", "webots-cloud", "--", "cat", self.session.config], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout), (1, ""))

    async def test_an_upgrade_keeps_what_the_operator_has_edited_and_renews_the_rest(self):
        edited, process = self.edit(self.session), self.session.main
        install(LATER, "-o", "Dpkg::Options::=--force-confold")
        self.assertTrue(self.version(self.session).endswith(".1"))
        self.assertEqual(read(self.session.config), edited)
        self.assertIn('"debug"', read(f"{self.session.config}.dpkg-dist"))
        self.assertIn('"debug"', read(self.simulation.config))
        self.assertNotEqual(self.session.main, process, "the new program runs")
        self.check_serves()
        await self.check_starts_a_simulation()

    def test_an_upgrade_asks_before_it_takes_what_the_operator_has_edited(self):
        edited = self.edit(self.session)
        said = install(LATER, status=100)  # nobody answers
        self.assertIn("Configuration file '/etc/webots-cloud/session.json'", said)
        self.assertEqual(read(self.session.config), edited)
        apt("install", "--fix-broken", "--no-install-recommends", "-o", "Dpkg::Options::=--force-confnew")
        self.assertIn('"debug"', read(self.session.config))
        found = os.stat(self.session.config)
        self.assertEqual((found.st_mode & 0o777, found.st_gid), (0o640, grp.getgrnam("webots-session").gr_gid))
        self.check_serves()

    def test_a_server_that_the_operator_has_disabled_stays_off(self):
        systemctl("disable", "--now", self.simulation.name)
        install(LATER)
        self.assertEqual(self.simulation.show("UnitFileState"), "disabled")
        self.assertEqual(self.simulation.show("ActiveState"), "inactive")
        self.assertEqual(self.session.show("ActiveState"), "active")

    async def test_a_downgrade_goes_back(self):
        install(LATER)
        edited = self.edit(self.session)
        install(FIRST, "--allow-downgrades", "-o", "Dpkg::Options::=--force-confold")
        self.assertFalse(self.version(self.session).endswith(".1"))
        self.assertEqual(read(self.session.config), edited)
        self.assertNotIn('"debug"', read(self.simulation.config))
        self.check_serves()
        await self.check_starts_a_simulation()

    async def test_a_removal_stops_the_servers_and_keeps_configurations(self):
        edited = self.edit(self.session)
        apt("remove", *NAMES)
        for unit in self.both:
            self.assertEqual(unit.show("ActiveState"), "inactive")
            self.assertFalse(os.path.exists(unit.control_group))
        self.assertEqual(owned_by(pwd.getpwnam("webots-cloud").pw_uid), [])
        self.assertEqual(glob.glob("/usr/bin/webots-*"), [])
        self.assertEqual(read(self.session.config), edited)
        install(FIRST)
        self.assertEqual(read(self.session.config), edited)
        self.check_serves()
        await self.check_starts_a_simulation()

    async def test_a_purge_leaves_nothing_of_ours_and_takes_nothing_of_others(self):
        await self.check_starts_a_simulation()
        apt("purge", *NAMES)
        self.assertEqual(all_files() ^ self.before, set())

    def test_a_purge_leaves_what_the_operator_has_put_there(self):
        certificate = "/etc/webots-cloud/certificate.pem"
        write(certificate, "mine")
        self.addCleanup(os.rmdir, os.path.dirname(certificate))
        self.addCleanup(os.remove, certificate)
        apt("purge", *NAMES)
        self.assertEqual(os.listdir(os.path.dirname(certificate)), ["certificate.pem"])

    def test_a_configuration_that_is_refused_is_no_failed_installation(self):
        write(self.session.config, '{"port": "none"}')
        install(LATER, "-o", "Dpkg::Options::=--force-confold")
        self.assertEqual(self.session.show("ActiveState"), "failed")
        self.assertEqual(self.simulation.show("ActiveState"), "active")

    def test_operators_commands_find_the_running_servers(self):
        asked = subprocess.run(["webots-session-server", "--decisions", "--json"], cwd="/", check=True, capture_output=True, text=True)
        self.assertIn("decisions", json.loads(asked.stdout))

    def test_one_server_alone_is_purged_without_the_other(self):
        apt("purge", NAMES[0])
        self.assertFalse(os.path.exists("/var/lib/webots-cloud/session"))
        self.assertEqual(os.listdir("/etc/webots-cloud"), ["simulation.json"])
        self.assertEqual(self.simulation.show("ActiveState"), "active")
        self.assertIsNotNone(self.simulation.get("/load"))


if __name__ == "__main__":
    logging.getLogger("asyncio").setLevel(logging.ERROR)  # apt-get is waited for where coroutines run
    with contextlib.suppress(FileNotFoundError):
        os.remove("/usr/sbin/policy-rc.d")  # debootstrap's
    unittest.main(verbosity=2)
