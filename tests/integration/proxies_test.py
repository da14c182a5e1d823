#!/usr/bin/python3
"""The servers behind a real Apache or nginx that terminates TLS and rewrites ports: config/apache and config/nginx, and the rules of
existing installations. Protocol sections 2, 4.1 and 8.4."""

import asyncio
import contextlib
import http.client
import json
import os
import shutil
import ssl
import sys
import tempfile
import unittest
import urllib.error
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import apache, nginx  # noqa: E402
from support.browser import open_browser  # noqa: E402
from support.browser_client import LOCAL, WORLD, websockets  # noqa: E402
from support.servers import SessionServer, SimulationServer, free_port, main, wait_until  # noqa: E402

try:
    from support.mailbox import Certificate
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-aiosmtpd)") or 77)

PATIENCE = 30
SANDBOX = "sandbox allow-scripts allow-forms allow-popups allow-downloads"

# From the guide of Webots. They pass on no WebSocket for /monitor, so the page uses another address.
RULES_OF_THE_GUIDE = r"""
    RewriteEngine on
    RewriteCond %{{HTTP:Upgrade}} websocket [NC]
    RewriteCond %{{HTTP:Connection}} upgrade [NC]
    RewriteRule ^/(\d*)/(.*)$ "ws://localhost:$1/$2" [P,L]
    RewriteRule ^/load$ "http://localhost:{port}/load" [P,L]
    RewriteRule ^/monitor$ "http://localhost:{port}/monitor" [P,L]
    RewriteRule ^/session$ "http://localhost:{port}/session" [P,L]
    RewriteRule ^/(\d*)/(.*)$ "http://localhost:$1/$2" [P,L]
"""


class Site:
    """A session server and its one simulation server, each reachable only through a proxy."""

    def __init__(self, folder, proxy, gateway, session_gateway):
        self.gateway = gateway
        self.session_gateway = session_gateway
        self.certificate = Certificate(folder)
        self.context = ssl.create_default_context(cafile=self.certificate.authority)
        self.proxy = proxy
        self.port = free_port()

    def __enter__(self):
        with contextlib.ExitStack() as stack:
            public = {"server": f"localhost:{self.port}", "ssl": True, "portRewrite": True}
            self.simulation = SimulationServer(gateway=self.gateway, **public, **LOCAL)
            self.session = SessionServer([f"localhost:{self.port}/{self.simulation.port}"], gateway=self.session_gateway, **public)
            self.session.environment["SSL_CERT_FILE"] = self.certificate.authority
            simulation_ports = range(self.simulation.port, self.simulation.port + 21)
            stack.enter_context(self.proxy(self.session.port, simulation_ports, self.port, self.certificate))
            stack.enter_context(self.simulation)
            stack.enter_context(self.session)
            wait_until(lambda: self.session.get("/") == "1", "the session server finds the simulation server")
            self.stack = stack.pop_all()
        return self

    def __exit__(self, *_):
        self.stack.close()

    def get(self, path, **headers):
        """Status and body."""
        request = urllib.request.Request(f"https://localhost:{self.port}{path}", headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE, context=self.context) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as refusal:
            return refusal.code, refusal.read().decode()

    def policies(self, path):
        """What the Content-Security-Policy of an answer says: a list."""
        with contextlib.closing(http.client.HTTPSConnection("localhost", self.port, timeout=PATIENCE, context=self.context)) as connection:
            connection.request("GET", path)
            return connection.getresponse().headers.get_all("Content-Security-Policy", [])

    def upgrade(self, path, method="GET"):
        """The status that the beginning of a WebSocket is answered with."""
        connection = http.client.HTTPSConnection("localhost", self.port, timeout=PATIENCE, context=self.context)
        with contextlib.closing(connection):
            connection.request(method, path, headers={"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
                                                      "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="})
            return connection.getresponse().status

    def websocket(self, path):
        return self.follow(f"wss://localhost:{self.port}{path}")

    def follow(self, address):
        return websockets.connect(address, ssl=self.context, open_timeout=PATIENCE)


async def hear(socket):
    return await asyncio.wait_for(socket.recv(), PATIENCE)


class BehindAProxy(unittest.IsolatedAsyncioTestCase):
    def setUp(self):
        if not shutil.which("openssl"):
            self.skipTest("openssl is missing (package openssl)")
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_proxies_test_")
        self.addCleanup(shutil.rmtree, self.folder)

    def site(self, proxy, gateway=True, session_gateway=False):
        return self.enterContext(Site(self.folder, proxy, gateway, session_gateway))

    async def check_a_visit(self, site):
        """The steps of a browser: check availability, get an address, start, watch, leave."""
        async with site.websocket(f"/{site.session.port}/") as availability:
            self.assertEqual(await hear(availability), "1")
            place = f"wss://localhost:{site.port}/{site.simulation.port}"
            self.assertEqual(site.get(f"/session?url={WORLD}"), (200, place))
            await self.check_a_session(site)
        self.assertRegex(site.get("/load")[1], r"^[0-9.]+$")
        self.assertIn("<h1>Webots session server</h1>", site.get("/monitor")[1])

    async def check_a_session(self, site):
        async with site.follow(f"wss://localhost:{site.port}/{site.simulation.port}/client") as browser:
            await browser.send(json.dumps({"start": {"url": WORLD, "mode": "mjpeg"}}))
            told = []
            while not told or not told[-1].startswith("webots:"):
                told.append(await hear(browser))
            self.assertEqual("/simulation/" in told[-1], site.gateway)
            async with site.follow(told[-1].removeprefix("webots:") + "/") as simulator:
                await simulator.send("mjpeg: 320x240")
                self.assertTrue(await hear(simulator))
            self.assertIn("arena.wbt", site.get(f"/{site.simulation.port}/monitor")[1])
        await asyncio.to_thread(site.simulation.wait_until_clean)

    async def check_live_monitor(self, site, path):
        async with site.websocket(path) as watcher:
            first = json.loads(await hear(watcher))
            self.assertEqual(first["servers"][0]["address"], f"localhost:{site.port}/{site.simulation.port}")
            placed = first["servers"][0]["placed"]
            site.get("/session")
            for _ in range(PATIENCE):  # at most one a second
                update = json.loads(await hear(watcher))
                if any(row["placed"] > placed for row in update.get("rows", [])):
                    return
            self.fail("the placement never showed")

    async def check_our_configuration(self, site):
        await self.check_a_visit(site)
        await self.check_live_monitor(site, "/monitor")
        await self.check_live_monitor(site, f"/{site.session.port}/monitor")
        async with site.websocket(f"/{site.session.port}") as browser:
            self.assertEqual(await hear(browser), "1", "an address without a slash at its end")
        async with site.websocket("/session") as browser:
            self.assertEqual(await hear(browser), f"wss://localhost:{site.port}/{site.simulation.port}")
        with SessionServer([f"localhost:{site.port}/{site.simulation.port}"], ssl=True) as stranger:
            wait_until(lambda: "from an authority that we do not know" in stranger.log(), lambda: f"nobody it trusts vouches for that certificate:\n{stranger.log()}")
            self.assertEqual(stranger.get("/"), "0")
        self.assertEqual(site.get("/viewer/")[0], 200)
        for folder in ("", f"/{site.session.port}"):
            self.assertEqual(site.get(f"{folder}/class/view/session.js")[0], 200)
            async with site.websocket(f"{folder}/class") as teacher:
                await teacher.send('{"teach":{"key":"another"}}')
                self.assertEqual(json.loads(await hear(teacher))["error"], "code")
        for path in (f"/{site.port}/load", "/22/", "/3000x/", "/nope"):
            self.assertEqual(site.get(path)[0], 404, path)
        for server in (site.session, site.simulation):
            for path in ("api/decisions", "metrics", "metrics?a", "/metrics", "./metrics", "%6detrics", "livez/../metrics"):
                self.assertEqual(site.get(f"/{server.port}/{path}")[0], 404, f"{path}: the operator's, not the world's")
                self.assertEqual(site.upgrade(f"/{server.port}/{path}"), 404, f"{path}, as if it were a WebSocket")
            self.assertEqual(site.upgrade(f"/{server.port}/api/drain", "POST"), 404)
        for path in ("/metrics", "/api/operator"):
            self.assertEqual(site.get(path)[0], 404, path)
        for path in ("monitor", "load", "no/such/page"):
            self.assertIn(SANDBOX, site.policies(f"/{site.simulation.port}/{path}"), "a machine is not the site")
        for path in ("/viewer/", "/monitor", "/class/", f"/{site.session.port}/monitor"):
            self.assertNotIn(SANDBOX, site.policies(path), path)

    async def check_availability_beside_the_sites_own_page(self, site):
        async with site.websocket("/") as light:
            self.assertEqual(await hear(light), "1")
        for headers in ({}, {"Upgrade": "h2c"}):
            self.assertEqual(site.get("/", **headers)[0], 410, "the site's own page")

    def check_the_light_of_the_viewer(self, site):
        with open_browser(1280, 800, trusting=True) as browser:
            for folder in ("", f"/{site.session.port}"):
                browser.get(f"https://localhost:{site.port}{folder}/viewer/")
                light, = wait_until(lambda: browser.find_elements("id", "light-text"), lambda: f"{browser.current_url}: {browser.page_source[:1000]}")
                wait_until(lambda: light.text == "A machine is free.", lambda: f"{folder}/viewer/ says: {light.text}")


class OurConfiguration:
    """The file in config/ for the proxy that `proxy`, a module, starts."""

    def setUp(self):
        self.proxy.program()
        super().setUp()

    async def test_our_configuration_carries_a_whole_visit_and_opens_nothing_else(self):
        await self.check_our_configuration(self.site(self.proxy.site))

    async def test_simulators_are_reached_at_their_own_ports_as_well(self):
        await self.check_a_visit(self.site(self.proxy.site, gateway=False))

    async def test_simulations_behind_the_gateway_of_their_server_need_its_port_alone(self):
        def proxy(session_port, simulation_ports, *rest):
            return self.proxy.site(session_port, simulation_ports[:1], *rest)
        await self.check_a_visit(self.site(proxy))

    async def test_a_proxy_that_passes_all_on_to_the_session_servers_gateway_needs_one_rule(self):
        site = self.site(self.proxy.one_rule, session_gateway=True)
        async with site.websocket("/") as availability:
            self.assertEqual(await hear(availability), "1")
        self.assertEqual(site.get("/session"), (200, f"wss://localhost:{site.port}/{site.simulation.port}"))
        await self.check_a_session(site)
        self.assertEqual(site.get(f"/{site.simulation.port}/metrics")[0], 404)

    async def test_availability_is_told_at_the_address_of_the_sites_own_page(self):
        await self.check_availability_beside_the_sites_own_page(self.site(self.proxy.site))

    async def test_the_viewer_shows_a_green_light(self):
        await asyncio.to_thread(self.check_the_light_of_the_viewer, self.site(self.proxy.site))


class BehindApache(OurConfiguration, BehindAProxy):
    proxy = apache

    async def test_the_rules_of_the_guide_carry_it_too_and_the_monitor_page_finds_its_way(self):
        site = self.site(lambda session_port, _, *rest: apache.Apache(RULES_OF_THE_GUIDE.format(port=session_port), *rest))
        await self.check_a_visit(site)
        with self.assertRaises(websockets.InvalidHandshake):
            await site.websocket("/monitor")
        await self.check_live_monitor(site, f"/{site.session.port}/monitor")
        snapshot = json.loads(site.get("/monitor", Accept="application/json")[1])
        self.assertEqual(len(snapshot["servers"]), 1)


class BehindNginx(OurConfiguration, BehindAProxy):
    proxy = nginx


class BehindNginxWithoutRules(unittest.TestCase):
    def test_a_proxy_that_passes_no_websockets_on_is_named_in_the_log(self):
        with SimulationServer(**LOCAL) as simulation, SessionServer([simulation.address], relay=True) as session:
            for server in (simulation, session):
                with self.subTest(server.PROGRAM), nginx.reverse_proxy(server.port) as origin:
                    handshake = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
                                 "Sec-WebSocket-Key": "MDEyMzQ1Njc4OWFiY2RlZg=="}
                    with self.assertRaises(urllib.error.HTTPError) as refused:
                        urllib.request.urlopen(urllib.request.Request(origin + "/client", headers=handshake), timeout=PATIENCE)
                    refused.exception.close()
                    self.assertEqual(refused.exception.code, 400)
                    told = "A WebSocket for /client came without \"Upgrade\" (127.0.0.1): a proxy in between lacks the rules"
                    wait_until(lambda: told in server.log(), server.log)  # noqa: B023
                    self.assertEqual(server.ask("/client")[0], 400)  # somebody who has typed the address
                    self.assertEqual(server.log().count("came without"), 1)


if __name__ == "__main__":
    main()
