"""A viewer of a simulation, which receives its pictures all the time."""

import asyncio
import contextlib
import socket
import threading

from . import web_sockets as websockets
from .waiting import PATIENCE, wait_until

PICTURE = b"\xff\xd8\xff"  # how a JPEG begins


@contextlib.asynccontextmanager
async def running(port, path="/"):
    """Has the simulation at a port of this machine run, and make pictures."""
    async with websockets.connect(f"ws://127.0.0.1:{port}{path}", max_size=None, max_queue=None) as viewer:
        await viewer.send("mjpeg: 320x240")
        await asyncio.wait_for(viewer.recv(), PATIENCE)  # fetched before, pictures would end the simulator
        await viewer.send("fast:-1")
        yield


class Frames:
    """Pictures of the simulator at a port of this machine."""

    def __init__(self, port, path="/mjpeg"):
        self.count = 0
        self.received = 0  # bytes
        self.socket = socket.create_connection(("127.0.0.1", port), PATIENCE)
        self.socket.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        self.thread = threading.Thread(target=self._receive, daemon=True)
        self.thread.start()

    def _receive(self):
        last = b""
        try:
            while received := self.socket.recv(1 << 16):
                self.received += len(received)
                self.count += (last + received).count(PICTURE)
                last = received[-len(PICTURE) + 1:]
        except OSError:
            pass

    def wait_for_next(self, what):
        """Waits for a picture that arrives from now on."""
        enough = self.count + 1
        wait_until(lambda: self.count >= enough, f"no pictures of the neighbour {what}")

    def close(self):
        try:
            self.socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        self.thread.join()
        self.socket.close()
