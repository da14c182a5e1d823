#!/usr/bin/python3
"""Tickets: with `sessionSecret` simulations start through the session server alone. docs/gateway.md, "Tickets"."""

import asyncio
import base64
import hashlib
import hmac
import json
import os
import secrets
import shutil
import struct
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import LOCAL, PATIENCE, WORLD, websockets  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402

EXPIRED = "loading: Error: The ticket for this simulation has expired: please start again. If that happens every time, the clocks of this site's machines differ."
MISSING = "loading: Error: Simulations of this site start through its session server: please start again from the site's own page."
UNKNOWN = "loading: Error: This machine does not know the ticket of its session server: its operator finds the reason in the log."
USED = "loading: Error: The ticket for this simulation has been used: please start again."


def ticket(secret, server, expiry, nonce=None):
    """Written from docs/gateway.md, not from our code."""
    content = struct.pack(">Q", int(expiry * 1000)) + (nonce or os.urandom(16))
    code = hmac.new(secret.encode(), b"webots_cloud ticket 1\n" + content + server.encode(), hashlib.sha256).digest()
    return base64.urlsafe_b64encode(content + code).decode().rstrip("=")


async def start(address):
    """What a browser is told that asks for a simulation: its address, or why there is none."""
    async with websockets.connect(address) as socket:
        await socket.send(json.dumps({"start": {"url": WORLD, "mode": "mjpeg"}}))
        while True:
            message = await asyncio.wait_for(socket.recv(), PATIENCE)
            if message.startswith(("webots:", "loading: Error: ")):
                return message


class Tickets(unittest.IsolatedAsyncioTestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="webots_cloud_tickets_")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.secret = secrets.token_hex(32)
        cls.file = cls.write_secret("secret", cls.secret)
        cls.simulation = cls.enterClassContext(SimulationServer(sessionSecret=cls.file, **LOCAL))
        cls.neighbour = cls.enterClassContext(SimulationServer(sessionSecret=cls.file, **LOCAL))
        cls.session = cls.enterClassContext(SessionServer([cls.simulation.address], sessionSecret=cls.file))
        wait_until(lambda: cls.session.get("/") == "1", "the session server finds the simulation server")

    @classmethod
    def write_secret(cls, name, word, mode=0o600):
        path = os.path.join(cls.folder, name)
        with open(path, "w") as file:
            file.write(word + "\n")
        os.chmod(path, mode)
        return path

    def ticket(self, **changes):
        parts = {"secret": self.secret, "server": self.simulation.address, "expiry": time.time() + 60, **changes}
        return ticket(**parts)

    async def shown(self, text, server=None):
        """What a browser with this ticket is told."""
        return await start(f"ws://{(server or self.simulation).address}/ticket/{text}/client")

    async def test_the_session_server_sends_browsers_with_a_ticket_that_starts_one_simulation(self):
        address = self.session.get("/session")
        self.assertRegex(address, rf"^ws://{self.simulation.address}/ticket/[A-Za-z0-9_-]{{75}}$")
        self.assertNotEqual(self.session.get("/session"), address)
        self.assertRegex(await start(f"{address}/client"), "^webots:ws://localhost:")
        self.assertEqual(await start(f"{address}/client"), USED)

    async def test_nobody_goes_around_the_session_server(self):
        await asyncio.to_thread(self.simulation.wait_until_clean)  # of other tests
        self.assertEqual(await start(f"ws://{self.simulation.address}/client"), MISSING)
        self.assertEqual(await self.shown("A" * 75), UNKNOWN)
        self.assertEqual(await self.shown(self.ticket(secret=secrets.token_hex(32))), UNKNOWN)
        self.assertIn('not of a session server with our "sessionSecret"', self.simulation.log())
        self.assertEqual(self.simulation.instances(), [], "nothing was fetched for them")

    async def test_a_ticket_is_for_one_machine_and_for_a_minute(self):
        good = self.ticket()
        self.assertEqual(await self.shown(good, server=self.neighbour), UNKNOWN)
        self.assertEqual(await self.shown(self.ticket(expiry=time.time() - 1)), EXPIRED)
        self.assertEqual(await self.shown(self.ticket(expiry=time.time() + 3600)), EXPIRED, "nobody makes such tickets")
        self.assertRegex(await self.shown(good), "^webots:", "it is what the documentation says")

    async def test_a_changed_expiry_is_a_forged_ticket(self):
        nonce = os.urandom(16)
        old, new = (self.ticket(expiry=time.time() + seconds, nonce=nonce) for seconds in (-10, 50))
        self.assertEqual(await self.shown(new[:10] + old[10:]), UNKNOWN)

    def test_a_secret_that_others_may_read_is_refused_at_the_start(self):
        for word, mode, why in (("a" * 32, 0o644, "others may read it too"), ("short", 0o600, "at least 16 characters")):
            file = self.write_secret("bad", word, mode)
            for server in (SessionServer([], sessionSecret=file), SimulationServer(sessionSecret=file)):
                with self.assertRaisesRegex(AssertionError, why):
                    try:
                        server.start()
                    finally:
                        server.close()

    async def test_a_server_without_a_secret_takes_browsers_with_tickets_too(self):
        with SimulationServer(**LOCAL) as simulation:  # while a site is changed over
            self.assertRegex(await self.shown(self.ticket(), server=simulation), "^webots:")


if __name__ == "__main__":
    main()
