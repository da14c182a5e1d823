#!/usr/bin/python3
"""A lesson through a real simulation server, in the sandbox: what a pupil writes into the simulation's folder runs after a reset."""

import asyncio
import contextlib
import glob
import os
import shutil
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser, server, websockets  # noqa: E402
from support.lessons import SOLUTIONS, solved  # noqa: E402
from support.servers import PATIENCE, main  # noqa: E402

START = "from controller import Robot\nrobot = Robot()\nstep = int(robot.getBasicTimeStep())\n"


class Lesson:
    """The view of one simulation: its console, and the file of its controller."""

    def __init__(self, simulation, view, name):
        [self.path] = glob.glob(os.path.join(simulation.instances_folder(), "**", "controllers", name, name + ".py"), recursive=True)
        self.view = view
        self.console = []

    async def frame(self, accepts):
        while True:
            text = await asyncio.wait_for(self.view.recv(), PATIENCE)
            if text.startswith(("stdout:", "stderr:")):
                self.console.append(text)
            if accepts(text):
                return text

    async def line(self, part):
        return await self.frame(lambda text: text.startswith(("stdout:", "stderr:")) and part in text)

    async def run(self, program):
        """Save, and run."""
        with open(self.path, "w") as file:
            file.write(program)
        await self.view.send("reset")
        await self.frame(lambda text: text == "reset finished")


@contextlib.asynccontextmanager
async def lesson(simulation, world):
    async with Browser(simulation) as browser:
        await browser.start(f"local:/demo_projects/lessons/blob/main/worlds/{world}.wbt", mode="w3d")
        address = (await browser.hear("webots:")).removeprefix("webots:")
        async with websockets.connect(address, max_size=None) as view:
            await view.send("w3d;broadcast")
            await view.send("fast:-1")
            yield Lesson(simulation, view, SOLUTIONS[world][0])


class LessonsInTheSandbox(unittest.IsolatedAsyncioTestCase):
    keys = {"sandbox": "bubblewrap", "network": "none"}

    def setUp(self):
        if self.keys["sandbox"] == "bubblewrap" and not shutil.which("bwrap"):
            self.skipTest("bubblewrap is not installed")
        self.simulation = self.enterContext(server(**self.keys))

    async def test_from_the_wrong_program_to_the_goal(self):
        async with lesson(self.simulation, "lesson_1_move") as pupil:
            await pupil.run(START + "robot.getDevice('left wheel motor').setVelocity('fast')\n")
            await pupil.line("ValueError")
            self.assertIn('stderr:  File "move.py", line 4, in <module>', pupil.console)
            await pupil.run("while True:\n    pass\n")
            await pupil.line("the simulation waits for")
            await pupil.run("while True:\n    print('again')\n")
            await pupil.line("it is slowed down to that")
            await pupil.run(solved("lesson_1_move"))
            self.assertRegex(await pupil.line("You did it"), r"^stdout:You did it: \d+\.\d s$")
        self.simulation.wait_until_clean()

    async def test_the_last_lesson(self):
        async with lesson(self.simulation, "lesson_3_exit") as pupil:
            await pupil.run(solved("lesson_3_exit"))
            await pupil.line("You did it")
        self.simulation.wait_until_clean()


class LessonsWithoutASandbox(LessonsInTheSandbox):
    keys = {"sandbox": "none"}


if __name__ == "__main__":
    main()
