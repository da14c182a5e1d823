"""A browser as the session server sees it: it asks `GET /session` and goes to `<answer>/client`, as pages of Webots do. And a machine that
behaves as a test wants."""

import asyncio
import contextlib
import http
import json
import ssl

from .browser_client import WORLD, websockets
from .servers import PATIENCE

NONE_FREE = "loading: Error: No simulation server available at the moment."


class Visitor:
    """Keeps what it is told, with the moment of the event loop's clock.

    `server` is a session server, or a simulation server that is visited directly. `client`: its address, as a proxy on this machine says it.
    """

    def __init__(self, server, client=None, trust=None):
        self.server = server
        self.headers = {"X-Forwarded-For": client} if client else {}
        self.trust = trust or ssl._create_unverified_context()
        self.heard = []  # (moment, text)
        self.close_code = None  # 1006: without a close frame
        self.socket = None
        self.listening = None
        self._news = asyncio.Event()

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        if self.socket:
            await self.leave()

    @property
    def told(self):
        return [text for _, text in self.heard]

    async def ask(self):
        """The address that the session server answers with."""
        return await asyncio.to_thread(self.server.get, "/session", self.headers)

    async def open(self, address):
        """A connection to `<address>/client`, in place of the one before."""
        trust = {"ssl": self.trust} if address.startswith("wss:") else {}
        self.socket = await websockets.connect(f"{address}/client", extra_headers=self.headers, open_timeout=PATIENCE, close_timeout=PATIENCE,
                                               ping_interval=None, **trust)
        self.close_code = None
        self.listening = asyncio.create_task(self._listen(self.socket))

    async def _listen(self, socket):
        with contextlib.suppress(websockets.ConnectionClosed):
            while True:
                self.heard.append((asyncio.get_running_loop().time(), await socket.recv()))
                self._news.set()
        self.close_code = socket.close_code
        self._news.set()

    async def say(self, **message):
        await self.socket.send(json.dumps(message))

    async def start(self, **members):
        """What today's pages do; `members` are those of `start`."""
        await self.open(await self.ask())
        await self.say(start={"url": WORLD, "mode": "mjpeg", **members})

    async def come_back(self, **message):
        """A new connection to the same session server, with this message."""
        await self.open(self.server.url.replace("http", "ws", 1))
        await self.say(**message)

    async def find_again(self, token):
        """Returns to the simulation of a token, and the address that it is told for it."""
        told = len(self.told)
        await self.come_back(reconnect=token)
        return await self.hear("webots:", since=told)

    def find(self, beginning, since=0):
        """The first text from number `since` on that begins so, or None."""
        return next((text for text in self.told[since:] if text.startswith(beginning)), None)

    async def until(self, condition, what):
        """Waits for something to be so; asked after each text, and at the end of the connection."""
        async def wait():
            while not condition():
                self._news.clear()
                await self._news.wait()

        try:
            await asyncio.wait_for(wait(), PATIENCE)
        except asyncio.TimeoutError:
            raise AssertionError(f"waited in vain for {what}; was told {self.told}, close code {self.close_code}") from None

    async def hear(self, beginning, since=0):
        """Waits for such a text and returns it; fails when the connection ends before."""
        await self.until(lambda: self.find(beginning, since) or self.close_code is not None, beginning)
        text = self.find(beginning, since)
        if text is None:
            raise AssertionError(f"the connection has ended ({self.close_code}) without {beginning!r}: {self.told}")
        return text

    async def hear_place(self, ahead, since=0):
        """Waits until it is told how many are ahead."""
        ours = f"waiting: {ahead} "
        await self.until(lambda: self.find(f"queue:{ahead}", since) or self.find(ours, since) or self.close_code is not None, f"place {ahead}")

    async def hear_end(self):
        """Waits until the server closes; returns the code."""
        await self.until(lambda: self.close_code is not None, "the end")
        return self.close_code

    async def leave(self, code=1000):
        await self.socket.close(code)
        await self.listening

    async def vanish(self):
        """The connection is gone, without a close frame."""
        self.socket.transport.abort()
        await self.listening

    def errors(self):
        return [text for text in self.told if text.startswith("loading: Error:")]


class StrangeMachine:
    """A simulation server on 127.0.0.1 that answers /load with `load`, and on /client does what the coroutine `behave(socket, request)` does."""

    OURS = json.dumps({"load": 0.0, "sessions": 0, "starting": 0, "capacity": 20, "memory": 1.0, "draining": False, "arrivals": 0, "failed": 0,
                       "departures": 0, "version": "1"})
    PYTHON = "0.0"

    def __init__(self, behave, load=OURS):
        self.behave, self.load = behave, load
        self.connections = 0
        self.requests = []  # the first message of each conversation
        self.headers = []  # of its handshake
        self.close_codes = []  # of conversations that have ended

    async def __aenter__(self):
        self.server = await websockets.serve(self._converse, "127.0.0.1", 0, process_request=self._answer, ping_interval=None, close_timeout=5)
        self.address = f"127.0.0.1:{self.server.sockets[0].getsockname()[1]}"
        return self

    async def __aexit__(self, *_):
        self.server.close()
        await self.server.wait_closed()

    async def _answer(self, path, headers):
        if path.split("?")[0] == "/load":
            return http.HTTPStatus.OK, [("Content-Type", "text/plain")], self.load.encode()
        return None

    async def _converse(self, socket):
        self.connections += 1
        with contextlib.suppress(websockets.ConnectionClosed):
            request = json.loads(await socket.recv())
            self.headers.append(socket.request_headers)
            self.requests.append(request)
            await self.behave(socket, request)
        await socket.close()
        self.close_codes.append(socket.close_code)


async def hang(socket, _):
    """Accepts, and says nothing more."""
    await socket.wait_closed()


def says(*texts, stays=False):
    """Says these texts, then closes unless it `stays`."""
    async def behave(socket, _):
        for text in texts:
            await socket.send(text)
        if stays:
            await socket.wait_closed()
    return behave
