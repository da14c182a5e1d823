#!/usr/bin/python3
"""What a simulation leaves behind or prints: its folder is removed whatever is in it, nothing beyond it is touched, and while it floods its
server with output, or its folder is being removed, others go on.
"""

import asyncio
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser  # noqa: E402
from support.frames import Frames, running  # noqa: E402
from support.other_user import NOBODY, OwnedServer  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import main, wait_until  # noqa: E402

WORLD = b"""#VRML_SIM R2025a utf8
WorldInfo { }
RectangleArena { }
Robot { name "attacker" controller "attack" }
"""
BEGINNING = "#!/usr/bin/python3\nimport os, sys, time\nPRECIOUS = sys.argv[0] + '.precious'\nwith open(PRECIOUS) as file:\n    precious = file.read()\n"
END = "\nopen('done', 'w').close()\nwhile True:\n    time.sleep(100)\n"

# Each is a way to make a folder that is hard to remove.
LITTER = {
    "links": "for number, target in enumerate((precious, os.path.dirname(precious), '/', '..', '.', 'links')):\n"
             "    os.symlink(target, f'link{number}')\nos.link(precious, 'hard')",
    "pipes": "os.mkfifo('pipe')\nimport socket\nsocket.socket(socket.AF_UNIX).bind('socket')",
    "a sparse file": "with open('sparse', 'wb') as file:\n    file.truncate(1 << 40)",
    "30,000 files": "os.mkdir('many')\nos.chdir('many')\nfor number in range(30000):\n    os.mknod(str(number))\nos.chdir('..')",
    "deep folders": "for _ in range(3000):\n    os.mkdir('deep' * 10)\n    os.chdir('deep' * 10)\nos.chdir(os.path.dirname(sys.argv[0]))",
    "locked folders": "os.makedirs('locked/inner')\nopen('locked/inner/file', 'w').close()\nos.chmod('locked/inner', 0)\nos.chmod('locked', 0)",
    "odd names": "for name in ('-rf', ' ', '\\n', '*', '~', '\\x1b[2J', '\\udcff', 'a' * 255):\n    open(name, 'w').close()",
}
FLOOD = "done = open('done', 'w')\nwhile True:\n    os.write(1, b'x' * 999 + b'\\n' if time.time_ns() % 2 else b'\\n' * 65536)"
ESCAPES = r"""
os.write(1, b"before\n\x1b]0;a title\x07\x1b[2J\x9b31m forged\r2026-11-23 [ERROR] forged\n\x00\xff\n" + b"\x1b[5m" * 1000 + b"\nafter\n")"""


class Litter(unittest.TestCase):
    def setUp(self):
        self.server = OwnedServer(NOBODY if os.geteuid() == 0 else None)
        self.addCleanup(self.server.close)
        folder = os.path.join(self.server.folder, "projects", "projects")
        for path, content in demo_project("neighbour").items():
            self.write(os.path.join(folder, path), content)
        self.attack = os.path.join(folder, "hostile/controllers/attack")
        self.precious = os.path.join(self.server.folder, "precious", "file")
        self.write(self.precious, b"precious")
        self.write(os.path.join(folder, "hostile/worlds/hostile.wbt"), WORLD)
        self.write(os.path.join(self.attack, "attack.precious"), self.precious.encode())
        # Without a limit on disk, by which most of this would have ended the simulation.
        self.server.config.update(forges=[{"url": "local:", "directory": os.path.dirname(folder)}], allowedRepositories=["local:/projects"],
                                  simulationDisk=0)

    @staticmethod
    def write(path, content):
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(content)

    async def run_attack(self, script, during):
        """Runs it beside a neighbour whose pictures have to keep coming, during the attack and while its folder is removed."""
        path = os.path.join(self.attack, "attack")
        self.write(path, (BEGINNING + script).encode())
        os.chmod(path, 0o755)
        self.server.start()
        place = os.path.join(self.server.instances_folder(), "2")
        async with Browser(self.server) as neighbour:
            await neighbour.start("local:/projects/neighbour/blob/main/worlds/arena.wbt")
            port = int((await neighbour.hear("webots:")).rpartition(":")[2])
            async with running(port):
                frames = Frames(port)
                self.addCleanup(frames.close)
                async with Browser(self.server) as browser:
                    await browser.start("local:/projects/hostile/blob/main/worlds/hostile.wbt")
                    await browser.hear("webots:")
                    await asyncio.to_thread(self.wait_for, os.path.join(place, "controllers/attack/done"))
                    await during(browser, frames)
                await asyncio.to_thread(self.watch_removal, place, frames)
        self.server.wait_until_clean()
        with open(self.precious) as file:
            self.assertEqual(file.read(), "precious")

    def wait_for(self, path):
        wait_until(lambda: os.path.exists(path), lambda: f"{path} does not come:\n{self.server.log()}")

    def watch_removal(self, place, frames):
        def look():
            frames.wait_for_next("while a folder is removed")
            self.assertIsNotNone(self.server.get("/load"))
            return not os.path.exists(place)

        wait_until(look, "it is not removed")

    def test_a_folder_is_removed_whatever_is_in_it(self):
        async def during(_, frames):
            frames.wait_for_next("beside litter")

        asyncio.run(self.run_attack("\n".join(LITTER.values()) + END, during))

    def test_a_flood_of_output_drowns_nobody(self):
        async def during(_, frames):
            for _ in range(20):
                await asyncio.to_thread(frames.wait_for_next, "beside a flood")
                self.assertIsNotNone(await asyncio.to_thread(self.server.get, "/load"))

        asyncio.run(self.run_attack(FLOOD, during))
        logs = os.path.join(self.server.folder, "log")
        size = sum(os.path.getsize(os.path.join(folder, name)) for folder, _, names in os.walk(logs) for name in names)
        self.assertLess(size, 64 << 20)

    def test_what_is_printed_can_not_control_the_operators_terminal(self):
        async def during(_, frames):
            frames.wait_for_next("beside escapes")
            await asyncio.to_thread(wait_until, lambda: b"after" in self.printed(), "nothing is logged")

        asyncio.run(self.run_attack(ESCAPES + END, during))
        for name, content in self.logs().items():
            for control in (b"\x1b", b"\x9b", b"\x07", b"\r", b"\0"):
                self.assertNotIn(control, content, name)
            self.assertNotIn(b"\n2026-11-23 [ERROR] forged", content, name)

    def logs(self):
        found = {"output.log": self.server.log().encode()}
        for folder, _, names in os.walk(os.path.join(self.server.folder, "log")):
            for name in names:
                with open(os.path.join(folder, name), "rb") as file:
                    found[name] = file.read()
        return found

    def printed(self):
        return b"".join(self.logs().values())


if __name__ == "__main__":
    main()
