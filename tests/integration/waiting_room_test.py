#!/usr/bin/python3
"""The waiting room of a session server, with real simulation servers: who finds no seat waits, in order, and gets the next one.

Protocol section 13.16; the rule and its bounds are in docs/scheduling.md.
"""

import asyncio
import contextlib
import json
import os
import random
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support.browser_client import WORLD, server  # noqa: E402
from support.servers import SessionServer, main, wait_until  # noqa: E402
from support.visitor import NONE_FREE, Visitor  # noqa: E402
from support.waiting import wait_until_async  # noqa: E402

PEOPLE, MACHINES, SEATS = 30, 3, 2
ARRIVE = 10  # seconds in which all of them come
STAY = (5, 15)  # seconds in their simulation

# A seat that a machine reports as free while somebody waits is given out within a second. What the limit guards: the session server looks for
# a free seat when somebody leaves, and not only when the next poll is due, every POLL seconds: with those alone, at least one of the 24 who
# wait would wait longer. BUSY is for a machine on which processes wait for their turn.
IDLE, BUSY = 1, 2
POLL = 8
TURN = "loading: A machine is free."
AT_ONCE = 0.5  # seconds between two turns that count as one moment


def is_up(machines):
    return f'webots_servers{{state="up"}} {machines}\n'


class Person(Visitor):
    """Somebody who wants a simulation, and whose page returns when it loses its connection, as our viewer does."""

    def __init__(self, session):
        super().__init__(session)
        self.arrived = None  # a moment, as all of these
        self.in_line = None  # since when
        self.granted = None
        self.back = None  # over the restart, and told so
        self.address = None

    @staticmethod
    def now():
        return asyncio.get_running_loop().time()

    async def visit(self, stay):
        """From the arrival to the end."""
        await self.start(reconnect=True, waiting=True)
        self.arrived = self.now()
        await self.be_served()
        leaves = self.now() + stay
        while (left := leaves - self.now()) > 0:
            await asyncio.wait([self.listening], timeout=left)
            if self.close_code is not None:
                await self.be_served()
        await self.leave()

    async def be_served(self):
        """Until it has its simulation, however often the connection is lost."""
        since = 0 if self.close_code is None else await self.return_to_session()
        while True:
            await self.until(lambda: self.find("webots:", since) or self.close_code is not None, "a machine")
            self.note_moments()
            if address := self.find("webots:", since):
                break
            since = await self.return_to_session()
        assert self.address in (None, address), "it is another simulation"
        self.address = address

    def note_moments(self):
        moment = {beginning: next((when for when, text in self.heard if text.startswith(beginning)), None)
                  for beginning in ("waiting: ", TURN, "webots:")}
        self.in_line = moment["waiting: "]
        self.granted = moment[TURN] or moment["webots:"]

    async def return_to_session(self):
        """A new connection, as soon as there is somebody to connect to; returns how much it was told before."""
        assert self.close_code == 1012, (self.close_code, self.told)
        self.note_moments()
        last = {beginning: next((text.removeprefix(beginning) for text in reversed(self.told) if text.startswith(beginning)), None)
                for beginning in ("reconnectToken: ", "waitingTicket: ")}
        start = {"url": WORLD, "mode": "mjpeg", "reconnect": True, "waiting": True}
        if last["waitingTicket: "]:
            start["waitingTicket"] = last["waitingTicket: "]
        message = {"reconnect": last["reconnectToken: "]} if last["reconnectToken: "] else {"start": start}

        async def connect():
            with contextlib.suppress(OSError):
                await self.come_back(**message)
                return True

        told = len(self.told)
        await wait_until_async(connect, "the session server does not come back")
        await self.until(lambda: len(self.told) > told or self.close_code is not None, "any word after the return")
        self.back = self.now()
        return told

    def waits_at(self, moment):
        return self.in_line is not None and self.in_line <= moment and (self.granted is None or moment < self.granted)

    def wants_any_seat_at(self, moment):
        """Waits, and not for a machine with more room: beside other tests, machines with free seats may be too busy for one more simulation."""
        place = next((text for when, text in reversed(self.heard) if when <= moment and text.startswith("waiting: ")), "")
        return self.waits_at(moment) and not place.endswith(" room")


class Room(unittest.IsolatedAsyncioTestCase):
    async def session(self, machines, **settings):
        session = SessionServer([machine.address for machine in machines], **{"relay": True, **settings})
        self.addCleanup(session.close)
        await self.begin(session, len(machines))
        return session

    @staticmethod
    async def begin(session, machines):
        await asyncio.to_thread(session.start)
        await asyncio.to_thread(wait_until, lambda: is_up(machines) in session.get("/metrics"),
                                lambda: f"all machines have answered:\n{session.log()}")

    def machine(self, seats):
        return self.enterContext(server(maxConnections=seats))

    async def visitor(self, session, **members):
        """A browser that has sent its `start`."""
        browser = await self.enterAsyncContext(Visitor(session))
        await browser.start(**members)
        return browser

    async def full_site(self, **settings):
        """A session server with one seat, and who has it."""
        session = await self.session([self.machine(1)], **settings)
        holder = await self.visitor(session)
        await holder.hear("webots:")
        await asyncio.to_thread(wait_until, lambda: session.get("/") == "0", "the session server knows that no seat is free")
        return session, holder

    @staticmethod
    async def figure_is(session, name, value):
        await asyncio.to_thread(wait_until, lambda: f"webots_{name} {value}\n" in session.get("/metrics"),
                                lambda: f"{name} is {value}:\n{session.get('/metrics')}")


class Line(Room):
    async def test_who_finds_no_seat_waits_and_starts_by_itself(self):
        session, holder = await self.full_site()
        browser = await self.visitor(session)
        self.assertEqual(await browser.hear("queue:"), "queue:0")
        await browser.hear("loading: ")
        self.assertIsNone(browser.find("waiting"), "pages of today do not know these messages")
        self.assertEqual((session.get("/"), session.get("/session")), ("0", f"ws://{session.address}"))
        self.assertIs(json.loads(session.get("/viewer/defaults.json"))["waiting"], True)
        await self.figure_is(session, "waiting", 1)
        await holder.leave()
        await browser.hear(TURN)
        await browser.hear("webots:")
        self.assertEqual(browser.errors(), [])
        await self.figure_is(session, "waiting", 0)

    async def test_who_leaves_makes_room_at_once_for_those_behind(self):
        session, holder = await self.full_site()
        first, second = await self.visitor(session), await self.visitor(session, waiting=True)
        self.assertRegex(await second.hear("waiting: "), r"^waiting: 1 (- -|\d+ \d+)$")
        await first.leave()
        await second.hear("waiting: 0 ")
        await self.figure_is(session, "waiting", 1)
        await self.figure_is(session, "waiting_given_up_total", 1)
        await holder.leave()
        await second.hear("webots:")

    async def test_a_full_room_refuses_in_the_old_words(self):
        session, _ = await self.full_site(waitingRoom=1)
        first = await self.visitor(session)
        await first.hear("queue:0")
        self.assertEqual(session.get("/session"), "Error: no simulation server available at the moment.")
        late = await self.enterAsyncContext(Visitor(session))
        await late.come_back(start={"url": WORLD})
        await late.hear_end()
        self.assertEqual(late.told, [NONE_FREE])
        await self.figure_is(session, "waiting_refused_total", 1)
        await first.leave()
        await self.figure_is(session, "waiting", 0)
        again = await self.visitor(session)
        await again.hear("queue:0")

    async def test_without_a_room_nobody_waits(self):
        session, _ = await self.full_site(waitingRoom=0)
        self.assertEqual(session.get("/session"), "Error: no simulation server available at the moment.")
        self.assertIsNot(json.loads(session.get("/viewer/defaults.json")).get("waiting"), True)
        late = await self.enterAsyncContext(Visitor(session))
        await late.come_back(start={"url": WORLD})
        await late.hear_end()
        self.assertEqual(late.told, [NONE_FREE])

    async def test_who_loses_the_connection_keeps_the_place_by_a_ticket(self):
        session, holder = await self.full_site()
        first, second = await self.visitor(session, waiting=True), await self.visitor(session)
        ticket = (await first.hear("waitingTicket: ")).removeprefix("waitingTicket: ")
        await second.hear_place(1)
        await first.vanish()
        await second.hear_place(0)
        told = len(second.told)
        await first.come_back(start={"url": WORLD, "waiting": True, "waitingTicket": ticket})
        await second.hear_place(1, since=told)
        await holder.leave()
        await first.hear("webots:")
        self.assertIsNone(second.find(TURN))

    async def test_of_two_connections_with_one_ticket_the_last_has_the_place(self):
        session, holder = await self.full_site()
        first = await self.visitor(session, waiting=True)
        ticket = (await first.hear("waitingTicket: ")).removeprefix("waitingTicket: ")
        second = await self.enterAsyncContext(Visitor(session))
        await second.come_back(start={"url": WORLD, "waiting": True, "waitingTicket": ticket})
        await second.hear_place(0)
        await first.hear_end()
        await self.figure_is(session, "waiting", 1)
        await holder.leave()
        await second.hear("webots:")
        self.assertIsNone(first.find("webots:"))
        # It has been used.
        late, third = await self.visitor(session), await self.enterAsyncContext(Visitor(session))
        await late.hear("queue:0")
        await third.come_back(start={"url": WORLD, "waitingTicket": ticket})
        await third.hear("queue:1")

    async def test_a_ticket_that_is_none_leads_to_the_end_of_the_line(self):
        session, _ = await self.full_site()
        first = await self.visitor(session)
        await first.hear("queue:0")
        for ticket in ("", "nonsense", "A" * 86, "A" * 1000):
            async with Visitor(session) as browser:
                await browser.start(waitingTicket=ticket)
                await browser.hear("queue:1")
        self.assertIsNone(first.find("queue:1"))


class ThirtyPeople(Room):
    """Of three machines with two seats each."""

    async def asyncSetUp(self):
        self.random = random.Random(int(os.environ.get("WAITING_SEED", "1")))
        self.machines = [self.machine(SEATS) for _ in range(MACHINES)]
        self.site = await self.session(self.machines, loadRefresh=POLL)
        self.people = [Person(self.site) for _ in range(PEOPLE)]
        self.free = [[] for _ in self.machines]  # of each machine, (moment, whether it reported a free seat)
        self.restart = None  # a moment

    async def report(self, machine, reports):
        """Asks a machine all the time how many seats it has free."""
        while True:
            answer = await asyncio.to_thread(machine.get, "/load", {"Accept": "application/json"})
            reports.append((Person.now(), json.loads(answer)["sessions"] < SEATS))
            await asyncio.sleep(0.1)

    async def come(self, person, moment):
        await asyncio.sleep(moment)
        await person.visit(self.random.uniform(*STAY))

    async def restart_in_the_middle(self):
        async def is_the_middle():
            for person in self.people:
                person.note_moments()
            served = sum(person.granted is not None for person in self.people)
            return served >= PEOPLE * 2 // 5 and all(person.arrived for person in self.people)

        await wait_until_async(is_the_middle, "most people still wait")
        began = Person.now()
        self.waited = [person for person in self.people if person.waits_at(began)]
        self.ran = [person for person in self.people if person.address and person.close_code is None]
        self.assertEqual(await asyncio.to_thread(self.site.stop), 0)
        await self.begin(self.site, MACHINES)
        self.restart = began

    def is_upset(self, moment):
        """Whether the session server was down then, or some had not returned to it."""
        end = max(person.back for person in self.waited + self.ran if person.back)
        return self.restart <= moment <= end + IDLE

    def idle_spells(self):
        """How long seats were reported as free while somebody waited."""
        for reports in self.free:
            since = None
            for moment, free in reports:
                wanted = free and not self.is_upset(moment) and any(person.wants_any_seat_at(moment) for person in self.people)
                since = (since or moment) if wanted else None
                if since:
                    yield moment - since

    def passed(self):
        """Pairs of people of whom the second was served before the first, who had come earlier and waited."""
        for first in self.people:
            for second in self.people:
                if first.in_line and first.arrived < second.arrived and second.granted < first.granted - AT_ONCE and \
                        not self.is_upset(second.granted):
                    yield self.people.index(first), self.people.index(second)

    async def test_all_are_served_in_the_order_in_which_they_came_over_a_restart_of_the_session_server(self):
        reports = [asyncio.create_task(self.report(*each)) for each in zip(self.machines, self.free)]
        await asyncio.gather(self.restart_in_the_middle(), *(self.come(person, number * ARRIVE / PEOPLE)
                                                             for number, person in enumerate(self.people)))
        for task in reports:
            self.assertFalse(task.done(), "the machines were asked to the end")
            task.cancel()
        self.assertEqual([text for person in self.people for text in person.errors()], [])
        self.assertGreater(len(self.waited), PEOPLE // 4, "the restart hit those who waited")
        self.assertTrue(any(person.back for person in self.ran), "and those who were served")
        self.assertTrue(all(person.back for person in self.waited))
        self.assertTrue(all(any(free for _, free in reports) for reports in self.free), "seats became free on each machine")
        self.assertEqual(list(self.passed()), [])
        self.assertLess(max(self.idle_spells(), default=0), IDLE + BUSY)
        for machine in self.machines:
            await asyncio.to_thread(machine.wait_until_clean)
        await self.figure_is(self.site, "waiting", 0)


if __name__ == "__main__":
    main()
