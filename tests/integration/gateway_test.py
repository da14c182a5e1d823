#!/usr/bin/python3
"""Simulations that are reached through their server, at an address that only their browsers know.

Protocol section 13.12.
"""

import asyncio
import contextlib
import json
import os
import re
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile
import unittest
import urllib.error
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser, server  # noqa: E402
from support.frames import PICTURE, Frames, running  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import PATIENCE, SimulationServer, main, port_is_free, wait_until  # noqa: E402

try:
    from support import web_sockets as websockets
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-websockets)") or 77)

TRUST = ssl._create_unverified_context()
SANDBOX = "sandbox allow-scripts allow-forms allow-popups allow-downloads"


def trusting(address):
    return {"ssl": TRUST} if address.startswith("wss:") else {}


def certify(folder):
    certificate, key = os.path.join(folder, "certificate.pem"), os.path.join(folder, "key.pem")
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2",
                    "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost", "-out", certificate, "-keyout", key],
                   check=True, capture_output=True)
    return certificate, key


async def address_of(browser, **start):
    await browser.start(**start)
    return (await browser.hear("webots:"))[len("webots:"):]


async def hear(viewer, beginning):
    while True:
        message = await asyncio.wait_for(viewer.recv(), PATIENCE)
        if isinstance(message, str) and message.startswith(beginning):
            return message


def fetch(url, headers=None):
    """Status, headers and body of an answer."""
    try:
        answer = urllib.request.urlopen(urllib.request.Request(url, headers=headers or {}), timeout=PATIENCE, context=TRUST)
    except urllib.error.HTTPError as refusal:
        answer = refusal
    with answer:
        return answer.status, answer.headers, answer.read()


def see_pictures(url, count=3):
    """Receives some pictures of a stream without end."""
    with urllib.request.urlopen(url, timeout=PATIENCE, context=TRUST) as stream:
        assert stream.headers["Content-Type"].startswith("multipart/x-mixed-replace"), stream.headers
        assert stream.headers["Access-Control-Allow-Origin"] == "*", stream.headers
        received = b""
        while received.count(PICTURE) < count:
            received += stream.read1(1 << 16)


def answer_bytes(simulation, request):
    """All that is answered to the bytes of a request, without its date."""
    with contextlib.closing(socket.create_connection(("localhost", simulation.port), PATIENCE)) as made:
        made.sendall(request)
        received = b""
        while more := made.recv(1 << 16):
            received += more
    return re.sub(rb"\r\nDate: [^\r]*", b"", received)


class Sessions(unittest.IsolatedAsyncioTestCase):
    scheme = "ws"

    def setUp(self):
        self.simulation = self.enterContext(self.server())

    def server(self, **settings):
        folder = tempfile.mkdtemp(prefix="webots_cloud_gateway_")
        self.addCleanup(shutil.rmtree, folder)
        for path, content in {**demo_project(), "assets/a.css": b"url(webots://x.png)"}.items():
            path = os.path.join(folder, "o", "robots", path)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "wb") as file:
                file.write(content)
        settings = {"gateway": True, "forges": [{"url": "local:", "directory": folder}], "allowedRepositories": ["local:/o"],
                    **self.certificate(), **settings}
        return SimulationServer(**settings)

    def certificate(self):
        return {}

    async def open(self, browser, mode):
        address = await address_of(browser, url="local:/o/robots/blob/main/worlds/arena.wbt", mode=mode)
        self.assertRegex(address, rf"^{self.scheme}://localhost:{self.simulation.port}/simulation/[a-z]{{28}}/{self.simulation.port + 1}$")
        return address

    async def test_pictures(self):
        async with Browser(self.simulation) as browser:
            address = await self.open(browser, "mjpeg")
            async with websockets.connect(address + "/", max_size=None, **trusting(address)) as viewer:
                await viewer.send("mjpeg: 320x240")
                await hear(viewer, "scene load completed")
                await viewer.send("real-time:-1")
                await asyncio.to_thread(see_pictures, address.replace("ws", "http", 1) + "/mjpeg")
                await viewer.send("pause")
                await hear(viewer, "paused by client")
        self.simulation.wait_until_clean()

    async def test_scenes_and_files(self):
        async with Browser(self.simulation) as browser:
            address = await self.open(browser, "w3d")
            async with websockets.connect(address, max_size=None, **trusting(address)) as viewer:
                await viewer.send("w3d")
                await hear(viewer, "scene load completed")
            http = address.replace("ws", "http", 1)
            status, headers, body = await asyncio.to_thread(fetch, http + "/worlds/arena.wbt")
            self.assertEqual((status, body), (200, demo_project()["worlds/arena.wbt"]))
            self.assertEqual(headers["Access-Control-Allow-Origin"], "*")
            self.assertEqual(headers.get_all("Content-Security-Policy"), [SANDBOX])
            status, headers, _ = await asyncio.to_thread(fetch, http + "/worlds/arena.wbt", {"If-None-Match": headers["etag"]})
            self.assertEqual(status, 304)
            status, headers, _ = await asyncio.to_thread(fetch, http + "/missing")
            self.assertEqual((status, headers["Content-Security-Policy"]), (404, SANDBOX))
            # Webots' own files, which are named in those of projects, are asked for where this one came from.
            _, _, body = await asyncio.to_thread(fetch, http + "/assets/a.css")
            self.assertEqual(body.decode(), f"url(http://{address.split('://')[1]}/x.png)")
            token = address.split("/")[-2]
            self.assertNotIn(token, self.simulation.log())
            for page in ("/monitor", "/metrics", "/load"):
                self.assertNotIn(token, self.simulation.get(page))
        self.simulation.wait_until_clean()

    async def test_when_the_browser_leaves_everything_is_closed(self):
        async with Browser(self.simulation) as browser:
            address = await self.open(browser, "mjpeg")
            viewer = await websockets.connect(address + "/", max_size=None, **trusting(address))
            await viewer.send("mjpeg: 320x240")
            await hear(viewer, "scene load completed")
        with self.assertRaises(websockets.ConnectionClosed):
            await hear(viewer, "nothing of that kind")
        self.assertEqual((await asyncio.to_thread(fetch, address.replace("ws", "http", 1) + "/"))[0], 404)
        self.simulation.wait_until_clean()
        figures = self.simulation.get("/metrics")
        for side in ("browsers", "simulations"):
            self.assertGreater(float(re.search(rf'^webots_gateway_bytes_total{{from="{side}"}} (\S+)$', figures, re.MULTILINE)[1]), 10)
        self.assertIn("webots_gateway_connections 0\n", figures)

    async def test_a_page_that_quits_hears_the_goodbye_of_its_simulator(self):
        """Webots' own page closes both of its WebSockets in one moment, and shows an error for a close code of 1006."""
        for _ in range(5):
            async with Browser(self.simulation) as browser:
                address = await self.open(browser, "mjpeg")
                viewer = await websockets.connect(address + "/", max_size=None, **trusting(address))
                await viewer.send("mjpeg: 320x240")
                await hear(viewer, "scene load completed")
                await browser.socket.close()  # here, both after the other; the server may know of the first long before the second
                await viewer.close()
                self.assertEqual(viewer.close_code, 1000)
            await asyncio.to_thread(self.simulation.wait_until_clean)

    async def test_a_server_that_stops_closes_everything(self):
        async with Browser(self.simulation) as browser:
            address = await self.open(browser, "mjpeg")
            async with websockets.connect(address + "/", max_size=None, **trusting(address)) as viewer:
                await viewer.send("mjpeg: 320x240")
                await hear(viewer, "scene load completed")
                self.assertEqual(await asyncio.to_thread(self.simulation.stop), 0)
                with self.assertRaises(websockets.ConnectionClosed):
                    await hear(viewer, "nothing of that kind")
        self.assertEqual(self.simulation.instances(), [])


class SessionsOverTls(Sessions):
    scheme = "wss"

    def certificate(self):
        if not shutil.which("openssl"):
            self.skipTest("there is no openssl (package openssl)")
        folder = tempfile.mkdtemp(prefix="webots_cloud_tls_")
        self.addCleanup(shutil.rmtree, folder)
        certificate, key = certify(folder)
        return {"sslCertificate": certificate, "sslKey": key, "ssl": True}


class Neighbours(unittest.IsolatedAsyncioTestCase):
    async def test_who_has_everything_but_the_token_finds_nothing(self):
        with server(gateway=True) as simulation:
            async with Browser(simulation) as browser, Browser(simulation) as neighbour:
                address = await address_of(browser)
                own = await address_of(neighbour)
                port, own_token = simulation.port + 1, own.split("/")[-2]
                async with websockets.connect(address + "/", max_size=None) as viewer:
                    await viewer.send("mjpeg: 320x240")
                    await viewer.send("real-time:-1")
                    await hear(viewer, "real-time")
                    await self.attack(simulation, port, own_token)
                    await viewer.send("pause")  # of which nobody was told before
                    heard = []
                    while not heard or heard[-1] != "paused by client":
                        message = await asyncio.wait_for(viewer.recv(), PATIENCE)
                        heard += [message] if isinstance(message, str) else []
                    self.assertFalse([each for each in heard if each.startswith(("pause:", "reset"))], heard)

    async def attack(self, simulation, port, own_token):
        upgrade = ("Connection: close, Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                   "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n")
        attempts = [f"/simulation/{token}/{number}{rest}" for token in (own_token, "a" * 28, "", "..") for number in (port, port + 500)
                    for rest in ("/", "/mjpeg")]
        attempts += [f"/simulation/{own_token}/../{port}/", "/simulation", "/simulation/", f"/{port}/", "/simulation/%2e%2e/"]
        for method, headers in (("GET", "Connection: close\r\n"), ("POST", "Connection: close\r\nContent-Length: 0\r\n"), ("GET", upgrade)):
            def ask(path, method=method, headers=headers):
                request = f"{method} {path} HTTP/1.1\r\nHost: localhost:{simulation.port}\r\n{headers}\r\n"
                return asyncio.to_thread(answer_bytes, simulation, request.encode())

            unknown = await ask("/nothing/here")
            self.assertTrue(unknown.startswith(b"HTTP/1.1 404 "), unknown)
            for path in attempts:
                self.assertEqual(await ask(path), unknown, path)

    async def test_a_page_of_another_origin_that_has_the_address_may_use_it(self):
        with server(gateway=True) as simulation:
            async with Browser(simulation) as browser:
                address = await address_of(browser)
                for origin in ("https://another.example", "null"):  # the latter: of a page in a sandbox
                    async with websockets.connect(address + "/", origin=origin, max_size=None) as viewer:
                        await viewer.send("mjpeg: 320x240")
                        await hear(viewer, "scene load completed")
                with self.assertRaises(websockets.InvalidStatusCode):
                    await websockets.connect(f"ws://localhost:{simulation.port}/client", origin="https://another.example")


class Networks(unittest.IsolatedAsyncioTestCase):
    def sandboxed(self, **settings):
        if not shutil.which("bwrap"):
            self.skipTest("bubblewrap is not installed")
        simulation = self.enterContext(contextlib.closing(server(gateway=True, sandbox="bubblewrap", network="none", **settings)))
        try:
            simulation.start()
        except AssertionError as failure:
            self.skipTest(f"no sandbox here: {failure}")
        return simulation

    async def test_where_names_of_sockets_would_be_too_long_there_is_a_port_and_a_warning(self):
        folder = tempfile.mkdtemp(prefix="webots_cloud_gateway_")
        self.addCleanup(shutil.rmtree, folder)
        simulation = self.sandboxed(stateDir=os.path.join(folder, 100 * "x"))
        self.assertIn("Choose a shorter \"stateDir\".", simulation.log())
        async with Browser(simulation) as browser:
            address = await address_of(browser)
            self.assertFalse(port_is_free(simulation.port + 1))
            async with websockets.connect(address + "/", max_size=None) as viewer:
                await viewer.send("mjpeg: 320x240")
                await hear(viewer, "scene load completed")
        simulation.wait_until_clean()

    async def test_a_simulation_with_a_network_of_its_own_has_no_open_port_on_this_machine(self):
        simulation = self.sandboxed(reconnectGrace=60)
        async with Browser(simulation) as browser:
            address = await address_of(browser)
            self.assertTrue(port_is_free(simulation.port + 1))
            async with websockets.connect(address + "/", max_size=None) as viewer:
                await viewer.send("mjpeg: 320x240")
                await hear(viewer, "scene load completed")
                await viewer.send("real-time:-1")
                await asyncio.to_thread(see_pictures, address.replace("ws", "http", 1) + "/mjpeg")
                token = (await browser.hear("reconnectToken: ")).split()[1]
                browser.socket.transport.abort()
                await asyncio.to_thread(wait_until, lambda: "it may return for 60.0 s" in simulation.log(), "the loss went unnoticed")
                async with Browser(simulation) as again:
                    await again.socket.send(json.dumps({"reconnect": token}))
                    self.assertEqual(await again.hear("webots:"), "webots:" + address)
                    await viewer.send("pause")
                    await hear(viewer, "paused by client")
                    await viewer.close()  # before its simulation ends with the browser that returned
        simulation.wait_until_clean()
        self.assertEqual(os.listdir(os.path.join(simulation.state_folder(), str(simulation.port), "brokers")), [])


class Traffic(unittest.IsolatedAsyncioTestCase):
    async def test_a_simulation_exchanges_no_more_bytes_with_its_browsers_than_it_may(self):
        with server(gateway=True, trafficLimit=1) as simulation:
            async with Browser(simulation) as browser:
                address = await address_of(browser)
                async with running(simulation.port + 1):  # not through the gateway
                    limited = Frames(simulation.port, address.split(str(simulation.port), 1)[1] + "/mjpeg")
                    direct = Frames(simulation.port + 1)
                    try:
                        await asyncio.to_thread(wait_until, lambda: direct.received > 1_000_000, "no pictures")
                        self.assertLess(limited.received, 200_000)
                        simulation.reread(trafficLimit=0)
                        before = limited.received
                        await asyncio.to_thread(wait_until, lambda: limited.received > before + 500_000, "the limit stays")
                    finally:
                        limited.close()
                        direct.close()


if __name__ == "__main__":
    main()
