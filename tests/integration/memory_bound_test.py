#!/usr/bin/python3
"""How much memory a server takes at most, whatever all its peers do at once. docs/machine.md gives the figures; the kernel enforces them
here: a server that needed more would be ended, or fail to serve later clients."""

import asyncio
import contextlib
import itertools
import os
import resource
import socket
import ssl
import sys
import tempfile
import threading
import unittest
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import LOCAL, Browser  # noqa: E402
from support.certificates import first_words_of_tls, self_signed  # noqa: E402
from support.cgroup import MemoryGroup  # noqa: E402
from support.hostile_peer import (ENDLESS, HostileGitServer, HostilePeer, pack_of_deltas, pack_of_folders,  # noqa: E402
                                  pack_of_tiny_files, pack_of_waiting_deltas)
from support.machine import Machine  # noqa: E402
from support.projects import EXAMPLES  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, wait_until  # noqa: E402

MEGABYTE = 1024  # kilobytes
FETCH_MEMORY = int(os.environ.get("FETCH_MEMORY", "256"))  # megabytes
FETCH_DISK = 0.1  # gigabytes: 26,000 files

# Megabytes beyond `fetchMemory` and the program: threads, connections, what malloc keeps (docs/machine.md).
BESIDE_FETCHES = 96
SESSION_GROWTH = 32

# Address space, in megabytes: what `ulimit -v` limits. The simulation server's has a gigabyte that mimalloc reserves, and 8 MB of stack for
# each thread. With budgets for each peer and not for all together they took 4,649 and 5,590 MB of real memory.
SIMULATION_SPACE = 1536 + FETCH_MEMORY
SESSION_SPACE = 384


def highest(server):
    """The peak memory of a server, in megabytes."""
    with open(f"/proc/{server.process.pid}/status") as status:
        memory = next((int(line.split()[1]) for line in status if line.startswith("VmHWM:")), None)
    if memory is None:  # it has ended, and is still our child
        raise AssertionError(f"{server.PROGRAM} ended when it was refused memory:\n{server.log()[-3000:]}")
    return memory // MEGABYTE


class Highest:
    """Prints and records the peak memory of a server, however the block ends."""

    def __init__(self, server):
        self.server = server
        self.before = highest(server)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.most = highest(self.server)
        print(f"{self.server.PROGRAM}: {self.before} MB before, then at most {self.most} MB", flush=True)


class Sentences(Browser):
    """A browser whose start fails."""

    async def last_words(self, message):
        await self.socket.send(message)
        await self.hear_all()
        return self.told[-1] if self.told else ""


class Limited:
    """A server to which the kernel gives no more memory than that."""

    space = None  # megabytes of addresses
    group = None  # a MemoryGroup

    def _limit(self):
        super()._limit()
        if self.space:
            resource.setrlimit(resource.RLIMIT_AS, (self.space << 20, self.space << 20))
        if self.group:
            self.group.join()


class LimitedSimulationServer(Limited, SimulationServer):
    pass


class LimitedSessionServer(Limited, SessionServer):
    pass


class SimulationServerTest(unittest.IsolatedAsyncioTestCase):
    EACH = 2  # starts for each attack

    async def test_hostile_forges_and_websites_all_at_once(self):
        group = None
        try:
            group = self.enterContext(MemoryGroup())
            group.limit(32 + FETCH_MEMORY + BESIDE_FETCHES)
        except unittest.SkipTest as why:
            print(f"only under a limit of addresses: {why}", flush=True)
        await self.attack(SIMULATION_SPACE, group)
        if group:
            self.assertEqual(group.killed(), 0, "processes that the kernel has killed")

    async def attack(self, space, group):
        packs = {"deltas": pack_of_deltas(200 << 20), "folders": pack_of_folders(120 << 20),
                 "waiting": pack_of_waiting_deltas(120 << 20), "tiny": pack_of_tiny_files(30_000)}
        forge = HostileGitServer(packs)
        self.addCleanup(forge.close)
        number = itertools.count()
        website = HostilePeer(lambda path, body: ENDLESS[self.website_attacks[next(number) % len(self.website_attacks)]](b"PK\3\4"))
        self.addCleanup(website.close)
        keys = self.enterContext(tempfile.TemporaryDirectory())
        with open(os.path.join(keys, "127.0.0.1"), "w") as file:
            file.write("key\n")
        simulation = LimitedSimulationServer(forges=[forge.url, *LOCAL["forges"]],
                                             allowedRepositories=[forge.url, *LOCAL["allowedRepositories"]], maxConnections=100,
                                             projectsDir=os.path.abspath(EXAMPLES), keyDir=keys, fetchMemory=FETCH_MEMORY,
                                             fetchDisk=FETCH_DISK, startTimeout=60)
        if not simulation.is_sanitized():  # sanitizers reserve terabytes, and keep what was freed
            simulation.space, simulation.group = space, group
        with simulation:
            attacks = [*self.forge_attacks, *(f"pack-{name}" for name in self.forge_attacks), *packs]
            starts = [self.start(simulation, '{"start":{"url":"%s","mode":"mjpeg"}}' % forge.world(name, i))
                      for name in attacks for i in range(self.EACH)]
            init = '{"init":["http://127.0.0.1:%d","robots","arena.wbt","42","Ada","secret","","",""]}' % website.port
            starts += [self.start(simulation, init) for _ in range(len(self.website_attacks) * self.EACH)]
            with Highest(simulation) as memory:
                told = await asyncio.gather(*starts)
            for sentence in told:
                self.assertRegex(sentence, r"^loading: Error: .*\.$")
            if os.environ.get("SHOW_SENTENCES"):
                print(*sorted(set(told)), sep="\n")
            # Newer versions of libcurl count headers as well.
            self.assertTrue(any("lines of headers" in sentence for sentence in told), told)
            async with Browser(simulation) as student:  # who comes after all that
                await student.start()
                await student.hear("webots:")
            self.assertIsNone(simulation.process.poll())
            if simulation.is_sanitized():
                self.skipTest("sanitizers keep what was freed: the memory is theirs")
            self.assertLess(memory.most, memory.before + FETCH_MEMORY + BESIDE_FETCHES, "megabytes; see docs/machine.md")

    # Endless answers that a limit of bytes ends; those that only a deadline ends (chunk extensions, which libcurl skips) are left out.
    forge_attacks = ["headers", "interim", "trailers"]
    website_attacks = ["headers", "trailers"]

    async def start(self, simulation, message):
        async with Sentences(simulation) as browser:
            return await browser.last_words(message)


def visit(port, certificate):
    """`GET /load`, by TLS where there is a certificate; None: it is refused."""
    context = certificate and ssl.create_default_context(cafile=certificate)
    with contextlib.suppress(OSError), urllib.request.urlopen(f"http{'s' if certificate else ''}://localhost:{port}/load", context=context,
                                                              timeout=PATIENCE) as answer:
        return answer.read()


class SessionServerTest(unittest.TestCase):
    MACHINES = 50

    def test_machines_whose_answers_do_not_end(self):
        asked = {name: 0 for name in ENDLESS}
        turns = itertools.cycle(ENDLESS)
        lock = threading.Lock()

        def answer(path, body):
            with lock:
                name = next(turns)
                asked[name] += 1
            return ENDLESS[name](b"12")

        peer = HostilePeer(answer, "0.0.0.0")
        self.addCleanup(peer.close)
        machines = [f"127.0.1.{i + 1}:{peer.port}" for i in range(self.MACHINES)]
        session = LimitedSessionServer(machines, loadRefresh=0.2)
        if not session.is_sanitized():
            session.space = SESSION_SPACE
        with session:
            with Highest(session) as memory:
                wait_until(lambda: min(asked.values()) >= self.MACHINES, lambda: f"asked so far: {asked}")
            self.assertEqual(session.get("/load"), "-1", "nobody of them is believed")
            with Machine("10") as good:
                session.reread(simulationServers=[*machines, good.address])
                wait_until(lambda: session.get("/session") == f"ws://{good.address}", "a browser is sent to the machine that works")
            self.assertIsNone(session.process.poll())
            if session.is_sanitized():
                self.skipTest("sanitizers keep what was freed: the memory is theirs")
            self.assertLess(memory.most, memory.before + SESSION_GROWTH, "megabytes; see docs/machine.md")

    def test_connections_for_which_there_is_no_memory_are_refused_and_the_server_goes_on(self):
        """Each client says most of a long request, or begins to shake hands."""
        folder = self.enterContext(tempfile.TemporaryDirectory())
        certificate, key = self_signed(folder, "DNS:localhost")
        numbers = itertools.count()
        half = b"GET /load HTTP/1.1\r\nHost: localhost\r\nX: " + b"x" * 15_000
        for config, said in (({}, half), ({"sslCertificate": certificate, "sslKey": key}, first_words_of_tls())):
            with self.subTest(config=config), contextlib.ExitStack() as connections:
                session = LimitedSessionServer([], **config)
                if session.is_sanitized():
                    self.skipTest("sanitizers reserve terabytes")
                session.space = 176  # it has 110 when it has started

                def come():
                    connection = connections.enter_context(socket.socket())
                    connection.bind((f"127.0.4.{1 + next(numbers) % 200}", 0))
                    connection.connect(("127.0.0.1", session.port))
                    with contextlib.suppress(ConnectionError):  # refused already
                        connection.sendall(said)

                def says_so():
                    come()
                    return "Connections are refused: there is little memory left" in session.log()
                with session:
                    for _ in range(4_000):
                        come()
                    wait_until(says_so, "the log does not say so")
                    connections.close()
                    self.assertIsNone(session.process.poll(), session.log()[-2000:])
                    wait_until(lambda: visit(session.port, certificate if config else None) == b"-1", "nobody is served any more")


if __name__ == "__main__":
    main()
