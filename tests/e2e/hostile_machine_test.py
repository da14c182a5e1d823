#!/usr/bin/python3
"""A machine is a peer, not the site: what a hostile simulation server answers through the session server's gateway has an origin of its own in
real browsers. The monitors of honest machines are live all the same. docs/gateway.md, "Machines are peers"."""

import contextlib
import http.server
import json
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser import BROWSER, open_browser, run_first  # noqa: E402
from support.browser_client import LOCAL  # noqa: E402
from support.name_server import NameServer  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.served import Served  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402

PASSWORD = "sesame"

# What a script of a page can try; it ends with an object of texts.
ATTACK = """
const attempt = (what, within = 3000) => new Promise(done => {
  setTimeout(() => done('nothing'), within);
  try {
    Promise.resolve(what()).then(found => done(String(found)), error => done('failed: ' + error.name));
  } catch (error) {
    done('failed: ' + error.name);
  }
});
const framed = path => () => new Promise(done => {
  const frame = document.createElement('iframe');
  frame.onload = () => done(frame.contentDocument ? 'read: ' + frame.contentDocument.body.innerHTML.length : 'closed');
  frame.src = path;
  document.body.append(frame);
});
const opened = path => () => new Promise(done => {
  const socket = new WebSocket(`ws://${location.host}${path}`);
  socket.onmessage = event => done('heard: ' + event.data);
  socket.onclose = () => done('closed');
});
window.attack = async () => ({
  origin: self.origin,
  session: await attempt(() => sessionStorage.getItem('ticket')),
  local: await attempt(() => localStorage.getItem('key')),
  cookie: await attempt(() => document.cookie),
  monitor: await attempt(async () => (await fetch('/monitor', {credentials: 'include'})).text()),
  class: await attempt(framed('/class/')),
  monitorFrame: await attempt(framed('/monitor')),
  watch: await attempt(opened('/monitor')),
  client: await attempt(opened('/client')),
  availability: await attempt(opened('/')),
  worker: await attempt(() => navigator.serviceWorker.register('worker.js').then(() => 'registered')),
  image: await attempt(() => new Promise(done => {
    const image = new Image();
    image.onload = image.onerror = () => done('asked');
    image.src = 'monitor?image';
    document.body.append(image);
  })),
});
"""
HTML = f"<!DOCTYPE html><html><head><title>hostile</title></head><body><script>{ATTACK}</script></body></html>"
SVG = "<svg xmlns='http://www.w3.org/2000/svg'><script>window.attack = async () => ({origin: self.origin})</script></svg>"
XHTML = "<html xmlns='http://www.w3.org/1999/xhtml'><body><script>window.attack = async () => ({origin: self.origin})</script></body></html>"
PARTS = ("--b\r\nContent-Type: text/html\r\n\r\n<body><script>window.attack = async () => ({origin: self.origin})</script></body>\r\n--b--\r\n")


class HostileMachine(Served):
    """A simulation server that answers its polls, and browsers as it likes."""

    # What it says of its pages could only take from them, but let it try to give.
    LAX = {"Content-Security-Policy": "default-src * 'unsafe-inline' data: blob:; frame-ancestors *"}

    def __init__(self):
        hostile = self
        self.asked = []
        self.authorizations = []

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self):
                path = self.path.partition("?")[0]
                hostile.asked.append(self.path)
                if "Authorization" in self.headers:
                    hostile.authorizations.append(self.headers["Authorization"])
                if path == "/load":
                    return self.say(200, "application/json", json.dumps({"load": 1, "sessions": 0}))
                if path == "/monitor":
                    return self.say(401, "text/html", HTML, {"WWW-Authenticate": 'Basic realm="monitor", charset="UTF-8"'})
                if path == "/worker.js":
                    return self.say(200, "text/javascript", "onfetch = event => event.respondWith(new Response('hostile'))", {"Service-Worker-Allowed": "/"})
                kind, body = {"/page.svg": ("image/svg+xml", SVG), "/page.xml": ("application/xhtml+xml", XHTML),
                              "/parts": ("multipart/x-mixed-replace; boundary=b", PARTS)}.get(path, ("text/html", HTML))
                return self.say(404 if path == "/missing" else 200, kind, body)

            def say(self, status, kind, body, headers=()):
                with contextlib.suppress(ConnectionError):
                    self.send_response(status)
                    for name, value in {"Content-Type": kind, "Content-Length": str(len(body)), **HostileMachine.LAX, **dict(headers)}.items():
                        self.send_header(name, value)
                    self.end_headers()
                    self.wfile.write(body.encode())

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.port = self.server.server_port


def entry(port, session, **more):
    return {"address": f"localhost:{session}/{port}", "internal": f"127.0.0.1:{port}", **more}


class Site(unittest.TestCase):
    def start_session(self, *machines, **settings):
        self.port = free_port()
        self.session = self.enterContext(SessionServer([entry(machine.port, self.port, **more) for machine, more in machines], port=self.port, **settings))
        self.url = f"http://localhost:{self.port}"
        wait_until(lambda: self.session.get("/") == "1", self.session.log)

    def log_in(self, browser, path=""):
        if BROWSER != "chromium":
            self.skipTest("Firefox asks a question before it logs in by an address")
        browser.get(f"http://operator:{PASSWORD}@localhost:{self.port}{path}/monitor")
        wait_until(lambda: browser.find_elements("tag name", "main"), lambda: f"no monitor: {browser.page_source[:500]}")


class Hostile(Site):
    def setUp(self):
        self.hostile = self.enterContext(HostileMachine())

    def visit(self, browser, path):
        browser.get(f"{self.url}/{self.hostile.port}{path}")
        wait_until(lambda: browser.execute_script("return typeof window.attack") == "function", lambda: f"no page at {path}: {browser.page_source[:500]}")
        return browser.execute_async_script("window.attack().then(arguments[0])")

    def test_its_pages_reach_nothing_of_the_site(self):
        asks = BROWSER == "chromium"  # Firefox would ask a person for the password
        self.start_session((self.hostile, {}), **({"monitorPassword": PASSWORD} if asks else {}))
        with open_browser(1000, 700, whole=True) as browser:
            if asks:
                self.log_in(browser)
            browser.get(f"{self.url}/viewer/")
            browser.execute_script("sessionStorage.setItem('ticket', 'secret'); localStorage.setItem('key', 'secret')")
            found = self.visit(browser, "/evil")
            self.assertEqual(found["origin"], "null")
            for thing in ("session", "local", "cookie", "monitor"):
                self.assertRegex(found[thing], "^failed: ", thing)
            for thing in ("class", "monitorFrame", "watch", "client", "availability"):
                self.assertIn(found[thing], ("closed", "nothing"), thing)
            self.assertRegex(found["worker"], "^failed: ")
            self.assertEqual(found["image"], "asked")
            browser.get(f"{self.url}/viewer/")
            self.assertEqual(browser.execute_script("return sessionStorage.getItem('ticket')"), "secret", "the site keeps what it has")

    def test_no_kind_of_document_has_the_origin_of_the_site(self):
        self.start_session((self.hostile, {}))
        with open_browser(1000, 700, whole=True) as browser:
            for path in ("/", "/missing", "/page.svg", "/page.xml", "/monitor", "/simulation/token/2001/", "/simulation/token/2501/",
                         *(("/parts",) if BROWSER == "firefox" else ())):  # in Chromium only pictures come in parts
                with self.subTest(path=path):
                    self.assertEqual(self.visit(browser, path)["origin"], "null")

    def test_it_gets_no_password(self):
        self.start_session((self.hostile, {}), monitorPassword=PASSWORD)
        with open_browser(1000, 700, whole=True) as browser:
            self.log_in(browser)
            browser.get(f"{self.url}/{self.hostile.port}/monitor")
            wait_until(lambda: "/monitor" in self.hostile.asked, "the machine is asked")
            self.assertEqual(self.hostile.authorizations, [])
            self.visit(browser, "/evil")
            self.assertIn("/monitor?image", self.hostile.asked)
            self.assertEqual(self.hostile.authorizations, [])
            # By the 401 with which the machine has answered the browser did not forget what the site's own monitor asks for.
            browser.get(f"{self.url}/monitor")
            wait_until(lambda: browser.find_elements("tag name", "main"), lambda: f"no monitor: {browser.page_source[:500]}")


class Honest(Site):
    """Its monitor is live, although it has no origin."""

    def start_machine(self, **settings):
        self.simulation = self.enterContext(SimulationServer(**LOCAL, gateway=True, **settings))
        self.path = f"/{self.simulation.port}"

    def connection(self, browser):
        return browser.execute_script("return document.getElementById('connection')?.innerText ?? ''")

    def wait_until_live(self, browser, state="Live"):
        wait_until(lambda: self.connection(browser) == state, lambda: f"it is not live: {self.connection(browser)}: {browser.page_source[:1000]}")
        self.assertEqual(browser.execute_script("return self.origin"), "null")

    def points(self, browser):
        return browser.execute_script("return document.querySelector('#history .line')?.getAttribute('d').split(/[ML]/).length ?? 0")

    def test_the_monitor_is_live_and_comes_back_with_the_machine(self):
        self.start_machine()
        self.start_session((self.simulation, {}))
        with open_browser(1000, 700, whole=True) as browser:
            browser.get(f"{self.url}{self.path}/monitor")
            self.wait_until_live(browser)
            before = self.points(browser)
            wait_until(lambda: self.points(browser) > before, "the charts stand still")
            self.simulation.stop()
            wait_until(lambda: "lost" in self.connection(browser), "nobody notices")
            self.simulation.start()  # it has other keys now
            self.wait_until_live(browser)

    def test_where_no_websocket_gets_through_the_page_asks(self):
        self.start_machine()
        self.start_session((self.simulation, {}))
        with open_browser(1000, 700, whole=True) as browser:
            run_first(browser, "window.WebSocket = class { constructor() { setTimeout(() => this.onclose(), 0); } close() {} };")
            browser.get(f"{self.url}{self.path}/monitor")
            self.wait_until_live(browser, "Every 5 seconds")

    def test_the_password_of_a_trusted_machine_is_passed_on(self):
        self.start_machine(monitorPassword=PASSWORD)
        self.start_session((self.simulation, {"trusted": True}))
        with open_browser(1000, 700, whole=True) as browser:
            self.log_in(browser, self.path)
            self.wait_until_live(browser)

    def test_the_monitor_of_another_machine_with_a_password_says_what_to_do(self):
        self.start_machine(monitorPassword=PASSWORD)
        self.start_session((self.simulation, {}))
        with open_browser(1000, 700, whole=True) as browser:
            browser.get(f"{self.url}{self.path}/monitor")
            self.assertIn('"trusted": true', browser.find_element("tag name", "body").text)

    def test_so_is_that_of_a_machine_that_was_found(self):
        self.start_machine()
        names = self.enterContext(NameServer({"sim": ["127.0.0.1"]}))
        self.session = self.enterContext(SessionServer([{"address": f"dns:sim.test:{self.simulation.port}", "internal": "http"}],
                                                       nameServers=[names.address], discoverLoopback=True))
        wait_until(lambda: self.session.get("/") == "1", self.session.log)
        with open_browser(1000, 700, whole=True) as browser:
            browser.get(f"{self.session.url}/monitor")
            wait_until(lambda: "/machine/" in (browser.find_element("css selector", "#servers a").get_attribute("href") or ""), "no link")
            browser.find_element("css selector", "#servers a").click()
            self.wait_until_live(browser)


if __name__ == "__main__":
    main()
