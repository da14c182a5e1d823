#!/usr/bin/python3
"""Several session servers of one site: they share a secret, and nothing else. What one has promised, the others keep.

docs/scaling.md, "Several session servers".
"""

import asyncio
import json
import os
import re
import secrets
import sys
import tempfile
import types
import unittest
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support import haproxy  # noqa: E402
from support.browser_client import WORLD, server, websockets  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import SessionServer, main, wait_until  # noqa: E402
from support.visitor import Visitor  # noqa: E402
from support.waiting import wait_until_async  # noqa: E402


def last(browser, beginning):
    return next((text.removeprefix(beginning) for text in reversed(browser.told) if text.startswith(beginning)), None)


class Site(unittest.IsolatedAsyncioTestCase):
    def setUp(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        self.secret = os.path.join(folder, "secret")
        with open(os.open(self.secret, os.O_WRONLY | os.O_CREAT, 0o600), "w") as file:
            file.write(secrets.token_hex(32))

    def machine(self, seats):
        return self.enterContext(server(maxConnections=seats, sessionSecret=self.secret))

    async def sessions(self, *machines, **settings):
        """Two session servers for these machines."""
        return [await self.session(*machines, **settings) for _ in range(2)]

    async def session(self, *machines, **settings):
        session = SessionServer([machine.address for machine in machines], **{"relay": True, "sessionSecret": self.secret, **settings})
        self.addCleanup(session.close)
        await asyncio.to_thread(session.start)
        await asyncio.to_thread(wait_until, lambda: f'webots_servers{{state="up"}} {len(machines)}\n' in session.get("/metrics"),
                                lambda: f"all machines have answered:\n{session.log()}")
        return session

    async def visitor(self, session, **members):
        """A browser that has sent its `start`."""
        browser = await self.enterAsyncContext(Visitor(session))
        await browser.start(**members)
        return browser

    @staticmethod
    def kill(session):
        session.process.kill()
        session.process.wait()


class OneDies(Site):
    async def test_a_place_in_the_line_is_kept_at_the_other(self):
        one, other = await self.sessions(self.machine(seats=1))
        holder = await self.visitor(other)
        await holder.hear("webots:")
        await asyncio.to_thread(wait_until, lambda: (one.get("/"), other.get("/")) == ("0", "0"), "both know that no seat is free")
        first = await self.visitor(one, waiting=True)
        await first.hear("waitingTicket: ")
        second = await self.visitor(other, waiting=True)
        await second.hear_place(0)
        self.kill(one)
        await first.hear_end()
        first.server = other
        told = len(second.told)
        await first.come_back(start={"url": WORLD, "waiting": True, "waitingTicket": last(first, "waitingTicket: ")})
        await second.hear_place(1, since=told)  # who came first is ahead
        await holder.leave()
        await first.hear("webots:")
        self.assertIsNone(second.find("webots:"))

    async def test_a_simulation_goes_on_at_the_other(self):
        machine = self.machine(seats=2)
        one, other = await self.sessions(machine)
        browser = await self.visitor(one, reconnect=True)
        address = await browser.hear("webots:")
        token = (await browser.hear("reconnectToken: ")).removeprefix("reconnectToken: ")
        simulators = set(machine.simulators())
        self.kill(one)
        await browser.hear_end()
        browser.server = other
        self.assertEqual(await browser.find_again(token), address)
        self.assertEqual(set(machine.simulators()), simulators, "nothing was started anew")
        await browser.leave()
        await asyncio.to_thread(machine.wait_until_clean)


class Alike(Site):
    async def test_machines_take_the_tickets_of_both_and_each_once(self):
        machine = self.machine(seats=4)
        for session in await self.sessions(machine, relay=False):
            address = session.get("/session")
            self.assertRegex(address, rf"^ws://{machine.address}/ticket/")
            browser = await self.enterAsyncContext(Visitor(session))
            await browser.open(address)
            await browser.say(start={"url": WORLD, "mode": "mjpeg"})
            await browser.hear("webots:")
            late = await self.enterAsyncContext(Visitor(session))
            await late.open(address)
            await late.say(start={"url": WORLD, "mode": "mjpeg"})
            await late.hear("loading: Error: ")

    async def test_a_seat_that_one_has_given_away_the_other_does_not_offer(self):
        one, other = await self.sessions(self.machine(seats=1))
        holder = await self.visitor(one)
        await holder.hear("webots:")
        late = await self.visitor(other)
        await late.hear("queue:0")
        self.assertEqual(late.errors(), [])
        await holder.leave()
        await late.hear("webots:")


class AskedBeforePlacing(Site):
    def setUp(self):
        super().setUp()
        self.home = self.enterContext(tempfile.TemporaryDirectory())
        with open(os.open(os.path.join(self.home, "webots"), os.O_WRONLY | os.O_CREAT, 0o755), "w") as file:
            file.write("#!/bin/sh\nexec sleep 1000\n")

    def machine(self, seats):
        """Its simulations go on starting, so they count, and show in no load."""
        return self.enterContext(server(maxConnections=seats, sessionSecret=self.secret, webotsHome=self.home))

    @staticmethod
    def sessions_of(machine):
        return json.loads(machine.get("/load", {"Accept": "application/json"}))["sessions"]

    async def test_whom_one_has_sent_a_moment_ago_the_other_knows(self):
        crowded, empty = self.machine(seats=9), self.machine(seats=9)
        one, other = await self.session(crowded), await self.session(crowded, empty)
        await self.visitor(one)
        first = f'webots_machine_simulations{{machine="{crowded.address}"}} 1\n'
        await asyncio.to_thread(wait_until, lambda: first in other.get("/metrics"), "the other sees that it is not alone")
        for _ in range(4):
            await self.visitor(one)
        await asyncio.to_thread(wait_until, lambda: self.sessions_of(crowded) == 5, "five have come")
        for count in range(1, 5):
            await self.visitor(other)
            await asyncio.to_thread(wait_until, lambda count=count: self.sessions_of(crowded) + self.sessions_of(empty) == 5 + count, "they have come")
        self.assertEqual((self.sessions_of(crowded), self.sessions_of(empty)), (5, 4))
        asked = int(re.search(r"^webots_relay_questions_total (\d+)$", other.get("/metrics"), re.MULTILINE)[1])
        self.assertGreaterEqual(asked, 1)
        self.assertIn("webots_relay_questions_total 0\n", one.get("/metrics"), "it has placed all that it has heard of")


class Returning(Visitor):
    """A page that returns by itself to the address that it came to, as our viewer does."""

    async def visit(self):
        """Until it has its simulation."""
        await self.start(reconnect=True, waiting=True)
        await self.be_served()

    async def be_served(self):
        since = 0
        while True:
            await self.until(lambda: self.find("webots:", since) or self.close_code is not None, "a simulation")
            if address := self.find("webots:", since):
                return address
            since = await self.return_to_site()

    async def return_to_site(self):
        """Returns how much it was told before."""
        assert not self.errors(), self.errors()
        start = {"url": WORLD, "mode": "mjpeg", "reconnect": True, "waiting": True}
        if ticket := last(self, "waitingTicket: "):
            start["waitingTicket"] = ticket
        token = last(self, "reconnectToken: ")
        told = len(self.told)

        async def connect():
            try:
                await self.come_back(**{"reconnect": token} if token else {"start": start})
                return True
            except (OSError, websockets.InvalidHandshake):  # the balancer has not noticed yet
                return False

        await wait_until_async(connect, "nobody answers at the address of the site")
        return told


class BehindABalancer(Site):
    async def test_half_of_a_site_is_killed_and_nobody_loses_more_than_a_connection(self):
        machines = [self.machine(seats=4) for _ in range(2)]
        pair = await self.sessions(*machines)
        port = free_port()
        self.enterContext(haproxy.balancer(port, [session.port for session in pair]))

        def get(path, headers=None):
            with urllib.request.urlopen(urllib.request.Request(f"http://localhost:{port}{path}", headers=headers or {}), timeout=60) as answer:
                return answer.read().decode()

        site = types.SimpleNamespace(url=f"http://localhost:{port}", get=get)
        seated = [await self.enterAsyncContext(Returning(site)) for _ in range(8)]
        await asyncio.gather(*(browser.visit() for browser in seated))
        addresses = [browser.find("webots:") for browser in seated]
        self.assertEqual(len(set(addresses)), 8)
        waiting = [await self.enterAsyncContext(Returning(site)) for _ in range(4)]
        visits = [asyncio.create_task(browser.visit()) for browser in waiting]
        for browser in waiting:
            await browser.until(lambda browser=browser: browser.find("waitingTicket: "), "a place in the line")

        at_one = int(re.search(r"^webots_relayed (\d+)$", pair[0].get("/metrics"), re.MULTILINE)[1])
        self.assertTrue(0 < at_one < 8, at_one)
        self.kill(pair[0])
        lost = lambda: [number for number, browser in enumerate(seated) if browser.close_code is not None]  # noqa: E731

        async def all_know():
            return len(lost()) == at_one

        await wait_until_async(all_know, lambda: f"{at_one} notice it, not {len(lost())}")
        for number in lost():
            told = await seated[number].return_to_site()
            self.assertEqual(await seated[number].hear("webots:", since=told), addresses[number], "it is another simulation")
        for browser in seated[:4]:
            await browser.leave()
        await asyncio.wait_for(asyncio.gather(*visits), 100)
        for browser in [*seated, *waiting]:
            self.assertEqual(browser.errors(), [])


if __name__ == "__main__":
    main()
