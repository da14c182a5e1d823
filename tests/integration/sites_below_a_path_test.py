#!/usr/bin/python3
"""Sites below a path of a host, behind a real nginx and Apache: everything that browsers are told leads back below that path. The proxy
says which path it is, or the configuration does, as with the Python servers. Protocol sections 2.1, 13.12, 13.13 and 13.16."""

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
import urllib.parse
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import apache, nginx  # noqa: E402
from support.browser import open_browser  # noqa: E402
from support.browser_client import LOCAL, WORLD, websockets  # noqa: E402
from support.frames import PICTURE  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, free_port, main, wait_until  # noqa: E402

try:
    from support.mailbox import Certificate
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-aiosmtpd)") or 77)

PASSWORD = "abcd-efgh-jkmn"
SIMULATION = r"/simulation/[a-zA-Z]+/\d+"

EMBED = """
const script = document.createElement('script');
Object.assign(script, {type: 'module', src: arguments[0]});
const view = document.createElement('webots-view');
view.setAttribute('src', arguments[1]);
view.setAttribute('data-mode', 'mjpeg');
view.setAttribute('data-autoplay', '');
document.body.append(view);
document.head.append(script);
"""


async def hear(socket, beginning=""):
    while True:
        message = await asyncio.wait_for(socket.recv(), PATIENCE)
        if not beginning or (isinstance(message, str) and message.startswith(beginning)):
            return message


def picture(browser):
    """The pixels of the stream as the page shows them now; empty before the first frame."""
    image = browser.find_element("id", "picture")
    return image.screenshot_as_png if image.get_attribute("data-live") is not None else b""


class BelowAPath:
    """Browsers know the host of the proxy, which is `proxy`, a module, and one path there."""

    def setUp(self):
        self.proxy.program()
        if not shutil.which("openssl"):
            self.skipTest("openssl is missing (package openssl)")
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_below_a_path_"))
        self.certificate = Certificate(self.folder)
        self.trust = ssl.create_default_context(cafile=self.certificate.authority)
        self.port = free_port()
        self.host = f"localhost:{self.port}"

    def servers(self, paths, machine, session, entry=None):
        """`paths`: of the proxy, by the name of a server; empty: it tells the session server its path, /webots. `machine` and `session`: keys
        of their configurations. `entry`: the machine's at the session server; by default it is below that."""
        machine = SimulationServer(**{**LOCAL, "gateway": True, "maxConnections": 2, "reconnectGrace": 0, **machine})
        entry = entry or {"address": f"*/{machine.port}", "internal": f"127.0.0.1:{machine.port}"}
        server = SessionServer([entry], teacherPassword=PASSWORD, viewerUrl=WORLD, **session)
        for each in (machine, server):
            each.environment["SSL_CERT_FILE"] = self.certificate.authority
        ports = {"machine": machine.port, "simulator": machine.port + 1, "session": server.port}
        targets = {path.format(ports[name]): ports[name] for name, path in paths.items()}
        self.enterContext(self.proxy.below_paths(targets, self.port, self.certificate) if paths
                          else self.proxy.documented_path("/webots", server.port, self.port, self.certificate))
        self.enterContext(machine)
        self.enterContext(server)
        wait_until(lambda: server.get("/") == "1", lambda: f"the session server finds the machine:\n{server.log()}")
        self.machine, self.session = machine, server

    def told_site(self, **session):
        """Only the proxy knows the path, and that it speaks TLS."""
        self.servers({}, {"server": "*", "ssl": False}, {"server": "localhost", "ssl": False, **session})

    def named_site(self, **session):
        """Only the configuration knows them: the proxy says nothing, not even the host."""
        self.servers({"session": "/webots"}, {"server": "*", "ssl": False}, {**self.named("/webots"), **session})

    def named(self, path):
        return {"server": self.host + path, "ssl": True, "portRewrite": True}

    def get(self, path, **headers):
        """Status and body."""
        request = urllib.request.Request(f"https://{self.host}{path}", headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE, context=self.trust) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as refusal:
            with refusal:
                return refusal.code, refusal.read().decode()

    def redirect(self, path):
        """Where a browser is led, as it resolves that."""
        with contextlib.closing(http.client.HTTPSConnection("localhost", self.port, timeout=PATIENCE, context=self.trust)) as connection:
            connection.request("GET", path, headers={"Accept": "text/html"})
            answer = connection.getresponse()
            self.assertIn(answer.status, (301, 302, 307, 308), path)
            return urllib.parse.urljoin(f"https://{self.host}{path}", answer.headers["Location"])

    def follow(self, address):
        return websockets.connect(address, ssl=self.trust, open_timeout=PATIENCE)

    def see_pictures(self, address, count=3):
        with urllib.request.urlopen(address, timeout=PATIENCE, context=self.trust) as stream:
            received = b""
            while received.count(PICTURE) < count:
                received += stream.read1(1 << 16)

    async def visit(self, place, simulator):
        """Starts a simulation where `/session` has sent the browser, and watches it. `simulator`: what its address has to be."""
        async with self.follow(f"{place}/client") as browser:
            await browser.send(json.dumps({"start": {"url": WORLD, "mode": "mjpeg"}}))
            address = (await hear(browser, "webots:")).removeprefix("webots:")
            self.assertRegex(address, f"^{simulator}$")
            async with self.follow(f"{address}/") as viewer:
                await viewer.send("mjpeg: 320x240")
                await hear(viewer, "scene load completed")
                await viewer.send("real-time:-1")
                if "/simulation/" in address:  # simulators at ports of their own let one viewer in
                    await asyncio.to_thread(self.see_pictures, f"{address.replace('wss', 'https', 1)}/mjpeg")
        await asyncio.to_thread(self.machine.wait_until_clean)
        return address

    @staticmethod
    def link_of(shown):
        """Where the page leads for the only machine (src/web/monitor/session.js)."""
        machine, = shown["servers"]
        if "path" in machine:
            return f"{machine['path'][1:]}/monitor"
        if shown["about"]["gateway"] and "/" in machine["address"]:
            return f"{machine['address'].rpartition('/')[2]}/monitor"
        return f"{'https' if shown['about']['tls'] else 'http'}://{machine['address']}/monitor"

    async def check_pages(self, machines_monitor):
        self.assertEqual(self.redirect("/webots/"), f"https://{self.host}/webots/viewer/worlds/")
        for page in ("viewer", "class"):
            self.assertEqual(self.redirect(f"/webots/{page}"), f"https://{self.host}/webots/{page}/")
            self.assertEqual(self.get(f"/webots/{page}/")[0], 200)
        self.assertEqual(self.get("/webots/view/webots_view.js")[0], 200)
        self.assertEqual(self.get("/webots/monitor")[0], 200)
        async with self.follow(f"wss://{self.host}/webots/monitor") as watcher:
            shown = json.loads(await hear(watcher))
            self.assertEqual(self.link_of(shown), machines_monitor)
        async with self.follow(f"wss://{self.host}/webots/") as light:
            self.assertEqual(await hear(light), "1")
        for path in ("/session", "/viewer/", f"/{self.machine.port}/client"):
            self.assertEqual(self.get(path)[0], 410, "the rest of the host is others'")

    async def check_site(self):
        base = f"wss://{self.host}/webots"
        self.assertEqual(self.get("/webots/session"), (200, f"{base}/{self.machine.port}"))
        async with self.follow(f"{base}/session") as browser:
            self.assertEqual(await hear(browser), f"{base}/{self.machine.port}")
        await self.visit(f"{base}/{self.machine.port}", f"{base}/{self.machine.port}{SIMULATION}")
        await self.check_pages(f"{self.machine.port}/monitor")
        self.assertIn("<h1>Webots simulation server</h1>", self.get(f"/webots/{self.machine.port}/monitor")[1])

    async def check_relay(self):
        base = f"wss://{self.host}/webots"
        self.assertEqual(self.get("/webots/session"), (200, base))
        async with self.follow(f"{base}/session") as browser:
            self.assertEqual(await hear(browser), base)
        await self.visit(base, f"{base}/{self.machine.port}{SIMULATION}")
        await self.check_pages(f"{self.machine.port}/monitor")

    async def test_a_proxy_says_below_which_path_it_has_a_site(self):
        self.told_site()
        await self.check_site()

    async def test_a_proxy_says_below_which_path_it_has_a_site_that_relays(self):
        self.told_site(relay=True)
        await self.check_relay()

    async def test_a_configuration_names_the_path_of_a_site(self):
        self.named_site()
        await self.check_site()

    async def test_a_configuration_names_the_path_of_a_site_that_relays(self):
        self.named_site(relay=True)
        await self.check_relay()

    def python_form(self, machine, **session):
        """Each server has a path, and so have the simulators' ports. Returns where the machine is."""
        paths = {"simulator": "/webots_simulation_server/{}", "machine": "/webots_simulation_server", "session": "/webots"}
        named = self.named("/webots_simulation_server")
        self.servers(paths, {**named, **machine}, {**self.named("/webots"), **session}, entry=named["server"])
        return named["server"]

    async def check_python_form(self, simulator, **machine):
        place = self.python_form(machine)
        self.assertEqual(self.get("/webots/session"), (200, f"wss://{place}"))
        await self.visit(f"wss://{place}", f"wss://{place}{simulator}")
        await self.check_pages(f"https://{place}/monitor")
        self.assertIn("<h1>Webots simulation server</h1>", self.get("/webots_simulation_server/monitor")[1])
        for server in (self.machine, self.session):
            status, said = server.command("--check-config")
            self.assertEqual((status, said.count("warning")), (0, 0), said)
            self.assertRegex(server.command("--doctor")[1], rf"ok +public address +https://{server.config['server']}/livez leads here")

    async def test_two_servers_have_paths_as_with_the_python_servers(self):
        await self.check_python_form(SIMULATION)

    async def test_simulators_have_paths_as_with_the_python_servers(self):
        await self.check_python_form(r"/\d+", gateway=False)

    async def test_tickets_are_for_machines_below_a_path(self):
        secret = os.path.join(self.folder, "secret")
        with open(secret, "w") as file:
            file.write("0123456789abcdef" * 2)
        os.chmod(secret, 0o600)
        place = f"wss://{self.python_form({'sessionSecret': secret}, sessionSecret=secret)}"
        address = self.get("/webots/session")[1]
        self.assertRegex(address, f"^{place}/ticket/[A-Za-z0-9_-]+$")
        await self.visit(address, f"{place}{SIMULATION}")

    async def test_a_lesson_is_held_below_a_path(self):
        self.told_site()
        base = f"wss://{self.host}/webots"
        async with self.follow(f"{base}/class") as teacher, self.follow(f"{base}/class") as student:
            await teacher.send(json.dumps({"teach": {"password": PASSWORD, "world": WORLD, "mode": "mjpeg", "seats": 1}}))
            opened = json.loads(await hear(teacher))["class"]
            self.assertEqual(opened["machines"], [f"{base}/{self.machine.port}"])
            await student.send(json.dumps({"join": {"code": opened["code"], "name": "Ada"}}))
            joined = json.loads(await hear(student))["joined"]
            self.assertEqual(self.get(f"/webots/session?class={joined['seat']}"), (200, f"{base}/{self.machine.port}"))
            simulator = f"{base}/{self.machine.port}/simulation/abc/2001"
            await student.send(json.dumps({"state": {"state": "running", "time": 1, "simulator": simulator}}))
            while (said := json.loads(await hear(teacher))).get("student", {}).get("state") != "running":
                pass
            self.assertEqual(said["student"]["simulator"], simulator)


class BehindNginx(BelowAPath, unittest.IsolatedAsyncioTestCase):
    proxy = nginx

    def test_the_viewer_shows_moving_pictures(self):
        self.told_site(relay=True)
        browser = self.enterContext(open_browser(1280, 800, trusting=True))
        browser.get(f"https://{self.host}/webots/viewer/")
        body = browser.find_element("tag name", "body")
        wait_until(lambda: body.get_attribute("data-availability") == "available", self.session.log)
        browser.find_element("id", "start").click()
        wait_until(lambda: body.get_attribute("data-state") in ("running", "failed"), self.machine.log)
        self.assertEqual(body.get_attribute("data-state"), "running", browser.find_element("id", "status").text)
        first = wait_until(lambda: picture(browser), "no picture came")
        wait_until(lambda: picture(browser) != first, "the picture stands still")
        loaded = browser.execute_script("return performance.getEntriesByType('resource').map(each => each.name)")
        self.assertEqual([url for url in loaded if not url.startswith((f"https://{self.host}/webots/", "blob:", "data:"))], [])
        browser.get("about:blank")
        self.machine.wait_until_clean()


    def test_a_page_embeds_a_simulation(self):
        self.told_site()
        browser = self.enterContext(open_browser(1280, 800, trusting=True))
        browser.get(f"https://{self.host}/webots/livez")
        browser.execute_script(EMBED, f"https://{self.host}/webots/view/webots_view.js", WORLD)
        view = browser.find_element("tag name", "webots-view")
        wait_until(lambda: view.get_attribute("data-state") in ("running", "failed"), self.machine.log)
        self.assertEqual(view.get_attribute("data-state"), "running")
        browser.get("about:blank")
        self.machine.wait_until_clean()


class BehindApache(BelowAPath, unittest.IsolatedAsyncioTestCase):
    proxy = apache


class WithoutAProxy(unittest.TestCase):
    def test_nobody_but_a_trusted_proxy_is_believed(self):
        said = {"X-Forwarded-Prefix": "/webots", "X-Forwarded-Proto": "https"}
        for proxies, expected in (([], "ws://localhost:{}"), (["127.0.0.1"], "wss://localhost:{}/webots")):
            with self.subTest(proxies), SimulationServer(**LOCAL) as machine, \
                    SessionServer([machine.address], relay=True, trustedProxies=proxies) as session:
                wait_until(lambda: session.get("/") == "1", session.log)
                self.assertEqual(session.get("/session", said), expected.format(session.port))


if __name__ == "__main__":
    main()
