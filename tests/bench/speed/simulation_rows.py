"""The simulation server's rows. Simulators are stand-ins that are ready at once, so that what is left is the server's."""

import asyncio
import contextlib
import functools
import itertools
import os
import re
import shutil
import statistics
import tempfile
import time

import start_bench
from git_fetch.repositories import WANTED, make_all
from peers import FreeSimulationServer, Tool, cpu_seconds, memory
from row import Row, itself
from support.browser_client import LOCAL, WORLD, Browser
from support.git_server import GitServer
from support.ports import free_port
from support.servers import SessionServer, SimulationServer, program, wait_until


def stage_milliseconds(server, stage):
    """What a stage of all starts took together, as /metrics reports it."""
    found = re.search(rf'^webots_start_stage_seconds_sum{{stage="{stage}"}} (\S+)$', server.get("/metrics"), re.MULTILINE)
    return float(found[1]) * 1e3


def own_start_milliseconds():
    """The stand-in by itself: from fork to its ready line."""
    return start_bench.milliseconds_until([program("speed_simulator"), f"--port={free_port()}"])


@contextlib.contextmanager
def overhead_of_start(quick):
    """From `start` to `webots:`, less the fetch and less the stand-in's own start."""
    starts = 3 if quick else 20

    async def start(server):
        async with Browser(server) as browser:
            await browser.start()
            began = time.monotonic()
            await browser.hear("webots:")
            return (time.monotonic() - began) * 1e3

    def measure():
        with FreeSimulationServer(**LOCAL) as server:
            asyncio.run(start(server))  # what a process does once
            overheads, whole = [], []
            for _ in range(starts):
                fetched = stage_milliseconds(server, "fetch")
                took = asyncio.run(start(server))
                whole.append(took)
                overheads.append(took - (stage_milliseconds(server, "fetch") - fetched) - own_start_milliseconds())
                server.wait_until_clean()
        return {"ours": statistics.median(overheads), "whole start": statistics.median(whole)}
    yield measure


@contextlib.contextmanager
def relayed_start(quick):
    """From `start` to `webots:` through a session server that relays `/client`, and directly; in turns, the same simulation server."""
    starts = 3 if quick else 60  # one start differs from the next by more than the two ways do

    def measure():
        with FreeSimulationServer(**LOCAL) as simulation, SessionServer([simulation.address], relay=True) as session:
            wait_until(lambda: session.ask("/readyz")[0] == 200, "the session server found no machine")
            ways = {"ours": session, "direct": simulation}
            took = {way: [] for way in ways}
            for number in range(starts + 1):
                for way, server in ways.items():
                    milliseconds = asyncio.run(start_bench.start_milliseconds(server))
                    simulation.wait_until_clean()
                    if number > 0:  # the first one pays for what a process does once
                        took[way].append(milliseconds)
        return {way: statistics.median(values) for way, values in took.items()}
    yield measure


@contextlib.contextmanager
def walled_start(quick):
    """From `start` to `webots:` with all walls, less what the demo simulator needs by itself; in turns with a server without walls."""
    kinds = {kind: start_bench.KINDS[kind] for kind in (start_bench.FREE, start_bench.WALLED)}

    def measure():
        took = {kind: statistics.median(times) for kind, times in start_bench.measure(kinds, 3 if quick else 25).items()}
        return {"ours": took[start_bench.WALLED] - took[None], "without walls": took[start_bench.FREE] - took[None]}
    yield measure


@contextlib.contextmanager
def staged_start(quick):
    """From `start` to `webots:` with all walls where one simulation is staged; in turns with a server that stages none."""
    starts = 3 if quick else 25
    walls = start_bench.KINDS[start_bench.WALLED]

    def is_ready(server):
        return re.search(r"^webots_simulations_staged 1$", server.get("/metrics"), re.MULTILINE)

    def measure():
        took = {"ours": [], "not staged": []}
        with SimulationServer(**LOCAL, **walls, staged=[{"url": WORLD}]) as staged, SimulationServer(**LOCAL, **walls) as plain:
            for number in range(starts + 1):
                wait_until(lambda: is_ready(staged), "nothing is staged")
                for way, server in (("ours", staged), ("not staged", plain)):
                    milliseconds = asyncio.run(start_bench.start_milliseconds(server))
                    if number > 0:  # the first one pays for what a process does once
                        took[way].append(milliseconds)
                plain.wait_until_clean()
            taken = float(re.search(r"^webots_staged_taken_total (\S+)$", staged.get("/metrics"), re.MULTILINE)[1])
            if taken != starts + 1:
                raise AssertionError(f"{taken:.0f} of {starts + 1} starts got a staged simulation")
        return {way: statistics.median(values) for way, values in took.items()}
    yield measure


async def with_running(server, count, action):
    """Runs `action` while `count` simulations run."""
    async with contextlib.AsyncExitStack() as stack:
        browsers = [await stack.enter_async_context(Browser(server)) for _ in range(count)]
        for first in range(0, count, 16):
            some = browsers[first:first + 16]
            for browser in some:
                await browser.start()
            for browser in some:
                await browser.hear("webots:")
        return action()


SETTLE_SECONDS = 2  # until the last start has cost all that it costs


@functools.cache  # three rows look at the same runs
def cost_of_running(count, seconds, _run):
    """Percent of a core and kB in the server for each of `count` simulations that run and say nothing."""
    def used(server):
        time.sleep(SETTLE_SECONDS)
        before = cpu_seconds(server.pid)
        time.sleep(seconds)
        return (cpu_seconds(server.pid) - before) / seconds * 100

    with FreeSimulationServer(maxConnections=count + 1, loadFormula="reference", **LOCAL) as server:
        idle, held = used(server), memory(server.pid)
        busy, full = asyncio.run(with_running(server, count, lambda: (used(server), memory(server.pid))))
    return {"cpu": max(busy - idle, 0) / count, "memory": (full - held) / count / 1e3, "idle": idle * 10}


def of_running(key, most=100):
    """A setting whose samples are one figure of `cost_of_running`."""
    @contextlib.contextmanager
    def setting(quick):
        runs = itertools.count()
        yield lambda: {"ours": cost_of_running(min(most, 10) if quick else most, 3 if quick else 6, next(runs))[key]}
    return setting


@contextlib.contextmanager
def load_while_fetching(quick):
    """The 99th percentile of GET /load while 32 browsers start 32 different projects of 20 MB."""
    count = 4 if quick else 32
    folder = tempfile.mkdtemp(prefix="webots_cloud_speed_")
    make_all(folder)
    try:
        with GitServer() as git:
            for number in range(count):
                git.link_repository(f"bench{number}", "medium", os.path.join(folder, "medium.git"))

            async def crowd(server):
                async with contextlib.AsyncExitStack() as stack:
                    browsers = [await stack.enter_async_context(Browser(server)) for _ in range(count)]
                    for number, browser in enumerate(browsers):
                        await browser.start(f"{git.url}/bench{number}/medium/blob/main/{WANTED['medium']}worlds/demo.wbt")
                    for browser in browsers:
                        await browser.hear("webots:")

            def measure():
                with FreeSimulationServer(maxConnections=count, forges=[git.url], allowedRepositories=[git.url]) as server:
                    with Tool("probe", server.port, "/load", 200, 2 if quick else 6) as probe:
                        time.sleep(0.2)  # its connections
                        asyncio.run(crowd(server))
                        _, lost, median, percentile, longest = probe.hear("requests")
                    if lost:
                        raise AssertionError(f"{lost} requests got no answer")
                return {"ours": percentile / 1e3, "median": median / 1e3, "longest": longest / 1e3}
            yield measure
    finally:
        shutil.rmtree(folder, ignore_errors=True)


ROWS = [
    Row("from `start` to `webots:` beyond fetch and simulator", "ms", "at most 5 ms", 5, itself, overhead_of_start),
    Row("from `start` to `webots:`, `/client` relayed by the session server", "ms", "at most 1 ms more than direct", 1,
        lambda sample: sample["ours"] - sample["direct"], relayed_start),
    Row("from `start` to `webots:` with bubblewrap, `internet` and a private display, beyond the simulator", "ms", "at most 60 ms", 60, itself,
        walled_start),
    Row("from `start` to `webots:` of a staged simulation, with the same walls", "ms", "at most 15 ms", 15, itself, staged_start),
    Row("a running simulation, 100 of them", "% of a core", "under 0.1 %", 0.1, itself, of_running("cpu")),
    Row("a running simulation in the server's memory, 100 of them", "kB", "at most 64 kB", 64, itself, of_running("memory")),
    Row("a running simulation, 1,000 of them", "% of a core", "under 0.1 %", 0.1, itself, of_running("cpu", 1000)),
    Row("`GET /load`, 99th percentile while 32 projects are fetched", "ms", "at most 5 ms", 5, itself, load_while_fetching),
    Row("measuring the machine, once a second, and all else an idle server does", "ms of processor a second", "under 1 ms", 1, itself,
        of_running("idle")),
]
