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
from support.browser_client import Browser, websockets  # noqa: E402
from support.servers import PATIENCE, SimulationServer, main, wait_until  # noqa: E402

FILE = "drive/drive.py"
WORLD = '#VRML_SIM R2025a utf8\nWorldInfo { basicTimeStep 32 }\nTwoWheeledRobot { name "r" translation 0 0 0 }\n'
URL = "local:/o/lesson/blob/main/worlds/a.wbt"
DRIVEN = WORLD.replace('name "r"', 'name "r" controller "drive"')  # its robot runs the program
PROGRAM = "print('go')\n"
SECRET = "secret of the machine\n"

# Puts other things in its own place again and again, as fast as it can: a link to what is not the simulation's, a pipe that nobody writes into,
# and a file of 1 GB.
SWAPPER = """
import os

def large(name):
    with open(name, 'wb') as file:
        file.truncate(1 << 30)

makers = [lambda name: os.symlink({secret!r}, name), os.mkfifo, large]
print('I swap', flush=True)
while not os.path.exists('stop.py'):
    for make in makers:
        try:
            make('new')
            os.replace('new', 'drive.py')
        except OSError:
            pass
print('I stop', flush=True)
"""


class Programs(unittest.IsolatedAsyncioTestCase):
    walls = {}

    def running(self, **settings):
        """A simulation server that runs; SkipTest where there are no walls to be had."""
        simulation = self.start(**self.walls, **settings)
        if not self.walls:
            simulation.start()
            return simulation
        if not shutil.which("bwrap"):
            self.skipTest("bubblewrap is not installed")
        try:
            simulation.start()
        except AssertionError as failure:
            self.skipTest(f"no sandbox here: {failure}")
        return simulation

    def start(self, **settings):
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_programs_")
        self.addCleanup(shutil.rmtree, self.folder)
        self.outside = os.path.join(self.folder, "outside")
        self.write(self.outside, SECRET)
        project = os.path.join(self.folder, "o", "lesson")
        self.write(os.path.join(project, "worlds", "a.wbt"), WORLD)
        self.write(os.path.join(project, "worlds", "driven.wbt"), DRIVEN)
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
    async def simulating(self, simulation, edit=True, url=URL, **start):
        async with Browser(simulation) as browser:
            await browser.start(url=url, edit=edit, **start)
            browser.address = (await browser.hear("webots:")).removeprefix("webots:")
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

    async def test_a_program_is_changed(self):
        """From the list to a saved program, and back."""
        simulation = self.running()
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

    async def test_without_the_key_or_an_editor_nothing_is_told_or_changed(self):
        for settings, edit in (({"allowEdit": False}, True), ({}, False)):
            simulation = self.running(**settings)
            async with self.simulating(simulation, edit) as browser:
                self.assertEqual((await self.save(browser, "drive/drive.py", "x"))["code"], "not-editable")
                self.assertEqual((await self.ask(browser, read="drive/drive.py"))["code"], "not-editable")
                self.assertEqual(self.content(simulation, "drive/drive.py"), PROGRAM)
                self.assertFalse([text for text in browser.told if text.startswith("files:")])
            simulation.close()

    async def compile(self, browser, controller):
        await browser.socket.send(json.dumps({"compile": controller}))
        return json.loads((await browser.hear("compiled: ")).removeprefix("compiled: "))

    async def compiled(self, browser, **files):
        """What comes of compiling these files of the controller `fly`."""
        for name, text in files.items():
            self.assertTrue((await self.save(browser, "fly/" + name.replace("fly_c", "fly.c"), text))["saved"])
        return await self.compile(browser, "fly")

    def running_with_a_program_in_c(self):
        for program in ("make", "cc"):
            if not shutil.which(program):
                self.skipTest(f"{program} is not installed")
        simulation = self.running()
        self.write(os.path.join(self.folder, "o", "lesson", "controllers", "fly", "fly.c"), "int main(void) { return 0; }\n")
        return simulation

    async def test_a_program_in_c_is_compiled(self):
        """With the makefile of the simulator; what is wrong is told with its line."""
        simulation = self.running_with_a_program_in_c()
        async with self.simulating(simulation) as browser:
            self.assertEqual(json.loads((await browser.hear("compiles: ")).removeprefix("compiles: ")), ["fly"])
            wrong = await self.compiled(browser, fly_c="int main(void) {\n  return x;\n}\n")
            self.assertEqual(wrong["code"], "not-compiled")
            self.assertRegex(wrong["output"], r"fly\.c:2:\d+: error: ")
            right = await self.compiled(browser, fly_c="int main(void) { return 0; }\n")
            self.assertNotIn("error", right)
            self.assertTrue(os.access(os.path.join(self.place(simulation), "fly", "fly"), os.X_OK))
            self.assertEqual((await self.compile(browser, "drive"))["code"], "no-compiler")
        simulation.wait_until_clean()

    async def test_a_makefile_does_no_harm(self):
        """It runs as the programs of the simulation do, and nobody waits for it."""
        simulation = self.running_with_a_program_in_c()
        async with self.simulating(simulation) as browser, self.simulating(simulation) as bystander:
            told = await self.compiled(browser, Makefile=f"all:\n\tcat {self.outside}\n")
            self.assertEqual(told.get("code"), "not-compiled" if self.walls else None)
            self.assertEqual(SECRET.strip() in told["output"], not self.walls)
            told = await self.compiled(browser, Makefile="all:\n\tyes\n")
            self.assertEqual(told["code"], "not-compiled")
            self.assertLess(len(json.dumps(told)), 64 << 10)
            await self.save(browser, "fly/Makefile", "all:\n\ttrap '' TERM; while :; do sleep 1; done\n")
            await browser.socket.send(json.dumps({"compile": "fly"}))
            for page in (browser, bystander):
                self.assertEqual((await self.ask(page, read="drive/drive.py"))["text"], PROGRAM)
        # The page has left: what it wanted is compiled no more.
        simulation.wait_until_clean()

    async def test_what_a_simulation_plants_is_never_followed_or_read(self):
        simulation = self.running()
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

    async def test_what_a_program_puts_in_its_own_place_while_it_is_saved_and_read_is_never_followed_or_read(self):
        simulation = self.running()
        async with self.simulating(simulation, url=URL.replace("a.wbt", "driven.wbt"), mode="w3d") as browser:
            async with websockets.connect(browser.address + "/", max_size=None) as view:
                async def hear(line):
                    while str(await asyncio.wait_for(view.recv(), PATIENCE)) != line:
                        pass
                await view.send("w3d;broadcast")
                await hear("stdout:go")  # else what is saved may be read already, and be in the way of the reset
                self.assertTrue((await self.save(browser, FILE, SWAPPER.format(secret=self.outside)))["saved"])
                await view.send("reset")
                await hear("stdout:I swap")
                for turn in range(15):  # what may be saved at once, and some left for the end
                    text = f"print({turn})\n"
                    self.assertTrue((await self.save(browser, FILE, text))["saved"])
                    for _ in range(10):
                        self.assertEqual((await self.ask(browser, read=FILE))["text"], text)
                self.assertTrue((await self.save(browser, "drive/stop.py", ""))["saved"])
                await hear("stdout:I stop")
                self.assertTrue((await self.save(browser, FILE, "print('mended')\n"))["saved"])
                await view.send("reset")
                await hear("stdout:mended")
        with open(self.outside) as outside:
            self.assertEqual(outside.read(), SECRET)
        simulation.wait_until_clean()

    async def test_messages_that_come_early_late_or_again_change_no_other_simulation(self):
        simulation = self.running(reconnectGrace=60)
        early = {"write": {"path": FILE, "text": "early"}}
        async with Browser(simulation) as browser:
            await browser.socket.send(json.dumps(early))
            await browser.hear("loading: Error: No simulation was started")
        async with self.simulating(simulation, reconnect=True) as first:
            token = (await first.hear("reconnectToken: ")).split()[1]
            for _ in range(2):  # again
                self.assertTrue((await self.save(first, FILE, "mine"))["saved"])
            async with self.simulating(simulation) as other, Browser(simulation) as second:
                await self.save(other, FILE, "of somebody else")
                self.assertEqual((await self.ask(first, read=FILE))["text"], "mine")
                await second.socket.send(json.dumps({"reconnect": token}))
                await second.hear("files: ")
                self.assertEqual(await first.hear_all(), 4001)
                with self.assertRaises(websockets.ConnectionClosed):  # late
                    await first.socket.send(json.dumps(early))
                self.assertEqual((await self.ask(second, read=FILE))["text"], "mine")
                await second.socket.close(1000)
        wait_until(lambda: not simulation.simulators(), "the simulations have ended")
        simulation.wait_until_clean()

    async def test_pages_of_other_origins_have_no_programs(self):
        simulation = self.running()
        with self.assertRaises(websockets.InvalidStatusCode) as refused:
            await websockets.connect(f"ws://localhost:{simulation.port}/client", origin="https://anybody.example")
        self.assertEqual(refused.exception.status_code, 403)

    async def test_names_that_lead_out_of_the_folder_are_refused(self):
        simulation = self.running()
        async with self.simulating(simulation) as browser:
            for name in ("../worlds/a.wbt", "drive/../../worlds/a.wbt", "/etc/passwd", "drive/.git", "drive/", "drive.py", "drive\\x/y", "drive/\0"):
                await browser.socket.send(json.dumps({"write": {"path": name, "text": "x"}}))
                self.assertIn('Wrong message: "path" must be "<controller>/<file>"', await browser.hear("loading: Error:"), name)
            for name in ("worlds/a.wbt", "drive/deeper/x.py", "other/x.py"):
                self.assertEqual((await self.save(browser, name, "x"))["code"], "no-file", name)
            self.assertTrue((await self.save(browser, "drive/drive.py", "x"))["saved"])

    async def test_too_much_is_refused_and_bystanders_are_served_meanwhile(self):
        simulation = self.running()
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


class ProgramsInASandbox(Programs):
    walls = {"sandbox": "bubblewrap", "network": "none", "simulationUser": "auto"}


if __name__ == "__main__":
    main()
