#!/usr/bin/python3
"""A simulator is a stranger: over TLS, nothing that it answers binds a real browser to the attacker, or says anything of the site, and nothing of
the visitor reaches it but what it needs. docs/gateway.md, "Header fields"."""

import asyncio
import base64
import contextlib
import hashlib
import http.server
import json
import os
import ssl
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import hostile_simulator  # noqa: E402
from support.browser import BROWSER, open_browser  # noqa: E402
from support.browser_client import LOCAL, WORLD, websockets  # noqa: E402
from support.certificates import Authority  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.served import Served  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, wait_until  # noqa: E402

PASSWORD = "sesame"
# Of what a visitor's browser says, or proxies on the way do, a simulator gets none.
PRIVATE = ("authorization", "cookie", "referer", "forwarded", "x-forwarded-for", "x-forwarded-proto", "x-forwarded-host", "x-real-ip", "via")

# A page of the site shows the simulation, as the viewer does.
SHOW = """
const [files, address, done] = arguments;
const attempt = begin => new Promise(finish => {
  setTimeout(() => finish('nothing'), 10_000);
  new Promise(begin).then(finish, error => finish('failed: ' + error.name));
});
const fields = path => attempt(found => fetch(files + path, {credentials: 'include'}).then(answer => [...answer.headers.keys()]).then(found, found));
Promise.all([
  fields('/file.wbt'),
  fields('/secret/file'),
  attempt(shown => {
    const image = new Image();
    image.onload = image.onerror = () => shown('asked');
    image.src = files + '/picture.jpeg';
  }),
  attempt(opened => {
    window.connection = new WebSocket(address + '/');
    connection.onopen = () => opened('open');
    connection.onerror = () => opened('closed');
  }),
  attempt((done, failed) => navigator.serviceWorker.register(files + '/worker.js', {scope: '/'}).then(() => done('registered'), failed)),
]).then(done);
"""
ASK_THE_SITE = """
const [paths, done] = arguments;
Promise.all(paths.map(path => fetch(path).then(answer => answer.status, error => String(error)))).then(done);
"""


class Attacker(Served):
    """Collects what browsers report. A page of its own sends the same commands, about itself."""

    def __init__(self, certificate, key):
        attacker = self
        self.asked = []
        self.reported = []  # addresses

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self):
                attacker.asked.append(self.path)
                self.say(attacker.commands() if self.path.startswith("/own") else {})

            def do_OPTIONS(self):
                self.say({"Access-Control-Allow-Methods": "*"})

            def do_POST(self):
                reports = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
                attacker.reported += [report["url"] for report in reports]
                self.say({})

            def say(self, headers):
                with contextlib.suppress(OSError):
                    self.send_response(200)
                    for name, value in {"Access-Control-Allow-Origin": "*", "Access-Control-Allow-Headers": "*", "Content-Type": "text/html",
                                        "Content-Length": "0", **headers}.items():
                        self.send_header(name, value)
                    self.end_headers()

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(certificate, key)
        self.server.socket = context.wrap_socket(self.server.socket, server_side=True)
        self.server.daemon_threads = True
        self.url = f"https://localhost:{self.server.server_port}"

    def commands(self):
        return {
            "Report-To": json.dumps({"group": "all", "max_age": 3600, "include_subdomains": False, "endpoints": [{"url": f"{self.url}/reports"}]}),
            "NEL": json.dumps({"report_to": "all", "max_age": 3600, "success_fraction": 1.0, "failure_fraction": 1.0}),
            "Reporting-Endpoints": f'default="{self.url}/reports"',
        }


def fingerprint(certificate):
    """Of the public key, as Chromium wants it."""
    key = subprocess.run(["openssl", "x509", "-in", certificate, "-pubkey", "-noout"], check=True, capture_output=True).stdout
    encoded = subprocess.run(["openssl", "pkey", "-pubin", "-outform", "der"], input=key, check=True, capture_output=True).stdout
    return base64.b64encode(hashlib.sha256(encoded).digest()).decode()


class HostileSimulator(unittest.TestCase):
    def setUp(self):
        if BROWSER != "chromium":
            self.skipTest("no other browser reports network errors")
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_hostile_"))
        os.chmod(self.folder, 0o755)
        authority = Authority(self.folder, "authority")
        self.certificate, key = authority.issue("site", "DNS:localhost")
        self.attacker = self.enterContext(Attacker(self.certificate, key))
        hostile_simulator.make_home(self.folder, self.answers())
        port = free_port()
        self.site = f"https://localhost:{port}"
        own_certificate, own_key = authority.issue("machine", "DNS:localhost", "IP:127.0.0.1")
        self.machine = self.enterContext(SimulationServer(
            **LOCAL, webotsHome=self.folder, server=f"localhost:{port}", ssl=True, portRewrite=True, gateway=True, sslCertificate=own_certificate,
            sslKey=own_key, monitorPassword=PASSWORD))
        self.session = self.enterContext(SessionServer(
            [{"address": f"localhost:{port}/{self.machine.port}", "internal": f"https://127.0.0.1:{self.machine.port}", "trusted": True}], port=port,
            ssl=True, sslCertificate=self.certificate, sslKey=key, caFile=authority.certificate, monitorPassword=PASSWORD))
        wait_until(lambda: self.session.get("/") == "1", self.session.log)

    def answers(self):
        return {
            **self.attacker.commands(),
            "Set-Cookie": "planted=1; Path=/; Secure",
            "Set-Cookie2": "planted=1; Path=/",
            "Link": f"<{self.attacker.url}/preloaded.css>; rel=preload; as=style, <{self.attacker.url}>; rel=preconnect",
            "Service-Worker-Allowed": "/",
            "Alt-Svc": 'h2="localhost:9"; ma=3600',
            "Accept-CH": "Sec-CH-UA-Full-Version-List, Sec-CH-UA-Model",
            "Critical-CH": "Sec-CH-UA-Model",
            "Speculation-Rules": f'"{self.attacker.url}/rules.json"',
            "Origin-Agent-Cluster": "?1",
            "Expect-CT": f'max-age=3600, report-uri="{self.attacker.url}/reports"',
            "Strict-Transport-Security": "max-age=3600",
            "Clear-Site-Data": '"cookies", "storage"',
            "Content-Security-Policy-Report-Only": f"default-src 'none'; report-uri {self.attacker.url}/reports; report-to all",
        }

    async def start(self):
        """The address of a simulation, which lives until the connection is closed."""
        trust = ssl._create_unverified_context()
        self.connection = await websockets.connect(f"wss://localhost:{self.session.port}/{self.machine.port}/client", ssl=trust)
        await self.connection.send(json.dumps({"start": {"url": WORLD, "mode": "w3d"}}))
        while True:
            message = await asyncio.wait_for(self.connection.recv(), PATIENCE)
            if message.startswith("webots:"):
                return message.removeprefix("webots:")

    def open_browser(self):
        trusted = f"--ignore-certificate-errors-spki-list={fingerprint(self.certificate)}"
        return self.enterContext(open_browser(1000, 700, whole=True, more=(trusted, "--short-reporting-delay")))

    def log_in(self, browser, path):
        browser.get(f"https://operator:{PASSWORD}@localhost:{self.session.port}{path}/monitor")
        wait_until(lambda: browser.find_elements("tag name", "main"), lambda: f"no monitor: {browser.page_source[:500]}")

    def await_reports(self, browser, page):
        """Until the browser has reported that it has seen this page of the attacker's own, after all that it has asked before."""
        browser.get(f"{self.attacker.url}/own/{page}")
        wait_until(lambda: f"{self.attacker.url}/own/{page}" in self.attacker.reported, lambda: f"Chromium reports nothing: {self.attacker.reported}")

    def test_it_learns_nothing_and_binds_nobody(self):
        async def with_a_simulation():
            address = await self.start()
            try:
                await asyncio.to_thread(self.visit, address, address.replace("wss", "https", 1))
            finally:
                await self.connection.close()
        asyncio.run(with_a_simulation())

    def visit(self, address, files):
        browser = self.open_browser()
        self.log_in(browser, f"/{self.machine.port}")
        self.log_in(browser, "")
        browser.add_cookie({"name": "other", "value": "secret", "httpOnly": True, "sameSite": "Strict"})  # of another port of this host
        browser.get(f"{self.site}/viewer/")
        found, refused, picture, socket, worker = browser.execute_async_script(SHOW, files, address)
        self.assertEqual((picture, socket), ("asked", "open"))
        hostile = {name.lower() for name in (*self.answers(), *hostile_simulator.SECRET)}
        self.assertIn("content-type", found)
        self.assertEqual(hostile & {*found, *refused}, set())
        self.assertRegex(worker, "^failed: ")
        for path in ("/page.html", "/refresh.html", "/secret/page.html"):
            browser.get(files + path)
            with self.subTest(path):  # no dialog, and no other page
                self.assertEqual(browser.find_element("tag name", "main").text, "hostile")
                self.assertEqual(browser.current_url, files + path)
                self.assertEqual(browser.execute_script("return self.origin"), "null")
        browser.get(f"{self.site}/viewer/")
        asked = browser.execute_async_script(ASK_THE_SITE, ["/session", "/missing", "/viewer/", "/monitor", f"/{self.machine.port}/monitor"])
        self.assertEqual(asked, [200, 404, 200, 200, 200])  # the passwords are still known, whatever was answered below /secret
        self.assertEqual([cookie["name"] for cookie in browser.get_cookies()], ["other"])
        self.await_reports(browser, "1")
        self.await_reports(browser, "2")
        self.assertEqual([url for url in self.attacker.reported if not url.startswith(self.attacker.url)], [])
        self.assertEqual([path for path in self.attacker.asked if not path.startswith(("/own/", "/favicon.ico"))], [])
        asked = hostile_simulator.asked(self.folder)
        for path in ("/file.wbt", "/picture.jpeg", "/", "/page.html", "/secret/file"):
            self.assertIn(path, [each for each, _ in asked])
        self.assertNotIn("/worker.js", [path for path, _ in asked])
        for path, headers in asked:
            with self.subTest(path):
                self.assertEqual([name for name in headers if name in PRIVATE or name.startswith("sec-fetch")], [])
                self.assertNotIn("secret", str(list(headers.values())))


if __name__ == "__main__":
    main()
