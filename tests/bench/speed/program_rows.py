"""The rows of people who write programs: from Run to the first line that the new program prints."""

import asyncio
import contextlib
import json
import statistics
import time

from row import Row, itself
from support import web_sockets as websockets
from support.browser_client import LOCAL, Browser
from support.lessons import solved
from support.servers import PATIENCE, SimulationServer

LESSON = "local:/demo_projects/lessons/blob/main/worlds/lesson_1_move.wbt"
PROGRAM = "move/move.py"
PUPILS = 30


class Pupil:
    """Somebody with a simulation and its editor."""

    async def sit_down(self, stack, server):
        self.browser = await stack.enter_async_context(Browser(server))
        await self.browser.start(url=LESSON, edit=True)
        address = (await self.browser.hear("webots:")).removeprefix("webots:")
        self.view = await stack.enter_async_context(websockets.connect(address, max_size=None, ping_interval=None))  # what nobody reads yet holds up pongs
        await self.view.send("mjpeg: 320x240")

    async def run(self, mark):
        """As Run of the editor: milliseconds until the program has printed `mark`."""
        began = time.monotonic()
        await self.browser.socket.send(json.dumps({"write": {"path": PROGRAM, "text": f"print({mark!r}, flush=True)\n" + solved("lesson_1_move")}}))
        await self.browser.hear("file: ")
        await self.view.send("reset")
        await self.view.send("real-time:-1")
        while True:
            message = await asyncio.wait_for(self.view.recv(), PATIENCE)
            if isinstance(message, str) and message.startswith("stdout:") and mark in message:
                return (time.monotonic() - began) * 1e3


async def runs_of(server, pupils, rounds):
    """Of each round, the slowest pupil's time."""
    async with contextlib.AsyncExitStack() as stack:
        seated = [Pupil() for _ in range(pupils)]
        for pupil in seated:
            await pupil.sit_down(stack, server)
        return [max(await asyncio.gather(*(pupil.run(f"round {number}") for pupil in seated))) for number in range(rounds)]


def run_to_line(pupils):
    @contextlib.contextmanager
    def setting(quick):
        together = min(pupils, 3) if quick else pupils

        def measure():
            with SimulationServer(**LOCAL, allowEdit=True, gateway=True, maxConnections=together + 1, loadFormula="reference") as server:
                return {"ours": statistics.median(asyncio.run(runs_of(server, together, 2 if quick else 8)))}
        yield measure
    return setting


ROWS = [
    Row("from *Run* to the first line that the new program prints", "ms", "at most 300 ms", 300, itself, run_to_line(1)),
    Row(f"the same for the last of {PUPILS} who press it at once", "ms", f"at most {PUPILS} × 100 ms on two cores", PUPILS * 100, itself, run_to_line(PUPILS)),
]
