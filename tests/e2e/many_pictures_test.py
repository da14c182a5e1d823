#!/usr/bin/python3
"""Thirty pictures on one page, all behind the one port of a site: a browser opens six connections by HTTP to it, so pictures come by WebSockets.

Protocol section 13.12."""

import asyncio
import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser import open_browser  # noqa: E402
from support.browser_client import LOCAL, WORLD, Browser  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402

try:
    from support.mailbox import Certificate
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-aiosmtpd)") or 77)

PICTURES = 30

WATCH = """
const [address, count, done] = arguments;
import('/view/webots_view.js').then(({ webots }) => {
  document.body.replaceChildren();
  for (let i = 0; i < count; ++i) {
    const place = document.body.appendChild(document.createElement('div'));
    place.style.cssText = 'width: 160px; height: 120px; float: left';
    const view = new webots.View(place);
    view.broadcast = true;
    view.open(address, 'mjpeg');
  }
  done();
}, (error) => done(String(error)));
"""

# What each of them shows now; empty where there is no picture yet.
SHOWN = """
const inside = (root) => [...root.querySelectorAll('*')].flatMap((each) => [each, ...(each.shadowRoot ? inside(each.shadowRoot) : [])]);
return inside(document).filter((each) => each.localName === 'canvas').map((each) => (each.width > 1 ? each.toDataURL() : ''));
"""


class OverHttp(unittest.TestCase):
    scheme = "http"

    def setUp(self):
        port = free_port()
        self.site = f"localhost:{port}"
        own = {"ssl": True, "portRewrite": True} if self.scheme == "https" else {"portRewrite": True}
        self.simulation = self.enterContext(SimulationServer(**LOCAL, gateway=True, listenAddress="127.0.0.1", reconnectGrace=0,
                                                             server=self.site, **own))
        machine = {"address": f"{self.site}/{self.simulation.port}", "internal": f"127.0.0.1:{self.simulation.port}"}
        self.session = self.enterContext(SessionServer([machine], port=port, viewerUrl=WORLD, **self.certificate()))
        self.browser = self.enterContext(open_browser(1280, 800, trusting=True))

    def certificate(self):
        return {}

    def start(self):
        """Starts a simulation in the viewer of this page's neighbour; its address."""
        self.browser.get(f"{self.scheme}://{self.site}/viewer/")
        body = self.browser.find_element("tag name", "body")
        wait_until(lambda: body.get_attribute("data-availability") == "available", lambda: self.session.log())
        self.browser.find_element("id", "start").click()
        wait_until(lambda: body.get_attribute("data-state") in ("running", "failed"), lambda: self.simulation.log())
        source = wait_until(lambda: self.browser.find_element("id", "picture").get_attribute("data-source"), "no picture came")
        return source.replace("http", "ws", 1).removesuffix("/mjpeg")

    def watch(self, address, count):
        """A page that shows so many pictures of the simulation."""
        self.browser.get(f"{self.scheme}://{self.site}/viewer/")
        self.assertIsNone(self.browser.execute_async_script(WATCH, address, count))
        wait_until(lambda: len([each for each in self.shown() if each]) == count,
                   lambda: f"{len([each for each in self.shown() if each])} pictures\n{self.simulation.log()}")

    def shown(self):
        return self.browser.execute_script(SHOWN)

    def test_a_page_fetches_no_pictures_that_nobody_has_asked_for(self):
        """The simulator would end, as Webots does, and nothing would be shown."""
        asyncio.run(self.watch_what_nobody_has_asked_for())

    async def watch_what_nobody_has_asked_for(self):
        async with Browser(self.simulation) as starter:
            await starter.start()  # without a size, so the server does not ask, either
            address = (await starter.hear("webots:")).removeprefix("webots:")
            await asyncio.to_thread(self.watch, address, 1)
        self.browser.get("about:blank")
        self.simulation.wait_until_clean()

    def test_thirty_pictures_move_on_one_page(self):
        address = self.start()
        first = self.browser.current_window_handle
        self.browser.switch_to.new_window("tab")
        self.watch(address, PICTURES)
        before = self.shown()
        moving = [False] * PICTURES

        def all_move():
            for index, now in enumerate(self.shown()):
                moving[index] = moving[index] or now != before[index]
            return all(moving)

        wait_until(all_move, lambda: f"{moving.count(False)} of {PICTURES} pictures stand still")
        answered = self.browser.execute_async_script("const done = arguments[0]; fetch('/session').then((answer) => done(answer.status));")
        self.assertEqual(answered, 200, "six connections are free for everything else")
        self.browser.close()
        self.browser.switch_to.window(first)
        self.browser.get("about:blank")
        self.simulation.wait_until_clean()


class OverTls(OverHttp):
    scheme = "https"

    def certificate(self):
        folder = self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_many_pictures_"))
        certificate = Certificate(folder)
        return {"ssl": True, "sslCertificate": certificate.certificate, "sslKey": certificate.key}


if __name__ == "__main__":
    main()
