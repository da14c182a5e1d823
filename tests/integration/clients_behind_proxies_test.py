#!/usr/bin/python3
"""The server finds the real client behind nginx, Apache or HAProxy, whatever headers it forges.

The clients are 127.0.0.2 and others of the loopback; the proxies reach the servers from 127.0.0.1, which alone is trusted here."""

import asyncio
import contextlib
import http.client
import json
import os
import shutil
import socket
import ssl
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import apache, haproxy, nginx  # noqa: E402
from support.browser_client import LOCAL, WORLD, websockets  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402

try:
    from support.mailbox import Certificate
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-aiosmtpd)") or 77)

PATIENCE = 30
ONE, OTHER, THIRD = "127.0.0.2", "127.0.0.3", "127.0.0.4"
TRUSTED = ["127.0.0.1", "::1"]
CLAIMS = [  # what a client may say of itself
    [],
    [("X-Forwarded-For", "203.0.113.9")],
    [("X-Forwarded-For", "127.0.0.1")],
    [("X-Forwarded-For", "")],
    [("X-Forwarded-For", "203.0.113.9"), ("X-Forwarded-For", "203.0.113.10, 127.0.0.1")],
    [("Forwarded", "for=203.0.113.9")],
    [("X-Real-IP", "203.0.113.9"), ("x-forwarded-for", "garbage,,")],
]


class Site:
    """Both servers, and their addresses behind a proxy."""

    def __init__(self):
        self.simulation = SimulationServer(trustedProxies=TRUSTED, simulationsPerAddress=1, **LOCAL)
        self.session = SessionServer([self.simulation.address], trustedProxies=TRUSTED, sessionBurst=len(CLAIMS), sessionRate=0.01,
                                     connectionsPerAddress=len(CLAIMS))
        self.tls = None
        self.session_at = self.simulation_at = (0, "")  # port and path

    @contextlib.contextmanager
    def behind(self, proxy):
        with proxy, self.simulation, self.session:
            wait_until(lambda: self.session.get("/") == "1", "the session server finds the simulation server")
            yield self

    def connect(self, at, source):
        return socket.create_connection(("127.0.0.1", at[0]), timeout=PATIENCE, source_address=(source, 0))

    def ask_session(self, source, claim):
        """Status, headers and body of GET /session."""
        port, path = self.session_at
        kind = http.client.HTTPSConnection if self.tls else http.client.HTTPConnection
        connection = kind("localhost", port, **({"context": self.tls} if self.tls else {}))
        connection.sock = self.connect(self.session_at, source)
        if self.tls:
            connection.sock = self.tls.wrap_socket(connection.sock, server_hostname="localhost")
        with contextlib.closing(connection):
            connection.putrequest("GET", f"{path}/session")
            for name, value in claim:
                connection.putheader(name, value)
            connection.endheaders()
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read().decode()

    def websocket(self, at, path, source, claim):
        port, folder = at
        secure = {"ssl": self.tls, "server_hostname": "localhost"} if self.tls else {}
        address = f"{'wss' if self.tls else 'ws'}://localhost:{port}{folder}{path}"
        sock = self.connect(at, source)
        sock.setblocking(False)
        return websockets.connect(address, sock=sock, extra_headers=claim, open_timeout=PATIENCE, **secure)


async def hear(browser):
    return await asyncio.wait_for(browser.recv(), PATIENCE)


class Clients:
    """Tests for every proxy; `site` starts one."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_clients_test_")
        self.addCleanup(shutil.rmtree, self.folder)

    def check_sessions(self, site):
        for claim in CLAIMS:
            self.assertEqual(site.ask_session(ONE, claim)[2], f"ws://{site.simulation.address}", claim)
        for claim in CLAIMS:
            status, headers, body = site.ask_session(ONE, claim)
            self.assertEqual((status, body[:24]), (200, "Error: too many sessions"), claim)
            self.assertEqual(headers["Retry-After"], "100")
        self.assertEqual(site.ask_session(OTHER, [])[2], f"ws://{site.simulation.address}")
        wait_until(lambda: "\"sessionBurst\"" in site.session.log(), site.session.log)  # a moment after the answer
        log = site.session.log()
        self.assertEqual(log.count("see \"sessionBurst\""), 1, log)
        self.assertRegex(log, rf"come from {ONE}: see \"sessionBurst\" and \"sessionRate\"")

    async def check_websockets(self, site):
        async with contextlib.AsyncExitStack() as stack:
            for claim in CLAIMS:
                light = await stack.enter_async_context(site.websocket(site.session_at, "/", ONE, claim))
                self.assertEqual(await hear(light), "1")
            for claim in CLAIMS:
                with self.assertRaises(websockets.InvalidStatusCode) as refused:
                    await site.websocket(site.session_at, "/", ONE, claim)
                self.assertEqual(refused.exception.status_code, 429, claim)
            light = await stack.enter_async_context(site.websocket(site.session_at, "/", OTHER, []))
            self.assertEqual(await hear(light), "1")
        wait_until(lambda: f"New client ({OTHER})" in site.session.log(), site.session.log)
        log = site.session.log()
        self.assertEqual(log.count(f"New client ({ONE})"), len(CLAIMS), log)
        self.assertEqual(log.count(f"New client ({OTHER})"), 1, log)
        self.assertIn(f"More than {len(CLAIMS)} connections from {ONE} are refused: see \"connectionsPerAddress\"", log)

    async def check_simulations(self, site):
        start = json.dumps({"start": {"url": WORLD, "mode": "mjpeg"}})
        async with site.websocket(site.simulation_at, "/client", ONE, []) as running:
            await running.send(start)
            while not (await hear(running)).startswith("webots:"):
                pass
            for claim in CLAIMS:
                async with site.websocket(site.simulation_at, "/client", ONE, claim) as refused:
                    await refused.send(start)
                    self.assertRegex(await hear(refused), "^loading: Error: Your network has 1 simulations .*simulationsPerAddress", claim)
            async with site.websocket(site.simulation_at, "/client", THIRD, CLAIMS[1]) as other:
                await other.send(start)
                while not (await hear(other)).startswith("webots:"):
                    pass
        await asyncio.to_thread(site.simulation.wait_until_clean)
        self.assertIn(f"More than 1 simulations of {ONE} are refused: see \"simulationsPerAddress\"", site.simulation.log())
        self.assertNotIn("203.0.113", site.simulation.log())

    async def test_a_claim_does_not_change_who_a_client_is(self):
        site = self.enterContext(self.site())
        await asyncio.to_thread(self.check_sessions, site)
        await self.check_websockets(site)
        await self.check_simulations(site)


class OurConfiguration(Clients):
    """The file in config/ for the proxy that `proxy`, a module, starts."""

    def site(self):
        self.proxy.program()
        if not shutil.which("openssl"):
            self.skipTest("openssl is missing (package openssl)")
        certificate = Certificate(self.folder)
        site = Site()
        site.tls = ssl.create_default_context(cafile=certificate.authority)
        port = free_port()
        site.session_at = (port, f"/{site.session.port}")
        site.simulation_at = (port, f"/{site.simulation.port}")
        return site.behind(self.proxy.site(site.session.port, [site.simulation.port], port, certificate))


class BehindNginx(OurConfiguration, unittest.IsolatedAsyncioTestCase):
    proxy = nginx


class BehindApache(OurConfiguration, unittest.IsolatedAsyncioTestCase):
    proxy = apache


class BehindHaproxy(Clients, unittest.IsolatedAsyncioTestCase):
    def site(self):
        haproxy.program()
        site = Site()
        site.session_at, site.simulation_at = (free_port(), ""), (free_port(), "")
        return site.behind(haproxy.proxies({site.session_at[0]: site.session.port, site.simulation_at[0]: site.simulation.port}))


if __name__ == "__main__":
    main()
