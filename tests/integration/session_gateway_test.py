#!/usr/bin/python3
"""A whole site behind the one TLS port of its session server, which passes on what is for its simulation servers.

Protocol section 13.13.
"""

import asyncio
import http.client
import json
import os
import secrets
import shutil
import socket
import ssl
import sys
import tempfile
import unittest
import urllib.error
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import LOCAL, WORLD, websockets  # noqa: E402
from support.frames import PICTURE  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, wait_until  # noqa: E402
from support.waiting import wait_until_async  # noqa: E402

try:
    from support.mailbox import Certificate
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-aiosmtpd)") or 77)
if not shutil.which("openssl"):
    raise SystemExit(print("skipped: there is no openssl (package openssl)") or 77)


async def hear(socket, beginning=""):
    while True:
        message = await asyncio.wait_for(socket.recv(), PATIENCE)
        if not beginning or (isinstance(message, str) and message.startswith(beginning)):
            return message


class Site(unittest.IsolatedAsyncioTestCase):
    """Browsers know one port, that of the session server."""

    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_site_"))
        self.certificate = Certificate(self.folder)
        self.trust = ssl.create_default_context(cafile=self.certificate.authority)
        self.port = free_port()
        self.host = f"localhost:{self.port}"

    def machine(self, **settings):
        """A simulation server that only this machine reaches."""
        return self.enterContext(SimulationServer(**{**LOCAL, "server": self.host, "ssl": True, "portRewrite": True, "gateway": True,
                                                     "listenAddress": "127.0.0.1", **settings}))

    def entry(self, machine, **more):
        return {"address": f"{self.host}/{machine.port}", "internal": f"127.0.0.1:{machine.port}", **more}

    def session(self, *entries, **settings):
        server = SessionServer(list(entries), port=self.port, ssl=True, sslCertificate=self.certificate.certificate,
                               sslKey=self.certificate.key, **settings)
        self.enterContext(server)
        if entries:
            wait_until(lambda: server.get("/") == "1", lambda: f"the session server finds its machines:\n{server.log()}")
        return server

    def fetch(self, path, method="GET", **headers):
        """Status and body."""
        request = urllib.request.Request(f"https://{self.host}{path}", headers=headers, method=method)
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE, context=self.trust) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as refusal:
            with refusal:
                return refusal.code, refusal.read().decode()

    def follow(self, address):
        self.assertTrue(address.startswith(f"wss://{self.host}/"), f"{address} is not behind the one port")
        return websockets.connect(address, ssl=self.trust, open_timeout=PATIENCE)

    def see_pictures(self, address, count=3):
        with urllib.request.urlopen(address, timeout=PATIENCE, context=self.trust) as stream:
            self.assertTrue(stream.headers["Content-Type"].startswith("multipart/x-mixed-replace"), stream.headers)
            received = b""
            while received.count(PICTURE) < count:
                received += stream.read1(1 << 16)

    async def visit(self, mode, place):
        """What a browser does with the address of a machine; returns that of its simulation."""
        async with self.follow(f"{place}/client") as browser:
            await browser.send(json.dumps({"start": {"url": WORLD, "mode": mode}}))
            address = (await hear(browser, "webots:")).removeprefix("webots:")
            async with self.follow(f"{address}/") as viewer:
                await viewer.send("mjpeg: 320x240" if mode == "mjpeg" else "w3d")
                await hear(viewer, "scene load completed")
                files = address.replace("ws", "http", 1)
                if mode == "mjpeg":
                    await viewer.send("real-time:-1")
                    await asyncio.to_thread(self.see_pictures, f"{files}/mjpeg")
                else:
                    status, text = await asyncio.to_thread(self.fetch, f"{files.removeprefix('https://' + self.host)}/worlds/arena.wbt")
                    self.assertEqual((status, text.split()[0]), (200, "#VRML_SIM"))
            return address


class OnePort(Site):
    async def test_a_visit_goes_through_the_one_port_to_either_machine(self):
        machines = [self.machine(), self.machine()]
        session = self.session(*map(self.entry, machines))
        async with self.follow(f"wss://{self.host}/") as availability:
            self.assertEqual(await hear(availability), "1")
        self.assertIn(session.get("/session"), [f"wss://{self.host}/{machine.port}" for machine in machines])
        for machine, mode in zip(machines, ("mjpeg", "w3d")):
            address = await self.visit(mode, f"wss://{self.host}/{machine.port}")
            self.assertRegex(address, rf"^wss://{self.host}/{machine.port}/simulation/[a-z]{{28}}/\d+$")
            self.assertIn("<h1>", self.fetch(f"/{machine.port}/monitor")[1])
        self.assertIn("<html", self.fetch("/viewer/")[1])

    async def test_a_site_at_an_unusual_port_needs_its_name_alone(self):
        """As config/*/tls.json, of which one changes only "port"."""
        machine = self.machine(server="localhost")
        entry = {"address": f"localhost/{machine.port}", "internal": f"127.0.0.1:{machine.port}"}
        for relay in (False, True):
            session = self.session(entry, server="localhost", relay=relay)
            place = session.get("/session")
            self.assertEqual(place, f"wss://{self.host}" if relay else f"wss://{self.host}/{machine.port}")
            for mode in ("mjpeg", "w3d"):
                self.assertRegex(await self.visit(mode, place), rf"^wss://{self.host}/{machine.port}/simulation/[a-z]{{28}}/\d+$")
            session.stop()

    async def test_tickets_go_through_it_too(self):
        file = os.path.join(self.folder, "secret")
        with open(file, "w") as secret:
            secret.write(secrets.token_hex(32))
        os.chmod(file, 0o600)
        machine = self.machine(sessionSecret=file)
        session = self.session(self.entry(machine), sessionSecret=file)
        await self.visit("mjpeg", session.get("/session"))
        async with self.follow(f"wss://{self.host}/{machine.port}/client") as stranger:
            await stranger.send(json.dumps({"start": {"url": WORLD, "mode": "mjpeg"}}))
            self.assertIn("start through its session server", await hear(stranger))

    async def test_simulators_without_a_gateway_of_their_own_are_reached_by_their_ports(self):
        machine = self.machine(gateway=False)
        ports = f"{machine.port + 1}-{machine.port + 20}"
        self.session(self.entry(machine, ports=ports))
        address = await self.visit("mjpeg", f"wss://{self.host}/{machine.port}")
        self.assertRegex(address, rf"^wss://{self.host}/\d+$")

    def test_machines_come_and_go_while_it_runs(self):
        first, second = self.machine(), self.machine()
        session = self.session(self.entry(first))
        self.assertEqual(self.fetch(f"/{second.port}/load")[0], 404)
        session.reread(simulationServers=[self.entry(second)])
        wait_until(lambda: self.fetch(f"/{second.port}/load")[0] == 200, "the new machine is reached")
        self.assertEqual(self.fetch(f"/{first.port}/load")[0], 404)

    def test_many_requests_of_one_connection_are_answered_in_turn(self):
        machine = self.machine()
        self.session(self.entry(machine))
        connection = http.client.HTTPSConnection("localhost", self.port, timeout=PATIENCE, context=self.trust)
        self.addCleanup(connection.close)
        for path in ("load", "monitor", "nothing", "livez") * 3:
            for prefix in (f"/{machine.port}/", "/"):
                connection.request("GET", prefix + path)
                answer = connection.getresponse()
                answer.read()
                self.assertEqual(answer.status, 404 if path == "nothing" else 200, prefix + path)


class NothingElse(Site):
    def setUp(self):
        super().setUp()
        self.simulation = self.machine()
        self.server = self.session(self.entry(self.simulation))

    def raw(self, target, host="localhost"):
        """The status of a request that no library would send."""
        with socket.create_connection(("localhost", self.port), timeout=PATIENCE) as plain, \
                self.trust.wrap_socket(plain, server_hostname="localhost") as connection:
            connection.sendall(f"GET {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
            return int(connection.makefile("rb").readline().split()[1])

    def test_no_request_chooses_where_it_goes(self):
        with socket.create_server(("127.0.0.1", 0)) as hidden:
            port = hidden.getsockname()[1]
            hidden.setblocking(False)
            for target in (f"/{port}/", f"/{port}", f"/127.0.0.1:{port}/", f"//127.0.0.1:{port}/", f"/{self.simulation.port}@127.0.0.1:{port}/",
                           f"/{self.simulation.port}:{port}/", f"/0{self.simulation.port}/", "/22/", f"/http://127.0.0.1:{port}/",
                           f"/{self.simulation.port + 65536}/"):
                self.assertEqual(self.raw(target), 404, target)
            for host in (f"127.0.0.1:{port}", f"localhost:{port}"):
                self.assertEqual(self.raw(f"/{self.simulation.port}/load", host=host), 200)
                self.assertEqual(self.raw(f"http://{host}/{port}/"), 404)
            with self.assertRaises(BlockingIOError):
                hidden.accept()

    def test_what_is_the_operators_stays_inside(self):
        port = self.simulation.port
        for path in ("metrics", "/metrics", "metrics?a", "METRICS", "%6Detrics", "./metrics", "livez/../metrics", "livez/%2e%2e/metrics",
                     "api/drain", "/api/drain", "%2fapi/drain", "api"):
            self.assertEqual(self.raw(f"/{port}/{path}"), 404, path)
        for action in ("drain", "end?simulation=1"):
            self.assertEqual(self.fetch(f"/{port}/api/{action}", method="POST")[0], 404, action)
        self.assertEqual(self.fetch(f"/{port}/monitor")[0], 200)
        self.assertIsNotNone(self.simulation.get("/metrics"), "who reaches the machine itself sees them")
        self.assertEqual(self.simulation.get("/readyz"), self.fetch(f"/{port}/readyz")[1])

    def test_a_machine_that_is_down_is_a_502_with_a_sentence(self):
        self.simulation.stop()
        status, body = self.fetch(f"/{self.simulation.port}/load")
        self.assertEqual(status, 502)
        self.assertRegex(body.strip(), r"^[A-Z].* .*\.$")
        page = self.fetch(f"/{self.simulation.port}/monitor", Accept="text/html")[1]
        self.assertIn(f"<h1>{body.strip()}</h1>", page, "people see it in a page of ours")
        wait_until(lambda: self.fetch("/session")[1] == "Error: no simulation server available at the moment.", "no browser is sent there")
        self.simulation.start()
        wait_until(lambda: self.fetch(f"/{self.simulation.port}/load")[0] == 200, "it is reached again")

    def test_the_machine_is_not_reached_from_the_network(self):
        for address in {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)} - {"127.0.0.1"}:
            with self.assertRaises(OSError), socket.create_connection((address, self.simulation.port), timeout=PATIENCE):
                pass

    async def test_pages_of_other_sites_are_refused_where_there_is_a_policy(self):
        self.server.reread(allowedOrigins=["https://friend.example.org"])

        async def status(origin):
            try:
                async with websockets.connect(f"wss://{self.host}/{self.simulation.port}/client", ssl=self.trust, origin=origin):
                    return 101
            except websockets.InvalidStatusCode as refusal:
                return refusal.status_code
        self.assertEqual(await status("https://friend.example.org"), 403, "the machine has a policy of its own")
        self.simulation.reread(allowedOrigins=["https://friend.example.org"])

        async def is_friend():
            return await status("https://friend.example.org") == 101
        await wait_until_async(is_friend, "the machine takes over its new policy")
        self.assertEqual(await status("https://evil.example.com"), 403)


if __name__ == "__main__":
    main()
