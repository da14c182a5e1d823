"""Visits the site that tests/two_machines.sh has made, as people in its network do.

Usage: two_machines.py ADDRESS_OF_THE_SITE CONTROL_GROUP_OF_THE_SECOND_MACHINE [unittest arguments]
"""

import contextlib
import json
import os
import ssl
import sys
import unittest
import urllib.request

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from support.browser_client import websockets  # noqa: E402
from support.frames import PICTURE  # noqa: E402
from support.visitor import Visitor  # noqa: E402
from support.waiting import wait_until  # noqa: E402

SITE, SECOND_MACHINE = "", ""


class Site:
    url = property(lambda self: SITE)

    @staticmethod
    def get(path, headers=None):
        request = urllib.request.Request(SITE + path, headers=headers or {})
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.read().decode()


def simulators():
    """Those that run on the second machine."""
    found = []
    for folder, _, _ in os.walk(SECOND_MACHINE):
        with contextlib.suppress(FileNotFoundError), open(os.path.join(folder, "cgroup.procs")) as file:
            for process in file.read().split():
                with contextlib.suppress(OSError), open(f"/proc/{process}/comm") as name:
                    if name.read() == "webots-demo-sim\n":  # a name has 15 characters
                        found.append(process)
    return found


class TwoMachines(unittest.IsolatedAsyncioTestCase):
    site = Site()

    async def test_a_simulation_of_the_second_machine_is_seen_by_way_of_the_first(self):
        self.assertIn("<html", self.site.get("/viewer/"))
        wait_until(lambda: self.site.get("/") == "1", "no machine is free")
        self.assertEqual(simulators(), [])
        async with Visitor(self.site, trust=ssl.create_default_context()) as visitor:
            await visitor.start()
            address = (await visitor.hear("webots:")).partition(":")[2]
            self.assertTrue(address.startswith(SITE.replace("http", "ws", 1) + "/2000/simulation/"), address)
            self.assertEqual(len(simulators()), 1)
            self.assertEqual(self.figures()["sessions"], 1)
            async with websockets.connect(f"{address}/", max_size=None) as viewer:
                await viewer.send("mjpeg: 320x240")
                await viewer.recv()
                await viewer.send("real-time:-1")
                request = urllib.request.Request(address.replace("ws", "http", 1) + "/mjpeg")
                with urllib.request.urlopen(request, timeout=10) as pictures:
                    received = b""
                    while PICTURE not in received:
                        received += pictures.read1()
        wait_until(lambda: not simulators(), "the simulation goes on without its browser")
        wait_until(lambda: self.figures()["sessions"] == 0, "the session is not over")

    def test_the_operators_pages_show_the_second_machine(self):
        self.assertIn("/2000", self.site.get("/monitor"))

    def figures(self):
        return json.loads(self.site.get("/2000/load", {"Accept": "application/json"}))


if __name__ == "__main__":
    SITE, SECOND_MACHINE = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
