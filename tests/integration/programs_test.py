#!/usr/bin/python3
"""Visitors change the programs of their own simulation, through the real server: with what they write, and with what they should not.

Protocol section 13.19.
"""

import asyncio
import contextlib
import json
import os
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser  # noqa: E402
from support.servers import SimulationServer, main  # noqa: E402

WORLD = '#VRML_SIM R2025a utf8\nWorldInfo { basicTimeStep 32 }\nTwoWheeledRobot { name "r" translation 0 0 0 }\n'
URL = "local:/o/lesson/blob/main/worlds/a.wbt"
PROGRAM = "print('go')\n"
SECRET = "secret of the machine\n"


class Programs(unittest.IsolatedAsyncioTestCase):
    def start(self, **settings):
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_programs_")
        self.addCleanup(shutil.rmtree, self.folder)
        self.outside = os.path.join(self.folder, "outside")
        self.write(self.outside, SECRET)
        project = os.path.join(self.folder, "o", "lesson")
        self.write(os.path.join(project, "worlds", "a.wbt"), WORLD)
        self.write(os.path.join(project, "controllers", "drive", "drive.py"), PROGRAM)
        self.write(os.path.join(project, "controllers", "drive", "picture.png"), b"\x89PNG\r\n\x1a\n\0")
        simulation = SimulationServer(**{"gateway": True, "forges": [{"url": "local:", "directory": self.folder}],
                                         "allowedRepositories": ["local:/o"], "allowEdit": True, **settings})
        return self.enterContext(contextlib.closing(simulation))

    @staticmethod
    def write(path, content):
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())

    @contextlib.asynccontextmanager
    async def simulating(self, simulation, edit=True):
        async with Browser(simulation) as browser:
            await browser.start(url=URL, edit=edit)
            await browser.hear("webots:")
            yield browser

    async def ask(self, browser, **message):
        await browser.socket.send(json.dumps(message))
        return json.loads((await browser.hear("file: ")).removeprefix("file: "))

    async def save(self, browser, path, text):
        return await self.ask(browser, write={"path": path, "text": text})

    def place(self, simulation):
        """Where the programs of the only simulation are."""
        for folder, folders, _ in os.walk(simulation.instances_folder()):
            if "controllers" in folders:
                return os.path.join(folder, "controllers")
        self.fail("There is no simulation.")

    def content(self, simulation, path):
        with open(os.path.join(self.place(simulation), path)) as file:
            return file.read()

    async def change(self, simulation):
        """From the list to a saved program, and back."""
        async with self.simulating(simulation) as browser:
            self.assertEqual(json.loads((await browser.hear("files: ")).removeprefix("files: ")),
                             [{"path": "drive/drive.py", "changed": False}])
            self.assertEqual(await self.ask(browser, read="drive/drive.py"), {"path": "drive/drive.py", "text": PROGRAM})
            self.assertEqual(await self.save(browser, "drive/drive.py", "print('mine')\n"), {"path": "drive/drive.py", "saved": True})
            self.assertEqual(self.content(simulation, "drive/drive.py"), "print('mine')\n")
            self.assertEqual(await self.save(browser, "drive/new.py", "x"), {"path": "drive/new.py", "saved": True})
            self.assertEqual(await self.ask(browser, original="drive/drive.py"), {"path": "drive/drive.py", "original": PROGRAM})
            await browser.socket.send(json.dumps({"reset controller": "drive/drive.py"}))
            await browser.hear("reset controller: drive/drive.py")
            self.assertEqual(self.content(simulation, "drive/drive.py"), PROGRAM)
            self.assertEqual((await self.ask(browser, read="drive/drive.py"))["text"], PROGRAM)
        simulation.wait_until_clean()
        with open(os.path.join(self.folder, "o", "lesson", "controllers", "drive", "drive.py")) as original:
            self.assertEqual(original.read(), PROGRAM)

    async def test_a_program_is_changed_without_walls(self):
        simulation = self.start()
        simulation.start()
        await self.change(simulation)

    async def test_a_program_is_changed_in_a_sandbox(self):
        if not shutil.which("bwrap"):
            self.skipTest("bubblewrap is not installed")
        simulation = self.start(sandbox="bubblewrap", network="none", simulationUser="auto")
        try:
            simulation.start()
        except AssertionError as failure:
            self.skipTest(f"no sandbox here: {failure}")
        await self.change(simulation)

    async def test_without_the_key_or_an_editor_nothing_is_told_or_changed(self):
        for settings, edit in (({"allowEdit": False}, True), ({}, False)):
            simulation = self.start(**settings)
            simulation.start()
            async with self.simulating(simulation, edit) as browser:
                self.assertEqual((await self.save(browser, "drive/drive.py", "x"))["code"], "not-editable")
                self.assertEqual((await self.ask(browser, read="drive/drive.py"))["code"], "not-editable")
                self.assertEqual(self.content(simulation, "drive/drive.py"), PROGRAM)
                self.assertFalse([text for text in browser.told if text.startswith("files:")])
            simulation.close()

    async def test_what_a_simulation_plants_is_never_followed_or_read(self):
        simulation = self.start()
        simulation.start()
        async with self.simulating(simulation) as browser:
            programs = self.place(simulation)
            drive = os.path.join(programs, "drive")
            os.remove(os.path.join(drive, "drive.py"))
            os.symlink(self.outside, os.path.join(drive, "drive.py"))
            self.assertEqual((await self.ask(browser, read="drive/drive.py"))["text"], PROGRAM)
            self.assertTrue((await self.save(browser, "drive/drive.py", "mine"))["saved"])
            self.assertFalse(os.path.islink(os.path.join(drive, "drive.py")))
            os.remove(os.path.join(drive, "drive.py"))
            os.mkfifo(os.path.join(drive, "drive.py"))  # nobody reads it
            self.assertEqual((await self.ask(browser, read="drive/drive.py"))["text"], "mine")
            self.assertTrue((await self.save(browser, "drive/drive.py", "again"))["saved"])
            self.assertEqual(self.content(simulation, "drive/drive.py"), "again")
            os.symlink(self.outside, os.path.join(drive, ".webots_cloud-reset"))
            self.assertTrue((await self.save(browser, "drive/drive.py", "third"))["saved"])
            shutil.rmtree(drive)
            os.symlink(self.folder, drive)  # a folder that leads elsewhere
            self.assertIn("error", await self.save(browser, "drive/drive.py", "astray"))
            self.assertFalse(os.path.exists(os.path.join(self.folder, "drive.py")))
            os.remove(drive)
            self.write(drive, "a file where the folder was")
            self.assertIn("error", await self.save(browser, "drive/drive.py", "astray"))
        with open(self.outside) as outside:
            self.assertEqual(outside.read(), SECRET)
        simulation.wait_until_clean()

    async def test_names_that_lead_out_of_the_folder_are_refused(self):
        simulation = self.start()
        simulation.start()
        async with self.simulating(simulation) as browser:
            for name in ("../worlds/a.wbt", "drive/../../worlds/a.wbt", "/etc/passwd", "drive/.git", "drive/", "drive.py", "drive\\x/y", "drive/\0"):
                await browser.socket.send(json.dumps({"write": {"path": name, "text": "x"}}))
                self.assertIn('Wrong message: "path" must be "<controller>/<file>"', await browser.hear("loading: Error:"), name)
            for name in ("worlds/a.wbt", "drive/deeper/x.py", "other/x.py"):
                self.assertEqual((await self.save(browser, name, "x"))["code"], "no-file", name)
            self.assertTrue((await self.save(browser, "drive/drive.py", "x"))["saved"])

    async def test_too_much_is_refused_and_bystanders_are_served_meanwhile(self):
        simulation = self.start()
        simulation.start()
        async with self.simulating(simulation) as browser, self.simulating(simulation) as bystander:
            for text in ("x" * 30001, "\0", "\x1b[2J"):
                self.assertEqual((await self.save(browser, "drive/drive.py", text))["code"], "not-saved")

            async def flood():
                saved = 0
                for _ in range(100):
                    for _ in range(100):  # as many as fit into the answers' queue
                        await browser.socket.send(json.dumps({"write": {"path": "drive/drive.py", "text": "y"}}))
                    saved += sum(['"saved":true' in await browser.hear("file: ") for _ in range(100)])
                return saved
            flooding = asyncio.create_task(flood())
            for _ in range(20):
                self.assertEqual((await self.ask(bystander, read="drive/drive.py"))["text"], PROGRAM)
            self.assertLess(await flooding, 5_000, "each save is counted")
            await browser.socket.send(json.dumps({"write": {"path": "drive/drive.py", "text": "x" * 70_000}}))
            self.assertEqual(await browser.hear_all(), 1009)
            self.assertEqual((await self.ask(bystander, read="drive/drive.py"))["text"], PROGRAM)


if __name__ == "__main__":
    main()
