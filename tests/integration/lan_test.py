#!/usr/bin/python3
"""A site without a name: every machine of the network is told addresses by the name that it called the site.

The visitor is another machine, at the far end of a cable. Protocol section 13.13."""

import json
import os
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import own_network  # noqa: E402
from support.browser_client import LOCAL, WORLD, websockets  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, wait_until  # noqa: E402

assert websockets  # the visitor's own Python needs it

# What a page of the site does: asks for a machine, starts a world, connects to the simulator, and prints what it was told.
VISITOR = """
import asyncio, json, sys, urllib.request
from websockets.legacy.client import connect
site, origin, world, patience = sys.argv[1:4] + [float(sys.argv[4])]

async def visit():
    place = urllib.request.urlopen(f"http://{site}/session", timeout=patience).read().decode()
    told = {"place": place}
    async with connect(place + "/client", extra_headers={"Origin": origin}) as client:
        await client.send(json.dumps({"start": {"url": world, "mode": "w3d"}}))
        while not told.get("simulation"):
            message = await asyncio.wait_for(client.recv(), patience)
            if message.startswith("webots:"):
                told["simulation"] = message[len("webots:"):]
            if message.startswith("loading: Error"):
                raise SystemExit(message)
        async with connect(told["simulation"] + "/", max_size=None) as simulator:
            await simulator.send("w3d")
            while not (await asyncio.wait_for(simulator.recv(), patience)).startswith("scene load completed"):
                pass
    print(json.dumps(told))

asyncio.run(visit())
"""


class Lan(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.outside = cls.enterClassContext(own_network.Outside())
        port = free_port()
        cls.machine = cls.enterClassContext(SimulationServer(**LOCAL, server="*", ssl=False, portRewrite=True, gateway=True, listenAddress="127.0.0.1"))
        cls.session = cls.enterClassContext(SessionServer([{"address": f"*/{cls.machine.port}", "internal": f"127.0.0.1:{cls.machine.port}"}],
                                                          port=port, server="*", ssl=False, portRewrite=True))
        wait_until(lambda: cls.session.get("/") == "1", lambda: f"the session server finds its machine:\n{cls.session.log()}")

    def visit(self, host, origin=None):
        """From the other machine."""
        site = f"{host}:{self.session.port}"
        command = ["nsenter", "-t", str(self.outside.process.pid), "-n", sys.executable, "-c", VISITOR, site, origin or f"http://{site}", WORLD, str(PATIENCE)]
        return subprocess.run(command, capture_output=True, text=True, timeout=4 * PATIENCE, check=False)

    def assert_leads_to(self, host, seen):
        self.assertEqual(seen.returncode, 0, seen.stderr + self.session.log() + self.machine.log())
        told = json.loads(seen.stdout)
        site = f"ws://{host}:{self.session.port}/{self.machine.port}"
        self.assertEqual(told["place"], site)
        self.assertRegex(told["simulation"], f"^{site}/simulation/[a-zA-Z]+/[0-9]+$")

    def test_another_machine_is_sent_to_the_address_that_it_asked(self):
        self.assert_leads_to(own_network.OWN, self.visit(own_network.OWN))

    def test_this_machine_is_sent_to_itself(self):
        self.assertEqual(self.session.get("/session"), f"ws://localhost:{self.session.port}/{self.machine.port}")

    def test_a_page_of_the_internet_is_refused(self):
        seen = self.visit(own_network.OWN, origin="http://evil.example")
        self.assertNotEqual(seen.returncode, 0)
        self.assertIn("403", seen.stderr)


if __name__ == "__main__":
    own_network.enter()
    main()
