#!/usr/bin/python3
"""An open class has its seats staged: a real session server, a real machine, and the demo simulator (protocol section 13.20)."""

import asyncio
import contextlib
import json
import os
import re
import signal
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import LOCAL, PATIENCE, WORLD  # noqa: E402
from support.servers import SessionServer, SimulationServer, is_alive, main, wait_until  # noqa: E402
from support import web_sockets as websockets  # noqa: E402

PASSWORD = "abcd-efgh-jkmn"
SEATS = 3


class Page:
    """A page on a WebSocket, and what it has heard."""

    def __init__(self, address):
        self.address = address

    async def __aenter__(self):
        self.socket = await websockets.connect(self.address)
        return self

    async def __aexit__(self, *_):
        await self.socket.close()

    async def say(self, **message):
        await self.socket.send(json.dumps(message))

    async def hear(self, is_wanted):
        """The first message that is wanted: a text, or of a class an object."""
        while True:
            text = await asyncio.wait_for(self.socket.recv(), PATIENCE)
            message = json.loads(text) if text.startswith("{") else text
            if is_wanted(message):
                return message


class StagedClass(unittest.IsolatedAsyncioTestCase):
    @contextlib.asynccontextmanager
    async def site(self, machine=None, session=None):
        with SimulationServer(**LOCAL, maxConnections=10, **(machine or {})) as self.simulation:
            keys = {"teacherPassword": PASSWORD, "loadThreshold": 1000, **(session or {})}
            with SessionServer([self.simulation.address], **keys) as self.session:
                await asyncio.to_thread(wait_until, lambda: self.session.get("/") == "1", "the machine has not reported")
                yield

    def page(self, path, server=None):
        return Page(f"ws://localhost:{(server or self.session).port}{path}")

    @contextlib.asynccontextmanager
    async def open_class(self):
        """The page of a teacher whose class is ready, and its code."""
        async with self.page("/class") as teacher:
            await teacher.say(teach={"password": PASSWORD, "world": WORLD, "mode": "mjpeg", "seats": SEATS})
            opened = await teacher.hear(lambda message: "class" in message)
            await teacher.hear(lambda message: message.get("staged") == {"ready": SEATS, "seats": SEATS})
            yield teacher, opened["class"]["code"]

    def processes(self):
        rows = json.loads(self.simulation.get("/monitor", {"Accept": "application/json"}))["simulations"]
        return [row["process"] for row in rows if row["state"] == "staged"]

    def taken(self):
        return int(re.search(r"^webots_staged_taken_total (\S+)$", self.simulation.get("/metrics"), re.M)[1])

    async def check_that_students_get_them(self, **session):
        async with self.site(session=session), self.open_class() as (teacher, code):
            before = self.processes()
            self.assertEqual(len(before), SEATS)
            async with contextlib.AsyncExitStack() as stack:
                for number in range(SEATS):
                    student = await stack.enter_async_context(self.page("/class"))
                    await student.say(join={"code": code, "name": f"Student {number}"})
                    seat = (await student.hear(lambda message: "joined" in message))["joined"]["seat"]
                    address = await asyncio.to_thread(self.session.get, f"/session?class={seat}")
                    simulation = await stack.enter_async_context(Page(f"{address}/client"))
                    relayed = {"waiting": True, "class": seat} if session.get("relay") else {}
                    await simulation.say(start={"url": WORLD, "mode": "mjpeg", **relayed})
                    await simulation.hear(lambda text: text.startswith("webots:"))
                    self.assertEqual(self.taken(), number + 1)
                await teacher.hear(lambda message: message.get("staged", 0) is None)  # there is nothing left to say
                self.assertEqual([process for process in before if not is_alive(process)], [])
                self.assertEqual(self.processes(), [])
            await teacher.say(close=True)
            await asyncio.to_thread(self.simulation.wait_until_clean)

    async def test_students_get_them_at_once_and_none_is_made_for_a_seat_that_is_used(self):
        await self.check_that_students_get_them()

    async def test_so_they_do_through_a_session_server_that_relays(self):
        await self.check_that_students_get_them(relay=True)

    async def test_they_are_given_back_when_the_class_ends(self):
        async with self.site():
            async with self.open_class() as (teacher, _):
                await teacher.say(seats=1)
                await asyncio.to_thread(wait_until, lambda: len(self.processes()) == 1, self.processes)
                await teacher.say(close=True)
                await asyncio.to_thread(self.simulation.wait_until_clean)

    async def test_they_are_given_back_when_the_session_server_is_killed_or_frozen(self):
        async with self.site():
            async with self.open_class():
                self.session.process.kill()
                await asyncio.to_thread(self.simulation.wait_until_clean)
            self.session.start()
            async with self.open_class():
                self.session.process.send_signal(signal.SIGSTOP)
                try:
                    await asyncio.to_thread(self.simulation.wait_until_clean)
                finally:
                    self.session.process.send_signal(signal.SIGCONT)

    async def test_a_restarted_machine_has_them_again(self):
        async with self.site():
            async with self.open_class() as (teacher, _):
                self.simulation.process.kill()
                self.simulation.process.wait()
                await teacher.hear(lambda message: message.get("staged", 0) is None or message.get("staged", {}).get("ready") == 0)
                self.simulation.start()
                await teacher.hear(lambda message: message.get("staged") == {"ready": SEATS, "seats": SEATS})
                self.assertEqual(len(self.simulation.instances()), SEATS)

    async def test_a_machine_whose_operator_does_not_want_it_stages_none(self):
        async with self.site(machine={"stagedForClasses": 0}):
            async with self.page("/client", self.simulation) as stranger:
                await stranger.say(stage=[{"url": WORLD, "mode": "mjpeg", "count": 5}])
                await stranger.hear(lambda text: "nothing more is staged here" in text)
            self.assertEqual(self.simulation.simulators(), [])


if __name__ == "__main__":
    main()
