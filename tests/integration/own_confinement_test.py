#!/usr/bin/python3
"""The servers can open only the files that they need (Landlock), and do all their work within them: the session server as a whole, of the
simulation server the threads that handle what comes from outside."""

import asyncio
import ctypes
import glob
import os
import shutil
import signal
import ssl
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import EXAMPLES, WORLD, Browser  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402

LANDLOCK_CREATE_RULESET = 444
ABOUT_SIMULATION_SERVER = "What handles requests and projects can open only the files that it needs (Landlock)."


def landlock_version():
    return ctypes.CDLL(None, use_errno=True).syscall(LANDLOCK_CREATE_RULESET, None, 0, 1)


def setUpModule():
    if landlock_version() < 1:
        raise unittest.SkipTest("this kernel has no Landlock")


def make_certificate(folder, name):
    """A certificate for `name`; the paths of its files."""
    paths = os.path.join(folder, f"{name}.cert"), os.path.join(folder, f"{name}.key")
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "1",
                    "-subj", f"/CN={name}", "-keyout", paths[1], "-out", paths[0]], check=True, capture_output=True)
    return paths


def shown_certificate(server):
    return ssl.get_server_certificate(("127.0.0.1", server.port))


class Confined(unittest.TestCase):
    def setUp(self):
        context = tempfile.TemporaryDirectory(prefix="webots_cloud_elsewhere_")
        self.addCleanup(context.cleanup)
        self.elsewhere = context.name

    def log(self, server):
        with open(os.path.join(server.folder, "log", "session", "output.log")) as file:
            return file.read()

    def write_token(self, folder):
        path = os.path.join(folder, "token")
        with open(path, "w", opener=lambda name, flags: os.open(name, flags, 0o600)) as file:
            file.write("0123456789abcdef0123")
        return path

    def test_it_logs_and_answers_and_reads_its_configuration_again(self):
        with SessionServer([], debug=False) as server:
            self.assertIn("This server can open only the files that it needs (Landlock).", self.log(server))
            self.assertEqual(server.get("/"), "0")
            self.assertEqual(server.command("--decisions")[0], 0)
            server.reread(viewerUrl="https://github.com/o/r/blob/main/worlds/w.wbt")
            wait_until(lambda: "The configuration was read again" in self.log(server), lambda: self.log(server))
            with open(f"/proc/{server.process.pid}/status") as status:
                self.assertIn("NoNewPrivs:\t1\n", status.read())

    def test_a_new_log_file_is_made_where_the_old_one_was_moved_away(self):
        with SessionServer([], debug=False) as server:
            path = os.path.join(server.folder, "log", "session", "output.log")
            os.rename(path, path + ".old")
            server.stop()
            server.start()
            self.assertIn("Session server running", self.log(server))

    def test_a_certificate_that_was_renewed_by_renaming_is_used(self):
        with tempfile.TemporaryDirectory() as folder:
            first = make_certificate(folder, "first")
            second = make_certificate(folder, "second")
            with SessionServer([], debug=False, sslCertificate=first[0], sslKey=first[1]) as server:
                before = shown_certificate(server)
                os.rename(second[1], first[1])
                os.rename(second[0], first[0])
                wait_until(lambda: shown_certificate(server) != before, lambda: f"the old one is used:\n{self.log(server)}")

    def test_a_configuration_that_has_become_a_link_to_another_folder_is_told(self):
        with SessionServer([], debug=False) as server:
            there = os.path.join(self.elsewhere, "moved.json")
            path = server.configure()
            shutil.move(path, there)
            os.symlink(there, path)
            server.process.send_signal(signal.SIGHUP)
            wait_until(lambda: f"It is a link to {there}: if it has become one while the server runs, restart that" in self.log(server),
                       lambda: self.log(server))

    def test_it_can_not_open_a_file_elsewhere(self):
        """Not even as root: here for a new configuration that names one."""
        with SessionServer([], debug=False) as server:
            server.reread(operatorTokenFile=self.write_token(self.elsewhere))
            wait_until(lambda: "Permission denied" in self.log(server), lambda: self.log(server))
            server.stop()
            server.configure(operatorTokenFile=os.path.join(self.elsewhere, "token"))
            server.config["operatorTokenFile"] = os.path.join(self.elsewhere, "token")
            server.start()  # which names it at the start
            server.reread()
            wait_until(lambda: "The configuration was read again" in self.log(server), lambda: self.log(server))


def can_mount_overlays(folder):
    paths = [os.path.join(folder, name) for name in ("lower", "upper", "work", "target")]
    for path in paths:
        os.makedirs(path)
    options = "lowerdir={},upperdir={},workdir={}".format(*paths)
    mounted = subprocess.run(["mount", "-t", "overlay", "overlay", "-o", options, paths[3]], capture_output=True).returncode == 0
    if mounted:
        subprocess.run(["umount", paths[3]], check=True)
    return mounted


class ConfinedSimulationServer(unittest.TestCase):
    def setUp(self):
        if landlock_version() < 2:
            self.skipTest("this kernel's Landlock is too old")
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_elsewhere_"))
        self.worlds = os.path.join(self.folder, "worlds")
        self.elsewhere = os.path.join(self.folder, "elsewhere")
        os.makedirs(os.path.join(self.worlds, "demo_projects"))
        os.makedirs(self.elsewhere)
        self.project = shutil.copytree(os.path.join(EXAMPLES, "robots"), os.path.join(self.elsewhere, "robots"))
        self.link = os.path.join(self.worlds, "demo_projects", "robots")

    def server(self, **config):
        return SimulationServer(**{"forges": [{"url": "local:", "directory": self.worlds}], "allowedRepositories": ["local:/demo_projects"],
                                   "debug": True, **config})

    def start(self, server, ending="webots:"):
        async def ask():
            async with Browser(server) as browser:
                await browser.start(WORLD)
                return await browser.hear(ending)

        told = asyncio.run(ask())
        server.wait_until_clean()
        return told

    def threads(self, server):
        """How many are confined, and how many are not."""
        found = [0, 0]
        for path in glob.glob(f"/proc/{server.process.pid}/task/*/status"):
            with open(path) as status:
                found["NoNewPrivs:\t0\n" in status.read()] += 1
        return found

    def test_the_event_loop_is_confined_and_what_starts_programs_is_not(self):
        shutil.copytree(self.project, self.link)
        with self.server() as server:
            self.assertIn(ABOUT_SIMULATION_SERVER, server.log())
            self.start(server)
            with open(f"/proc/{server.process.pid}/status") as status:
                self.assertIn("NoNewPrivs:\t1\n", status.read())
            confined, others = self.threads(server)
            self.assertGreater(confined, 3)
            self.assertGreater(others, 0)

    def test_a_link_of_the_operators_can_be_followed_if_it_was_there_at_the_start(self):
        os.symlink(self.project, self.link)
        with self.server() as server:
            self.start(server)

    def test_a_link_that_appears_later_leads_nowhere(self):
        """Not even for root, and not even where nothing else would stop it."""
        with self.server() as server:
            os.symlink(self.project, self.link)
            self.assertIn("Permission denied", self.start(server, "loading: Error: "))
            server.stop()
            server.config["confineServer"] = False
            server.start()
            self.start(server)

    def test_nothing_is_written_elsewhere_when_somebody_has_put_a_link_in_place_of_the_projects(self):
        shutil.copytree(self.project, self.link)
        target = os.path.join(self.folder, "target")
        os.makedirs(target)
        with self.server() as server:
            instances = server.instances_folder()
            os.rename(instances, instances + ".away")
            os.symlink(target, instances)
            self.assertIn("Permission denied", self.start(server, "loading: Error: "))
            self.assertEqual(os.listdir(target), [])

    def test_a_configuration_is_read_again_but_no_token_elsewhere(self):
        token = os.path.join(self.elsewhere, "token")
        with open(token, "w", opener=lambda name, flags: os.open(name, flags, 0o600)) as file:
            file.write("0123456789abcdef0123")
        with self.server() as server:
            server.reread(title="Another title")
            wait_until(lambda: "The configuration was read again" in server.log(), lambda: server.log())
            server.reread(operatorTokenFile=token)
            wait_until(lambda: "Permission denied" in server.log(), lambda: server.log())

    def test_projects_are_still_mounted_where_they_can_be(self):
        """By a thread that was started before."""
        with self.server(forges=["https://localhost:1"]) as server:
            if not can_mount_overlays(os.path.join(server.state_folder(), "try")):
                self.skipTest("this machine has no overlay mounts")
            self.assertIn("Projects are handed out by overlay mounts.", server.log())

    def test_it_can_be_turned_off(self):
        with self.server(confineServer=False) as server:
            self.assertNotIn("Landlock", server.log())
            self.assertEqual(self.threads(server)[0], 0)


if __name__ == "__main__":
    main()
