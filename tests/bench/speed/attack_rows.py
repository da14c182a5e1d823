"""Rows of what bystanders notice of an attack: the longest wait of a client that sends a request every five milliseconds. Beside it the same of an
idle process on the same machine: its own pauses, for which no server can do anything."""

import asyncio
import contextlib
import os
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import threading
import time

from peers import LOAD_CORE, Floor, FreeSimulationServer, Machines, PinnedSessionServer, Tool, cpu_seconds, on_core
from row import Row, itself
from support.browser_client import LOCAL, Browser
from support.certificates import self_signed
from support.name_server import HangingNames
from support.servers import SimulationServer

ATTACKS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "attacks.py")
NEWCOMER = os.path.join(os.path.dirname(ATTACKS), "newcomer.py")
REQUESTS_A_SECOND = 200


def longest_waits(server, quick):
    """Of requests to a server and, at the same time, to one that does nothing else, in milliseconds."""
    seconds = 2 if quick else 6
    before, begin = cpu_seconds(server.pid), time.monotonic()
    with Floor("http") as idle, Tool("probe", server.port, "/livez", REQUESTS_A_SECOND, seconds) as probe, \
            Tool("probe", idle.port, "/livez", REQUESTS_A_SECOND, seconds) as idle_probe:
        _, lost, median, _, longest = probe.hear("requests")
        idle_longest = idle_probe.hear("requests")[-1]
    if lost:
        raise AssertionError(f"{lost} requests got no answer")
    used = (cpu_seconds(server.pid) - before) / (time.monotonic() - begin) * 100
    return {"ours": longest / 1e3, "median": median / 1e3, "an idle process": idle_longest / 1e3, "% of a core": used}


@contextlib.contextmanager
def attacker(*arguments):
    process = subprocess.Popen([sys.executable, ATTACKS, *map(str, arguments)], preexec_fn=on_core(LOAD_CORE))
    try:
        time.sleep(0.5)
        yield
    finally:
        process.kill()
        process.wait()


def attacked_session_server(*attack):
    @contextlib.contextmanager
    def setting(quick):
        def measure():
            with Machines(10) as machines, PinnedSessionServer(machines) as server:
                server.wait_for_polls(machines)
                with attacker(attack[0], server.port, *attack[1:]):
                    return longest_waits(server, quick)
        yield measure
    return setting


def newcomers(server, seconds):
    """How long those wait who connect anew, by TLS, in milliseconds, beside the same at an idle server."""
    def visit(port):
        return subprocess.Popen([sys.executable, NEWCOMER, str(port), str(seconds)], text=True, stdout=subprocess.PIPE,
                                preexec_fn=on_core(LOAD_CORE))

    def told(visits):
        return [float(number) for number in visits.communicate()[0].split()[1:]]
    with tempfile.TemporaryDirectory() as folder:
        certificate, key = self_signed(folder, "DNS:localhost")
        with Machines(1) as machines, PinnedSessionServer(machines, sslCertificate=certificate, sslKey=key) as idle:
            before, begin = cpu_seconds(server.pid), time.monotonic()
            attacked, other = visit(server.port), visit(idle.port)
            (longest, median, _), (idle_longest, *_) = told(attacked), told(other)
            used = (cpu_seconds(server.pid) - before) / (time.monotonic() - begin) * 100
    return {"ours": longest, "median": median, "an idle process": idle_longest, "% of a core": used}


def flooded_with_hellos(rate, addresses=1):
    @contextlib.contextmanager
    def setting(quick):
        def measure():
            with tempfile.TemporaryDirectory() as folder, Machines(10) as machines:
                certificate, key = self_signed(folder, "DNS:localhost")
                with PinnedSessionServer(machines, sslCertificate=certificate, sslKey=key) as server, \
                        attacker("hellos", server.port, rate, addresses):
                    return newcomers(server, 2 if quick else 6)
        yield measure
    return setting


def attacked_simulation_server(*attack):
    @contextlib.contextmanager
    def setting(quick):
        def measure():
            with FreeSimulationServer(**LOCAL) as server, attacker(attack[0], server.port, *attack[1:]):
                return longest_waits(server, quick)
        yield measure
    return setting


@contextlib.contextmanager
def home_of(kind):
    """A folder whose `webots` is a simulator of that kind."""
    folder = tempfile.mkdtemp(prefix="webots_cloud_speed_")
    try:
        program = os.path.join(folder, "webots")
        with open(program, "w") as file:
            file.write(f'#!/bin/sh\nexec "{sys.executable}" "{ATTACKS}" simulator {kind} "$@"\n')
        os.chmod(program, stat.S_IRWXU)
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


class BesideSimulators(SimulationServer):
    """Not pinned, as its simulators are not."""

    def __init__(self, home, **config):
        super().__init__(webotsHome=home, **config)

    @property
    def pid(self):
        return self.process.pid


@contextlib.contextmanager
def asking_for_the_monitor(server):
    """So that the server looks at what simulators consume."""
    over = threading.Event()

    def ask():
        while not over.wait(0.5):
            server.get("/monitor")
    thread = threading.Thread(target=ask)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def beside_simulator(kind):
    @contextlib.contextmanager
    def setting(quick):
        async def attack(server):
            async with Browser(server) as browser:
                await browser.start()
                await browser.hear("shutdownTimeout:")
                await asyncio.sleep(1 if quick else 3)  # until it is at it
                with asking_for_the_monitor(server):
                    return longest_waits(server, quick)

        def measure():
            with home_of(kind) as home, BesideSimulators(home, **LOCAL) as server:
                return asyncio.run(attack(server))
        yield measure
    return setting


@contextlib.contextmanager
def hanging_names(quick):
    """64 simulation servers whose names hang. Needs root, for the namespace and the port."""
    def measure():
        with HangingNames() as names, Machines(10) as machines:
            machines.addresses += [f"hangs{number}.example.org:2000" for number in range(64)]
            server = PinnedSessionServer(machines)
            server.wrapper = names.wrapper
            with server:
                names.socket.settimeout(30)
                names.socket.recv(512)  # it asks
                return longest_waits(server, quick)
    yield measure


@contextlib.contextmanager
def pipe_as_configuration(quick):
    """Read again ten times a second, by SIGHUP."""
    def measure():
        with Machines(10) as machines, PinnedSessionServer(machines) as server:
            server.wait_for_polls(machines)
            path = os.path.join(server.folder, "config.json")
            os.unlink(path)
            os.mkfifo(path)
            over = threading.Event()

            def hang_up():
                while not over.wait(0.1):
                    os.kill(server.pid, signal.SIGHUP)
            thread = threading.Thread(target=hang_up)
            thread.start()
            try:
                return longest_waits(server, quick)
            finally:
                over.set()
                thread.join()
    yield measure


GOAL = ("ms", "at most 20 ms", 20, itself)

ROWS = [
    Row("longest wait of `GET /livez` beside a simulation of 300 processes with 1,000 files each", *GOAL, beside_simulator("processes")),
    Row("longest wait of `GET /livez` beside a simulator that prints newlines without end", *GOAL, beside_simulator("newlines")),
    Row("longest wait of `GET /livez` while 15 MB of WebSocket frames of six bytes come, session server", *GOAL,
        attacked_session_server("frames", "/", 15)),
    Row("longest wait of `GET /livez` while 15 MB of WebSocket frames of six bytes come, simulation server", *GOAL,
        attacked_simulation_server("frames", "/monitor", 15)),
    Row("longest wait of `GET /livez` while 300 clients ask for `/monitor` and do not read, simulation server", *GOAL,
        attacked_simulation_server("pages", "/monitor", 300)),
    Row("longest wait of `GET /livez` while 300 clients ask for `/monitor` and do not read, session server", *GOAL,
        attacked_session_server("pages", "/monitor", 300)),
    Row("longest wait of `GET /livez` while 64 names of simulation servers hang", *GOAL, hanging_names),
    Row("longest wait of `GET /livez` while a pipe is in the place of the configuration, at ten SIGHUPs a second", *GOAL,
        pipe_as_configuration),
    *(Row(f"longest wait of a new TLS connection and its `GET /livez` beside {rate:,} hellos a second from {source}", *GOAL,
          flooded_with_hellos(rate, addresses))
      for rate, addresses, source in ((50, 1, "one address"), (500, 1, "one address"), (5_000, 1, "one address"),
                                      (5_000, 100, "a hundred addresses"))),
]
