#!/usr/bin/python3
"""Starts that find their project in the machine's cache, with three real simulation servers: the table of docs/scheduling.md.

    WEBOTS_CLOUD_BIN=build/release/bin tests/bench/speed/warm_bench.py [--starts 300] [--seed 1]

120 projects of 2 MB on a real git server, a few popular and most rare (Zipf); the cache of each machine holds the 20 to 50 used last. The same starts, one
after the other with four simulations at a time, three times: the session server takes the start, and knows the project ("relayed"); it
names a machine at `GET /session`, which names no project ("by load alone"); and by load alone with caches that hold everything, where the
second start on a machine is warm whatever we do. A start is cold if the git server has sent a tenth of the project for it.
"""

import argparse
import asyncio
import collections
import os
import random
import statistics
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../.."))
from support.browser_client import Browser  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.servers import SessionServer, SimulationServer  # noqa: E402
from support.waiting import wait_until  # noqa: E402

PROJECTS = 120
PROJECT_SIZE = 2_000_000
SMALL_CACHE = 0.1  # GB, the least that there can be
LARGE_CACHE = 10
MACHINES = 3
AT_ONCE = 4
WORLD = "#VRML_SIM R2025a utf8\nWorldInfo { }\n"


def make_projects(git, source):
    for number in range(PROJECTS):
        git.add_repository("bench", f"p{number}", {"worlds/w.wbt": WORLD, "worlds/textures/t.bin": source.randbytes(PROJECT_SIZE)})


def sent(git, number):
    return sum(request[3] for request in git.requests() if request[1].startswith(f"/bench/p{number}/") or f"/bench/p{number}." in request[1])


class Site:
    def __init__(self, git, cache, relay):
        keys = {"forges": [git.url], "allowedRepositories": [git.url], "cacheSize": cache, "maxConnections": 4}
        self.machines = [SimulationServer(**keys) for _ in range(MACHINES)]
        self.session = SessionServer([machine.address for machine in self.machines], relay=relay)
        self.by_address = {machine.address: machine for machine in self.machines}

    def __enter__(self):
        for server in [*self.machines, self.session]:
            server.__enter__()
        wait_until(lambda: self.session.ask("/readyz")[0] == 200, "the session server found no machine")
        return self

    def __exit__(self, *why):
        for server in [self.session, *self.machines]:
            server.__exit__(*why)

    def chosen_by_load(self):
        """What a session server that does not relay answers: nobody has named the project yet."""
        return self.by_address[self.session.ask("/session")[1].split("//")[1]]


async def run(git, site, starts, by_project):
    cold, warm = [], []
    placed = collections.Counter()
    running = collections.deque()
    for number in starts:
        if len(running) == AT_ONCE:
            await running.popleft().__aexit__()
        before = sent(git, number)
        server = site.session if by_project else site.chosen_by_load()
        browser = await Browser(server).__aenter__()
        running.append(browser)
        began = time.monotonic()
        await browser.start(f"{git.url}/bench/p{number}/blob/main/worlds/w.wbt")
        address = await browser.hear("webots:")
        took = (time.monotonic() - began) * 1e3
        placed[min(site.machines, key=lambda machine: (int(address.split(":")[-1].split("/")[0]) - machine.port) % 65536).address] += 1
        (cold if sent(git, number) - before > PROJECT_SIZE / 10 else warm).append(took)
        await asyncio.sleep(0.6)  # reports come twice a second
    for browser in running:
        await browser.__aexit__()
    return warm, cold, placed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--starts", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    source = random.Random(options.seed)
    starts = source.choices(range(PROJECTS), [1 / (rank + 1) for rank in range(PROJECTS)], k=options.starts)
    print("| | warm % | ms to `webots:`, warm | ms, cold | ms, all | most and least on a machine |\n|---|---:|---:|---:|---:|---:|", flush=True)
    with GitServer() as git:
        make_projects(git, source)
        for what, cache, by_project in (("relayed", SMALL_CACHE, True), ("by load alone", SMALL_CACHE, False),
                                        ("by load alone, caches hold everything", LARGE_CACHE, False)):
            with Site(git, cache, by_project) as site:
                warm, cold, placed = asyncio.run(run(git, site, starts, by_project))
            counts = [placed[machine.address] for machine in site.machines]
            shown = [f"{statistics.median(times):.0f}" if times else "" for times in (warm, cold, warm + cold)]
            print(f"| {what} | {100 * len(warm) / len(starts):.1f} | {' | '.join(shown)} | {max(counts)}, {min(counts)} |", flush=True)


if __name__ == "__main__":
    main()
