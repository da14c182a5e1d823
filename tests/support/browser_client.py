"""A browser as the simulation server sees it, and a server with the demo projects for it."""

import asyncio
import contextlib
import json
import os
import ssl

from support.projects import EXAMPLES
from support.servers import PATIENCE, SimulationServer

try:
    from . import web_sockets as websockets
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-websockets)") or 77)

WORLD = "local:/demo_projects/robots/blob/main/worlds/arena.wbt"
LOCAL = {"forges": [{"url": "local:", "directory": os.path.dirname(os.path.abspath(EXAMPLES))}],
         "allowedRepositories": ["local:/demo_projects"]}


def server(**settings):
    return SimulationServer(**{**LOCAL, **settings})


class Browser:
    """A client of /client that keeps the messages it received."""

    def __init__(self, simulation):
        self.simulation = simulation
        self.told = []

    async def __aenter__(self):
        url = self.simulation.url.replace("http", "ws", 1)
        trust = {"ssl": ssl._create_unverified_context()} if url.startswith("wss:") else {}
        self.socket = await websockets.connect(f"{url}/client", **trust)
        return self

    async def __aexit__(self, *_):
        with contextlib.suppress(websockets.ConnectionClosed):  # by a test that cut it
            await self.socket.close()

    async def start(self, url=WORLD, mode="mjpeg", **more):
        await self.socket.send(json.dumps({"start": {"url": url, "mode": mode, **more}}))

    async def hear(self, beginning):
        """Waits for a message that begins so, and returns it."""
        while True:
            try:
                message = await asyncio.wait_for(self.socket.recv(), PATIENCE)
            except websockets.ConnectionClosed as closed:
                closed.add_note(f"Before it closed, the server said {self.told}, and its log:\n{self.simulation.log()}")
                raise
            self.told.append(message)
            if message.startswith(beginning):
                return message

    async def hear_all(self):
        """Everything until the server closes; returns the close code."""
        try:
            while True:
                self.told.append(await asyncio.wait_for(self.socket.recv(), PATIENCE))
        except websockets.ConnectionClosed:
            return self.socket.close_code
