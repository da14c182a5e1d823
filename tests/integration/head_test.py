#!/usr/bin/python3
"""HEAD, as monitoring probes, load balancers and `curl -I` send it.

The twin: the Python servers answer 405 to it everywhere (protocol section 2: "Only GET is implemented"). Ours answer as to GET, without
the body, and take no place for it.
"""

import os
import re
import socket
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.servers import PATIENCE, SessionServer, SimulationServer, main, wait_until  # noqa: E402


def exchange(server, method, path, headers=""):
    """Status, header fields but the date, and all bytes behind them."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE) as connection:
        connection.sendall(f"{method} {path} HTTP/1.1\r\nHost: localhost\r\n{headers}Connection: close\r\n\r\n".encode())
        parts = []
        while part := connection.recv(65536):
            parts.append(part)
    head, _, body = b"".join(parts).partition(b"\r\n\r\n")
    status, *lines = head.decode().split("\r\n")
    fields = dict(line.split(": ", 1) for line in lines)
    fields.pop("Date")
    return int(status.split()[1]), fields, body


class Head(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.simulation = cls.enterClassContext(SimulationServer())
        cls.session = cls.enterClassContext(SessionServer([cls.simulation.address], sessionBurst=3, sessionRate=0.01, trustedProxies=[]))
        wait_until(lambda: cls.session.get("/") == "1", "no machine is there")

    def placed(self):
        return int(re.search(r'placements_total{result="placed"} (\d+)', self.session.get("/metrics"))[1])

    def test_every_page_has_the_headers_of_get_and_no_body(self):
        for server, paths in ((self.session, ("/", "/load", "/monitor", "/livez", "/readyz", "/viewer/", "/viewer/defaults.json")),
                              (self.simulation, ("/monitor", "/livez", "/readyz"))):
            for path in paths:
                with self.subTest(server=server.PROGRAM, path=path):
                    self.assertEqual(exchange(server, "HEAD", path)[0], 200)

                    def both():  # pages change: of two at the same moment
                        status, fields, body = exchange(server, "GET", path)
                        return exchange(server, "HEAD", path) == (status, fields, b"") and (status, int(fields["Content-Length"]), body)
                    status, length, body = wait_until(both, lambda: f"{exchange(server, 'HEAD', path)} of {path} is not that of GET")
                    self.assertEqual((status, length), (200, len(body)))
        for server in (self.session, self.simulation):  # these differ from one moment to the next
            for path in ("/load", "/metrics"):
                status, fields, body = exchange(server, "HEAD", path)
                self.assertEqual((status, body), (200, b""))
                self.assertGreater(int(fields["Content-Length"]), 0)

    def test_compressed_and_unchanged_pages_too(self):
        compressed = exchange(self.session, "HEAD", "/viewer/", "Accept-Encoding: gzip\r\n")
        self.assertEqual((compressed[0], compressed[1]["Content-Encoding"], compressed[2]), (200, "gzip", b""))
        known = f"If-None-Match: {exchange(self.session, 'HEAD', '/viewer/')[1]['ETag']}\r\n"
        self.assertEqual(exchange(self.session, "HEAD", "/viewer/", known)[0::2], (304, b""))

    def test_of_session_takes_no_place_and_counts_for_no_limit(self):
        before = self.placed()
        for _ in range(10):
            status, fields, body = exchange(self.session, "HEAD", "/session")
            self.assertEqual((status, fields["Content-Type"], body), (200, "text/html; charset=UTF-8", b""))
            self.assertEqual(fields["Access-Control-Allow-Origin"], "*")
            self.assertNotIn("Content-Length", fields)  # which address it would be, nobody knows before it is given
        self.assertEqual(self.placed(), before)
        self.assertEqual(exchange(self.session, "GET", "/session")[2].decode(), f"ws://{self.simulation.address}")
        self.assertEqual(self.placed(), before + 1)

    def test_of_the_monitor_asks_for_the_password_too(self):
        with SimulationServer(monitorPassword="hunter2") as guarded:
            for path in ("/monitor", "/metrics"):
                status, fields, body = exchange(guarded, "HEAD", path)
                self.assertEqual((status, body), (401, b""))
                self.assertIn("WWW-Authenticate", fields)

    def test_it_opens_no_websocket_and_drains_nothing(self):
        upgrade = ("Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                   "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n")
        self.assertEqual(exchange(self.session, "HEAD", "/session", upgrade)[0], 200)
        self.assertEqual(exchange(self.session, "HEAD", "/", upgrade)[0], 200)
        status, fields, _ = exchange(self.simulation, "HEAD", "/client", upgrade)
        self.assertEqual((status, fields["Allow"]), (405, "GET"))
        self.assertEqual(exchange(self.simulation, "HEAD", "/api/drain?exit")[0], 404)
        self.assertEqual(exchange(self.simulation, "HEAD", "/nope")[0::2], (404, b""))
        self.assertEqual(self.simulation.get("/readyz"), "ready")


if __name__ == "__main__":
    main()
