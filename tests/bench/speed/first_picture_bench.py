#!/usr/bin/python3
"""What a visitor waits for: from the click on Start in the viewer until the first picture is drawn, and until it moves.

    WEBOTS_CLOUD_BIN=build/release/bin tests/bench/speed/first_picture_bench.py [--starts 8] [--delay MS] [--only WORD] [--steps]

Chromium without a window shows the viewer of a session server that relays, as the shipped one does, with a simulation server beside it
whose simulations have the walls that ship. The project is in a folder, so there is nothing to fetch. *Cold* the simulation is started, *staged* it
was ready before; *hover*: the mouse rests on the button before the click, as hands do; *moved*: it has moved elsewhere on the page. `--delay`
puts a network between the browser and the servers that takes so many milliseconds in each direction; a new connection costs a round trip by
itself. `--steps` prints what the page has done in the median start, and when.
"""

import argparse
import asyncio
import contextlib
import json
import os
import re
import statistics
import subprocess
import sys
import threading
import urllib.parse

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "../..")]
import start_bench  # noqa: E402
from support.browser_client import LOCAL, WORLD  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import SessionServer, SimulationServer, wait_until  # noqa: E402

PAGE = os.path.join(HERE, "../../viewer/first_picture.mjs")
WAYS = {
    "cold": (False, ""),
    "cold, moved": (False, "moved"),
    "cold, hover": (False, "hover"),
    "staged": (True, ""),
    "staged, hover": (True, "hover"),
}


class SlowNetwork:
    """Passes connections on to a port, each byte so many seconds later; and the first one a round trip later, as TCP does."""

    def __init__(self, target, delay):
        self.target, self.delay = target, delay
        self.port = free_port()
        self.loop = asyncio.new_event_loop()
        threading.Thread(target=self.loop.run_forever, daemon=True).start()
        asyncio.run_coroutine_threadsafe(asyncio.start_server(self.connect, "127.0.0.1", self.port), self.loop).result(10)

    async def connect(self, reader, writer):
        await asyncio.sleep(2 * self.delay)
        far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self.target)
        await asyncio.gather(self.carry(reader, far_writer), self.carry(far_reader, writer))

    async def carry(self, reader, writer):
        with contextlib.suppress(OSError):
            while data := await reader.read(65536):
                self.loop.call_later(self.delay, writer.write, data)
        self.loop.call_later(self.delay, writer.close)


def ready(simulation):
    return re.search(r"^webots_simulations_staged 1$", simulation.get("/metrics"), re.MULTILINE)


@contextlib.contextmanager
def site(is_staged, delay):
    """A session server, its machine, and the address of the viewer with the world in its field."""
    walls = {"sandbox": "bubblewrap", **start_bench.SHIPPED}
    staged = {"staged": [{"url": WORLD}]} if is_staged else {}
    with SimulationServer(**LOCAL, **walls, **staged) as simulation:
        entry = {"address": f"localhost/{simulation.port}", "internal": f"127.0.0.1:{simulation.port}"} if delay else simulation.address
        with SessionServer([entry], relay=True, viewerUrl=WORLD) as session:
            wait_until(lambda: session.ask("/readyz")[0] == 200, "the session server found no machine")
            port = SlowNetwork(session.port, delay / 1e3).port if delay else session.port
            yield simulation, f"http://localhost:{port}/viewer/?url={urllib.parse.quote(WORLD)}"


def measure(way, starts, delay):
    """Of each start what the page has measured."""
    is_staged, hand = WAYS[way]
    with site(is_staged, delay) as (simulation, url):
        page = subprocess.Popen(["node", PAGE, url, hand], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        measured = []
        for number in range(starts + 1):
            if is_staged:
                wait_until(lambda: ready(simulation), "nothing is staged")
            page.stdin.write("next\n")
            page.stdin.flush()
            told = json.loads(next((line for line in page.stdout if line.startswith(("{", "null"))), "null"))
            if told is None:
                raise AssertionError(f"no moving picture came:\n{simulation.log()}")
            if number > 0:  # the first one pays for what happens once
                measured.append(told)
            if not is_staged:
                simulation.wait_until_clean()
        page.stdin.close()
        page.wait(30)
    return measured


def shown(measured, key):
    values = [told[key] for told in measured]
    return f"{statistics.median(values):.0f} [{min(values):.0f} .. {max(values):.0f}]"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--starts", type=int, default=8)
    parser.add_argument("--delay", type=float, default=0, help="milliseconds in each direction")
    parser.add_argument("--only", metavar="WORD", help="ways whose name contains the word")
    parser.add_argument("--steps", action="store_true")
    options = parser.parse_args()
    print("| start | first picture, ms | moving, ms |\n|---|---:|---:|")
    for way in WAYS:
        if options.only and options.only not in way:
            continue
        measured = measure(way, options.starts, options.delay)
        print(f"| {way} | {shown(measured, 'first')} | {shown(measured, 'moving')} |", flush=True)
        if options.steps:
            middle = sorted(measured, key=lambda told: told["moving"])[len(measured) // 2]
            for at, what in middle["steps"]:
                if at >= -1000 and at <= middle["moving"]:
                    print(f"    {at:8.1f} {what}")


if __name__ == "__main__":
    main()
