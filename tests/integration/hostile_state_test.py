#!/usr/bin/python3
"""Whatever a simulation leaves in place of its server's files and folders: the server starts again, says what it did, and damages nothing
else. Simulations run as the same user, so they can do this."""

import os
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import LOCAL, Browser  # noqa: E402
from support.disks import mount_small_disk  # noqa: E402
from support.other_user import NOBODY, OwnedServer  # noqa: E402
from support.servers import SimulationServer, main, wait_until  # noqa: E402


def remove(path):
    if os.path.isdir(path) and not os.path.islink(path):
        shutil.rmtree(path)
    elif os.path.lexists(path):
        os.remove(path)


class HostileState(unittest.IsolatedAsyncioTestCase):
    user = NOBODY if os.geteuid() == 0 else None  # for whom modes count

    def setUp(self):
        self.server = OwnedServer(self.user, debug=False)
        self.addCleanup(self.server.close)
        self.server.environment["WEBOTS_DEMO_FAULTS"] = ""
        self.folder = self.server.folder
        self.victim = os.path.join(self.folder, "victim")
        os.makedirs(os.path.join(self.victim, "1", "inner"))
        self.precious = [os.path.join(self.victim, *name) for name in (("file",), ("1", "inner", "file"))]
        for path in self.precious:
            with open(path, "w") as file:
                file.write("precious")
        self.server.start()
        self.server.stop()

    def path(self, *parts):
        return os.path.join(self.folder, *parts)

    def damages(self, path, target):
        """Ways to put something else in the place of a file, by name."""
        return {"link": lambda: os.symlink(target, path), "pipe": lambda: os.mkfifo(path), "folder": lambda: os.makedirs(path + "/in/ner"),
                "file": lambda: self.write(path), "hard link": lambda: os.link(self.precious[0], path)}

    def write(self, path):
        with open(path, "w") as file:
            file.write("something else")

    def said(self):
        text = ""
        for name in ("log/simulation/output.log", "output.log"):
            if os.path.isfile(self.path(name)):
                with open(self.path(name), errors="replace") as file:
                    text += file.read()
        return text

    def start_again(self, what, words):
        """Checks that the server starts, says `words`, and has damaged nothing."""
        with self.subTest(what):
            before = self.said()
            self.server.start()

            def new():
                text = self.said()
                return text[len(before):] if text.startswith(before) else text

            wait_until(lambda: words in new(), lambda: f"it does not say '{words}', but: {new()}")
            self.assertIn("ready", self.server.get("/readyz"))
            self.assertEqual(self.server.stop(), 0)
            for path in self.precious:
                with open(path) as file:
                    self.assertEqual(file.read(), "precious")

    async def test_what_is_in_the_place_of_the_state_folders_is_set_aside(self):
        for parts in (("state", "webots_cloud"), ("state", "webots_cloud", str(self.server.port)),
                      ("state", "webots_cloud", str(self.server.port), "instances")):
            path = self.path(*parts)
            for name in ("link", "pipe", "file"):
                remove(path)
                self.damages(path, self.victim)[name]()
                self.start_again((parts[-1], name), f"{path} was not what it has to be, and is now {parts[-1]}.set-aside-")

    async def test_modes_of_the_state_folders_are_mended(self):
        for parts in (("state", "webots_cloud"), ("state", "webots_cloud", str(self.server.port), "instances")):
            for mode in (0, 0o777):
                os.chmod(self.path(*parts), mode)
                self.start_again((parts[-1], mode), f"{self.path(*parts)} had the mode of a folder that ")

    async def test_what_is_in_the_place_of_logs_is_set_aside(self):
        for name in ("output.log", "monitor.csv"):
            path = self.path("log", "simulation", name)
            for damage in ("link", "pipe", "folder", "hard link"):
                remove(path)
                self.damages(path, self.precious[0])[damage]()
                self.start_again((name, damage), f"log/simulation/{name} was not what it has to be, and is now {name}.set-aside-")

    async def test_what_is_in_the_place_of_the_folders_of_logs_is_set_aside(self):
        for name in ("log", "log/simulation"):
            for damage in ("pipe", "file"):
                remove(self.path(name))
                self.damages(self.path(name), self.victim)[damage]()
                self.start_again((name, damage), f"{name} was not what it has to be")
        os.chmod(self.path("log", "simulation"), 0)
        self.start_again("mode", "log/simulation had the mode of a folder that we can't use: now we can.")

    async def test_what_is_in_the_place_of_a_simulations_log_is_set_aside(self):
        folder = self.path("log", "simulation", "simulations")
        remove(folder)
        os.mkfifo(folder)
        self.server.start()
        async with Browser(self.server) as browser:
            await browser.start()
            await browser.hear("webots:")
        self.server.wait_until_clean()
        self.assertIn("log/simulation/simulations was not what it has to be", self.said())
        self.assertEqual(len(os.listdir(folder)), 1)

    async def test_what_is_in_the_place_of_the_cache_is_set_aside(self):
        self.server.config["forges"] = [*self.server.config["forges"], "https://forge.invalid"]
        self.server.start()
        self.server.stop()
        cache = self.path("cache", "webots_cloud", str(self.server.port))
        for path in (cache, os.path.join(cache, "repositories"), os.path.join(cache, "incoming")):
            for damage in ("link", "pipe"):
                remove(path)
                self.damages(path, self.victim)[damage]()
                self.start_again((path, damage), f"{path} was not what it has to be")
        os.symlink(self.victim, os.path.join(cache, "repositories", "0" * 40))
        self.start_again("a link among repositories", "Running simulation server")


class UnusableFolders(unittest.TestCase):
    """Folders that can't be used when the server starts: it takes others, or says what to do."""

    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_unusable_"))

    def start(self, environment=None, **settings):
        server = SimulationServer(environment=environment, **{**LOCAL, **settings})
        self.addCleanup(server.close)
        server.start()
        return server

    def test_what_is_fetched_is_kept_beside_the_working_files_where_the_user_has_no_folder_for_it(self):
        forges = ["http://localhost:1", *LOCAL["forges"]]
        for environment in ({"XDG_CACHE_HOME": "/proc/nowhere"}, {"XDG_CACHE_HOME": "", "HOME": "/proc/nowhere"}, {"XDG_CACHE_HOME": "", "HOME": ""},
                            {"XDG_CACHE_HOME": "relative", "HOME": "relative"}):
            with self.subTest(environment):
                server = self.start(environment, forges=forges)
                spare = os.path.join(server.state_folder(), "cache", str(server.port))
                self.assertTrue(os.path.isdir(os.path.join(spare, "repositories")), server.log())
                self.assertNotIn("Projects can't be fetched", server.log())
                self.assertEqual("/proc/nowhere" in str(environment), f"They are kept in {spare} instead." in server.log(), server.log())
                for shared in (os.path.join(server.folder, "tmp", "webots_cloud"), os.path.join(server.folder, "relative")):
                    self.assertFalse(os.path.exists(shared), "everybody may have been there first")
                self.assertEqual(server.stop(), 0)

    def fill(self, disk):
        mount_small_disk(self, disk, "64k")
        with open(os.path.join(disk, "filler"), "wb") as file, self.assertRaises(OSError):
            while True:
                os.write(file.fileno(), bytes(4096))

    def test_a_disk_that_is_full_is_not_used_so_that_the_sandbox_stays(self):
        self.fill(self.folder)
        server = self.start({"XDG_STATE_HOME": self.folder}, sandbox="auto")
        self.assertIn(f"Trying {server.folder}/tmp/webots-{os.geteuid()} instead.", server.log())
        self.assertNotIn("can't be written", server.log())

    def test_a_disk_that_is_full_and_the_only_one_is_said_with_the_remedy(self):
        self.fill(self.folder)
        with self.assertRaisesRegex(AssertionError, r'No space left on device\. Make room there, or set "stateDir" to a folder on another disk'):
            self.start(stateDir=os.path.join(self.folder, "state"))


if __name__ == "__main__":
    main()
