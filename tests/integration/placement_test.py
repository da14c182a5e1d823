#!/usr/bin/python3
"""Where the session server sends browsers: the real process, with fake machines that report as real ones do.

The same in virtual time, over many seeds and with every kind of trouble: tests/bench/placement_simulation, docs/scheduling.md.
"""

import asyncio
import concurrent.futures
import contextlib
import json
import os
import random
import sys
import threading
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.machine import Machine  # noqa: E402
from support.servers import SessionServer, main, wait_until  # noqa: E402

try:
    from support import web_sockets as websockets
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-websockets)") or 77)

SEATS = 8
POLL = 0.2  # seconds


class Seated(Machine):
    """A machine that counts arrivals, as our simulation server does. During a test no session adds to its load: all are still starting."""

    def __init__(self, base, capacity=None, bare=False):
        super().__init__()
        self.thread = threading.Thread(target=self.server.serve_forever, args=(0.02,), daemon=True)  # it ends sooner: there are many
        self.base, self.capacity, self.bare = base, capacity, bare
        self.came = 0
        self.tell()

    def tell(self):
        report = {"load": self.base, "sessions": self.came, "starting": self.came, "arrivals": self.came, "failed": 0, "departures": 0,
                  "draining": False, "version": "1"}
        if self.capacity is not None:
            report["capacity"] = self.capacity
        self.load = str(self.base) if self.bare else json.dumps(report)

    def seat(self):
        self.came += 1
        self.tell()


def wait_for_polls(machine, count):
    seen = len(machine.polls)
    wait_until(lambda: len(machine.polls) >= seen + count, "the machine is not polled")


def serve(stack, machines, **config):
    """A session server that has a report of each machine."""
    for machine in machines:
        stack.enter_context(machine)
    session = stack.enter_context(SessionServer([machine.address for machine in machines], loadRefresh=POLL, loadThreshold=95, **config))
    up = f'webots_servers{{state="up"}} {len(machines)}\n'
    wait_until(lambda: up in session.get("/metrics"), "all machines have answered")
    return session


class Placement(unittest.IsolatedAsyncioTestCase):
    def setUp(self):
        self.random = random.Random(int(os.environ.get("PLACEMENT_SEED", "1")))

    # With a capacity of 100, the default of "maxConnections", 7 to 10 once ended up on one machine: the capacity is a limit, not an estimate.
    def test_a_class_of_sixty_sits_six_on_each_of_ten_machines_whatever_capacity_they_report(self):
        def seat_class(capacity, bases, waits):
            with contextlib.ExitStack() as stack:
                machines = [Seated(base, capacity) for base in bases]
                session = serve(stack, machines)
                by_address = {f"ws://{machine.address}": machine for machine in machines}
                for student in range(60):
                    by_address[session.get("/session")].seat()
                    if student in waits:  # reports come in between, of different ages
                        wait_for_polls(machines[waits[student]], 1)
                return [machine.came for machine in machines]

        classes = {capacity: (capacity, [round(self.random.uniform(0, 10), 2) for _ in range(10)],
                              {self.random.randrange(60): self.random.randrange(10) for _ in range(6)}) for capacity in (100, SEATS, None)}
        with concurrent.futures.ThreadPoolExecutor(len(classes)) as pool:
            seated = {capacity: pool.submit(seat_class, *lesson) for capacity, lesson in classes.items()}
            for capacity, seating in seated.items():
                with self.subTest(capacity=capacity):
                    self.assertEqual(max(seating.result()), 6, seating.result())
                    self.assertEqual(sum(seating.result()), 60)

    def test_forty_requests_are_shared_by_two_machines_of_equal_load_whatever_they_report(self):
        with contextlib.ExitStack() as stack:
            ours, python = Seated(10.0, 100), Seated(10.0, bare=True)
            session = serve(stack, [ours, python])
            answers = [session.get("/session") for _ in range(40)]
            self.assertLessEqual(abs(answers.count(f"ws://{ours.address}") - answers.count(f"ws://{python.address}")), 4)
            self.assertEqual(set(answers), {f"ws://{ours.address}", f"ws://{python.address}"})

    # 44 of these once made a site of one machine unavailable for a minute.
    async def test_requests_that_nobody_claims_refuse_nobody(self):
        for kind in ({"capacity": 20}, {"capacity": 100}, {"bare": True}):
            with self.subTest(kind), contextlib.ExitStack() as stack:
                machine = Seated(2.4, **kind)
                session = serve(stack, [machine])
                wait_until(lambda: session.get("/") == "1", "it is available")
                async with websockets.connect(f"ws://localhost:{session.port}/") as browser:
                    self.assertEqual(await browser.recv(), "1")
                    for _ in range(2):
                        self.assertEqual({session.get("/session") for _ in range(110)}, {f"ws://{machine.address}"})
                        await asyncio.to_thread(wait_for_polls, machine, 2)
                    self.assertIn('webots_placements_total{result="refused"} 0', session.get("/metrics"))
                    for load, available in ((99, "0"), (20, "1")):
                        machine.base = load
                        machine.tell()
                        await asyncio.to_thread(wait_until, lambda: session.get("/") == available, f"{load} % make it {available}")
                    self.assertEqual(session.get("/session"), f"ws://{machine.address}")
                    session.process.terminate()
                    self.assertEqual([message async for message in browser], ["0", "1"], "requests alone flip nothing")

    # Arrivals that a machine counts release reservations at once; absurd counts do nothing more.
    def test_starts_that_failed_give_their_places_back_and_absurd_counters_harm_nobody(self):
        with contextlib.ExitStack() as stack:
            good, other = Seated(10.0), Seated(10.0)
            session = serve(stack, [good, other])
            for _ in range(10):
                session.get("/session")
            good.load = json.dumps({"load": 10.0, "sessions": 0, "starting": 0, "arrivals": 5, "failed": 5, "departures": 5})
            wait_for_polls(good, 3)
            # The other one still expects five.
            self.assertEqual([session.get("/session") for _ in range(4)], [f"ws://{good.address}"] * 4)
            for counters in ({"arrivals": 2 ** 63 - 1}, {"arrivals": 0, "failed": 2 ** 62}, {"arrivals": -1}, {"arrivals": 0, "departures": 1e300},
                             {"arrivals": 0, "failed": []}):
                other.load = json.dumps({"load": 10.0, "sessions": 0, "starting": 0, **counters})
                wait_for_polls(other, 2)
                self.assertIn("webots_available 1\n", session.get("/metrics"))
            other.tell()
            wait_until(lambda: 'webots_servers{state="up"} 2\n' in session.get("/metrics"), "it is believed again")


if __name__ == "__main__":
    main()
