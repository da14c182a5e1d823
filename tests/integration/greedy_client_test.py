#!/usr/bin/python3
"""One address takes as much of a server as it can get, and others are still served.

No proxy is trusted here, so that 127.0.0.2 and other addresses of the loopback interface are ordinary clients."""

import asyncio
import contextlib
import os
import select
import socket
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import LOCAL, Browser  # noqa: E402
from support.raw_websocket import HANDSHAKE, PATIENCE, read_all, read_head  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402

GREEDY = "127.0.0.2"
OTHERS = ("127.0.0.3", "127.0.0.4", "127.0.0.5")
WAITING, WAITING_OF_ALL = 64, 256
CLOSE_FRAME = b"\x88\x00"


class GreedyClient(unittest.IsolatedAsyncioTestCase):
    def websocket(self, server, path, source):
        """A WebSocket from that address, and the head of the answer; b"" when the connection was closed without one."""
        connection = socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE, source_address=(source, 0))
        self.addCleanup(connection.close)
        with contextlib.suppress(ConnectionResetError, BrokenPipeError):
            connection.sendall(HANDSHAKE.format(path=path).encode())
            return connection, read_head(connection)
        return connection, b""

    def idle(self, server, source, number):
        opened = [self.websocket(server, "/client", source) for _ in range(number)]
        for _, head in opened:
            self.assertTrue(head.startswith(b"HTTP/1.1 101 "), head)
        return [connection for connection, _ in opened]

    def assert_told_and_closed(self, connection):
        text = b""
        while not text.endswith(CLOSE_FRAME):
            part = connection.recv(4096)
            self.assertTrue(part, text)
            text += part
        self.assertIn(b"loading: Error: Too many connections wait here for their start: please start again.", text)

    def assert_silent(self, connections):
        self.assertEqual(select.select(connections, [], [], 0)[0], [])

    async def test_idle_sockets_keep_nobody_from_starting(self):
        with SimulationServer(trustedProxies=[], **LOCAL) as server:
            greedy = self.idle(server, GREEDY, WAITING + 6)
            for connection in greedy[:6]:
                self.assert_told_and_closed(connection)
            others = [connection for source in OTHERS for connection in self.idle(server, source, WAITING)]
            self.assert_silent(greedy[6:] + others)
            async with Browser(server) as browser:
                await browser.start()
                await browser.hear("webots:")
                self.assert_told_and_closed(greedy[6])
                self.assert_silent(greedy[7:] + others)
            await asyncio.to_thread(server.wait_until_clean)
            self.assertIn(f"More than {WAITING_OF_ALL} connections, or {WAITING} of one address, start nothing", server.log())

    async def test_an_address_leaves_descriptors_to_others(self):
        server = SessionServer([], trustedProxies=[])
        server.descriptors = 100  # half of them for connections, and of these three quarters for one address
        with server:
            admitted = [connection for connection, head in (self.websocket(server, "/", GREEDY) for _ in range(60))
                        if head.startswith(b"HTTP/1.1 101 ")]
            self.assertEqual(len(admitted), 38)
            self.assertEqual(server.ask("/livez"), (200, "alive"))
            refused, head = self.websocket(server, "/", GREEDY)
            self.assertTrue(head.startswith(b"HTTP/1.1 503 "), head)
            self.assertIn(b"Too many connections", read_all(refused))
            line = f"More than 38 connections from {GREEDY} are refused: see \"connectionsPerAddress\" and the limit of open files"
            wait_until(lambda: line in server.log(), "the refusal is in the log")
            admitted[0].close()
            wait_until(lambda: self.websocket(server, "/", GREEDY)[1].startswith(b"HTTP/1.1 101 "), "there is room again")


if __name__ == "__main__":
    main()
