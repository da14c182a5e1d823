#!/usr/bin/python3
"""Our pages in `<iframe sandbox="allow-scripts">` of another site, where they have no origin: they work where `allowedOrigins` has "null"."""

import contextlib
import http.server
import os
import sys
import threading
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser import open_browser  # noqa: E402
from support.browser_client import LOCAL, WORLD  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, wait_until  # noqa: E402


@contextlib.contextmanager
def site(frame):
    """A site on another port, whose only page shows `frame`."""
    class Page(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            body = f'<!doctype html><title>site</title><iframe sandbox="allow-scripts" width="900" height="700" src="{frame}"></iframe>'.encode()
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            pass
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Page)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://localhost:{server.server_port}/"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


class SandboxedFrame(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.simulation = cls.enterClassContext(SimulationServer(allowedOrigins=["null"], **LOCAL))
        cls.session = cls.enterClassContext(SessionServer([cls.simulation.address], allowedOrigins=["null"], frameAncestors=["*"],
                                                        teacherPassword="sesame-open"))
        wait_until(lambda: cls.session.get("/") == "1", "no machine is up")

    def framed(self, path):
        address = self.enterContext(site(f"{self.session.url}{path}"))
        browser = self.enterContext(open_browser(1000, 800))
        browser.get(address)
        browser.switch_to.frame(browser.find_element("css selector", "iframe"))
        return browser

    def test_the_viewer_runs_a_simulation(self):
        browser = self.framed(f"/viewer/?url={WORLD}")
        run = browser.execute_script
        state = lambda name: run(f"return document.body?.dataset.{name}")  # noqa: E731
        wait_until(lambda: state("availability") == "available", lambda: f"it is {state('availability')}: {browser.get_log('browser')}", patience=PATIENCE)
        self.assertEqual(run("return self.origin"), "null")
        run("document.getElementById('start').click()")
        wait_until(lambda: state("state") == "running", lambda: run("return document.getElementById('status').textContent"), patience=PATIENCE)
        wait_until(lambda: run("return document.getElementById('picture').dataset.live !== undefined"), "no picture")

    def test_the_page_of_a_class_asks_for_a_code(self):
        browser = self.framed("/class/")
        wait_until(lambda: "I teach" in browser.execute_script("return document.body.innerText"), lambda: f"{browser.get_log('browser')}")


if __name__ == "__main__":
    main()
