#!/usr/bin/python3
"""Clients on other machines are limited one by one behind nginx as we ship it (config/nginx), with the default `trustedProxies`: nginx runs on the
machine of the servers. (clients_behind_proxies_test.py has all proxies, and clients on the loopback.)"""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import nginx, own_network  # noqa: E402
from support.browser_client import LOCAL  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, wait_until  # noqa: E402

try:
    from support.mailbox import Certificate
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-aiosmtpd)") or 77)

NETWORK = "10.79.0"
ONE, OTHER = f"{NETWORK}.2", f"{NETWORK}.3"  # of the machine of clients
ALLOWED = 6  # connections of one client
TRIES = 10

# Opens WebSockets, says the status of each, and holds them until its input ends. Arguments: own address, port, authority, path, number, claim.
CLIENT = r"""
import socket, ssl, sys
own, port, authority, path, number, claim = sys.argv[1:]
context = ssl.create_default_context(cafile=authority)
held = []
for _ in range(int(number)):
    plain = socket.create_connection(("10.79.0.1", int(port)), timeout=30, source_address=(own, 0))
    one = context.wrap_socket(plain, server_hostname="localhost")
    held.append(one)
    one.sendall((f"GET {path} HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                 "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n"
                 + (f"X-Forwarded-For: {claim}\r\n" if claim else "") + "\r\n").encode())
    head = b""
    while b"\r\n\r\n" not in head:
        part = one.recv(1000)
        if not part:
            break
        head += part
    print(head.split(b" ")[1].decode() if head else "nothing", flush=True)
print("done", flush=True)
sys.stdin.read()
"""


class BehindOurNginx(unittest.TestCase):
    def setUp(self):
        nginx.program()
        if not shutil.which("openssl"):
            self.skipTest("openssl is missing (package openssl)")
        folder = tempfile.mkdtemp(prefix="webots_cloud_site_test_")
        self.addCleanup(shutil.rmtree, folder)
        self.certificate = Certificate(folder)
        self.machine = self.enterContext(own_network.Elsewhere())
        own_network.cable(None, self.machine, NETWORK)
        subprocess.run([*self.machine.wrapper, "ip", "address", "add", f"{OTHER}/24", "dev", "b10_79_0"], check=True)
        self.simulation = self.enterContext(SimulationServer(connectionsPerAddress=ALLOWED, **LOCAL))
        self.session = self.enterContext(SessionServer([self.simulation.address], connectionsPerAddress=ALLOWED))
        self.port = free_port()
        self.enterContext(nginx.site(self.session.port, [self.simulation.port], self.port, self.certificate, "0.0.0.0"))
        wait_until(lambda: self.session.get("/") == "1", "the session server finds the simulation server")

    @contextlib.contextmanager
    def websockets(self, own, path, number, claim=""):
        """The statuses of so many WebSockets of a client, which are open meanwhile."""
        client = subprocess.Popen([*self.machine.wrapper, sys.executable, "-c", CLIENT, own, str(self.port), self.certificate.authority, path,
                                   str(number), claim], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        try:
            statuses = []
            while (line := client.stdout.readline().strip()) not in ("done", ""):
                statuses.append(line)
            yield statuses
        finally:
            client.stdin.close()
            client.wait(PATIENCE)
            client.stdout.close()

    def test_each_client_has_its_own_limit_whatever_it_claims(self):
        for server, path in ((self.session, "/"), (self.session, f"/{self.session.port}/"), (self.simulation, f"/{self.simulation.port}/client")):
            with self.subTest(path), self.websockets(ONE, path, TRIES) as of_one:
                self.assertEqual(of_one, ["101"] * ALLOWED + ["429"] * (TRIES - ALLOWED))
                for claim in ("203.0.113.9", "127.0.0.1", OTHER):
                    with self.websockets(ONE, path, 1, claim) as more:
                        self.assertEqual(more, ["429"], claim)
                with self.websockets(OTHER, path, 2, ONE) as of_other:
                    self.assertEqual(of_other, ["101", "101"])
                self.assertIn(f"More than {ALLOWED} connections from {ONE} are refused", server.log())
            self.assertNotIn("203.0.113.9", server.log())


if __name__ == "__main__":
    own_network.enter()
    main()
