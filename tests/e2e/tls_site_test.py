#!/usr/bin/python3
"""A real browser at a site behind one TLS port: session server's gateway, simulation server's gateway, demo simulator. The machine is one of
the configuration, or was found by its name.

Protocol sections 13.12 and 13.13."""

import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser import open_browser  # noqa: E402
from support.browser_client import LOCAL, WORLD  # noqa: E402
from support.name_server import NameServer  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402

try:
    from support.mailbox import Certificate
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-aiosmtpd)") or 77)

# What a page of others does: a place, a simulation, its scene. Ends with the messages, or with what went wrong.
SCENE = """
const [world, done] = arguments;
const said = [];
fetch('/session').then(answer => answer.text()).then(place => {
  said.push(place);
  const client = new WebSocket(place + '/client');
  client.onerror = () => done(['no connection to ' + place]);
  client.onopen = () => client.send(JSON.stringify({start: {url: world, mode: 'w3d'}}));
  client.onmessage = event => {
    if (event.data.startsWith('loading: Error'))
      done([event.data]);
    if (!event.data.startsWith('webots:'))
      return;
    const address = event.data.slice('webots:'.length);
    said.push(address);
    const viewer = new WebSocket(address + '/');
    viewer.onerror = () => done(['no connection to ' + address]);
    viewer.onopen = () => viewer.send('w3d');
    viewer.onmessage = event => {
      if (event.data.startsWith('scene load completed'))
        fetch(address.replace('ws', 'http') + '/worlds/arena.wbt').then(answer => answer.text()).then(text => {
          said.push(text.split(' ')[0]);
          client.close();
          done(said);
        }, error => done([String(error)]));
    };
  };
}, error => done([String(error)]));
"""


def picture(browser):
    """The pixels of the stream as the page shows them now; empty before the first frame."""
    image = browser.find_element("id", "picture")
    return image.screenshot_as_png if image.get_attribute("data-live") is not None else b""


class OnePort(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_tls_site_"))
        self.port = free_port()
        self.site = f"localhost:{self.port}"
        self.start_servers()
        self.browser = self.enterContext(open_browser(1280, 800, trusting=True))

    def start_servers(self):
        self.start_machine(server=self.site, ssl=True, portRewrite=True)
        self.start_session({"address": f"{self.site}/{self.simulation.port}", "internal": f"127.0.0.1:{self.simulation.port}"})
        self.path = f"/{self.simulation.port}"

    def start_machine(self, **settings):
        self.simulation = self.enterContext(SimulationServer(**LOCAL, gateway=True, listenAddress="127.0.0.1", reconnectGrace=0, **settings))

    def start_session(self, machine, **settings):
        certificate = Certificate(self.folder)
        self.session = self.enterContext(SessionServer([machine], port=self.port, ssl=True, sslCertificate=certificate.certificate,
                                                       sslKey=certificate.key, viewerUrl=WORLD, **settings))

    def open_viewer(self):
        """Once a machine can be had: one that is found by its name is polled first."""
        self.browser.get(f"https://{self.site}/viewer/")
        body = self.browser.find_element("tag name", "body")
        wait_until(lambda: body.get_attribute("data-availability") == "available", lambda: self.session.log())
        return body

    def test_the_viewer_shows_moving_pictures(self):
        body = self.open_viewer()
        self.browser.find_element("id", "start").click()
        wait_until(lambda: body.get_attribute("data-state") in ("running", "failed"), lambda: self.simulation.log())
        self.assertEqual(body.get_attribute("data-state"), "running", self.browser.find_element("id", "status").text)
        first = wait_until(lambda: picture(self.browser), "no picture came")
        wait_until(lambda: picture(self.browser) != first, "the picture stands still")
        source = self.browser.find_element("id", "picture").get_attribute("data-source")
        self.assertRegex(source, rf"^(blob:)?https://{self.site}/")
        loaded = self.browser.execute_script("return performance.getEntriesByType('resource').map(each => each.name)")
        self.assertTrue(loaded)
        self.assertEqual([url for url in loaded if not url.startswith((f"https://{self.site}/", "blob:", "data:"))], [], "all by TLS, at one port")
        self.browser.get("about:blank")
        self.simulation.wait_until_clean()

    def test_a_page_gets_a_scene(self):
        self.open_viewer()
        said = self.browser.execute_async_script(SCENE, WORLD)
        self.assertEqual(len(said), 3, said)
        self.assertRegex(said[0], rf"^wss://{self.site}{self.path}$")
        self.assertRegex(said[1], rf"^{said[0]}/simulation/[a-z]{{28}}/\d+$")
        self.assertEqual(said[2], "#VRML_SIM")
        self.simulation.wait_until_clean()


class FoundMachine(OnePort):
    """It knows nothing of the site but whom to trust."""

    def start_servers(self):
        self.start_machine(trustedProxies=["127.0.0.1"])
        names = self.enterContext(NameServer({"sim": ["127.0.0.1"]}))
        self.start_session({"address": f"dns:sim.test:{self.simulation.port}", "internal": "http"}, nameServers=[names.address],
                           discoverLoopback=True)
        self.path = "/machine/[a-p]{24}"


if __name__ == "__main__":
    main()
