#!/usr/bin/python3
"""What a browser waits for: from the first byte of `start` until it is told `webots:`, with each sandbox, network and display.

    WEBOTS_CLOUD_BIN=build/release/bin tests/bench/speed/start_bench.py [--rounds 25] [--only WORD]

The world is the demo project, in a folder beside the server, and the simulator the demo simulator. In every round each kind of start has
its turn, the one without any walls first. *Costs* is the median of the differences to that one of the same round, so load of the machine
that lasts longer than a round is in both. *At best* is the shortest start: what is left where nothing else runs.
*Ours* is the shortest start less what the simulator needs by itself, from fork to the line with which it says that it listens.
"""

import argparse
import asyncio
import contextlib
import os
import shutil
import statistics
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../.."))
from support.browser_client import LOCAL, Browser  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.projects import EXAMPLES  # noqa: E402
from support.servers import SimulationServer, program, wait_until  # noqa: E402

# The first one is what the others are compared with; the last one has what a server has that nobody has configured.
NOTHING = {"sandbox": "none", "network": "host", "display": "none"}
SHIPPED = {"network": "internet", "display": "private", "gateway": True, "simulationUser": "auto"}
FREE, WALLED = "no sandbox, no display", "bubblewrap, `internet`, private display"
KINDS = {
    FREE: NOTHING,
    "no sandbox, private display": {**NOTHING, "display": "private"},
    "bubblewrap, `host`, no display": {**NOTHING, "sandbox": "bubblewrap"},
    "bubblewrap, `none`, no display": {**NOTHING, "sandbox": "bubblewrap", "network": "none"},
    "bubblewrap, `internet`, no display": {**NOTHING, "sandbox": "bubblewrap", "network": "internet"},
    WALLED: {"sandbox": "bubblewrap", "network": "internet", "display": "private"},
    "firejail, `internet`, private display": {"sandbox": "firejail", "network": "internet", "display": "private"},
    "bubblewrap, as shipped": {"sandbox": "bubblewrap", **SHIPPED},
}
PROGRAMS = {"bubblewrap": "bwrap", "firejail": "firejail", "private": "Xvfb", "internet": "slirp4netns"}


def lacking(keys):
    """The programs that a kind of start needs, and that are not installed."""
    return [PROGRAMS[value] for value in keys.values() if value in PROGRAMS and not shutil.which(PROGRAMS[value])]


def milliseconds_until(command, word=b""):
    """From the fork of a program until it prints a line with the word."""
    began = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    while word not in process.stdout.readline():
        pass
    took = (time.monotonic() - began) * 1e3
    process.kill()
    process.wait()
    process.stdout.close()
    return took


def own_start_milliseconds():
    """The demo simulator by itself."""
    world = os.path.join(EXAMPLES, "robots/worlds/arena.wbt")
    return milliseconds_until([program("webots-demo-simulator"), "--batch", "--mode=pause", "--stdout", "--stream", f"--port={free_port()}", world],
                              b"listening")


async def start_milliseconds(server):
    async with Browser(server) as browser:
        began = time.monotonic()
        await browser.start()
        await browser.hear("webots:")
        return (time.monotonic() - began) * 1e3


def measure(kinds, rounds):
    """For each kind of start its times, and those of the simulator by itself under None; one of each in every round."""
    times = {None: [], **{kind: [] for kind in kinds}}
    with contextlib.ExitStack() as stack:
        servers = {kind: stack.enter_context(SimulationServer(**LOCAL, **keys)) for kind, keys in kinds.items()}
        for number in range(rounds + 1):
            times[None].append(own_start_milliseconds())
            for kind, server in servers.items():
                took = asyncio.run(start_milliseconds(server))
                wait_until(lambda: not server.instances(), "a simulation does not end")
                server.wait_until_clean()
                if number > 0:  # the first one pays for what a process does once
                    times[kind].append(took)
    return times


def table(times):
    own = min(times.pop(None))
    first, *_ = times
    lines = ["| start | at best | median | costs | ours |", "|---|---:|---:|---:|---:|"]
    for kind, taken in times.items():
        costs = statistics.median(one - other for one, other in zip(taken, times[first]))
        lines.append(f"| {kind} | {min(taken):.0f} ms | {statistics.median(taken):.0f} ms | "
                     f"{'' if kind == first else f'{costs:+.0f} ms'} | {min(taken) - own:.0f} ms |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=25)
    parser.add_argument("--only", metavar="WORD", help="kinds of start whose name contains the word, beside the first")
    options = parser.parse_args()
    kinds = {}
    for kind, keys in KINDS.items():
        if missing := lacking(keys):
            print(f"skipped: {kind}: {', '.join(missing)} not installed", file=sys.stderr)
        elif keys is NOTHING or not options.only or options.only in kind:
            kinds[kind] = keys
    times = measure(kinds, options.rounds)
    print(f"The simulator by itself: {min(times[None]):.0f} ms at best.\n\n{table(times)}")


if __name__ == "__main__":
    main()
