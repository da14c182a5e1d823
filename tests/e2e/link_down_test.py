#!/usr/bin/python3
"""The viewer page while its network is down: the real servers, the demo simulator, a real browser, and a cable that is pulled out.

    link_down_test.py [SECONDS...]    10 by default: the page returns. So it does after 40; after 90 the server has given it up

The page reaches the servers through a relay at the other end of the cable, as through an access point: pulling the cable out at that end cuts
nothing, packets are lost. Exit code 77: there can be no network of our own, or there is no browser.
"""

import os
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import own_network  # noqa: E402

SECONDS = [int(argument) for argument in sys.argv[1:]] or [10]
if __name__ == "__main__":
    own_network.enter()
sys.argv[1:] = []

from support.access_point import FAR, AccessPoint  # noqa: E402
from support.browser import open_browser  # noqa: E402
from support.browser_client import LOCAL, WORLD  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402


class LinkDown(unittest.TestCase):
    def test_the_page_tells_and_returns_or_says_that_the_simulation_has_ended(self):
        port = free_port()
        simulation = self.enterContext(SimulationServer(**{**LOCAL, "server": FAR, "gateway": True}))
        session = self.enterContext(SessionServer([f"{FAR}:{simulation.port}"], port, server=FAR))
        cable = self.enterContext(AccessPoint(simulation.port, session.port))
        browser = self.enterContext(open_browser(1280, 800, whole=True))
        for seconds in SECONDS:
            with self.subTest(seconds=seconds):
                self.check(seconds, simulation, session, cable, browser)

    def check(self, seconds, simulation, session, cable, browser):
        def state():
            return browser.execute_script("return document.body.dataset.state")

        def status():
            return browser.execute_script("return document.getElementById('status').textContent")

        def simulated():
            return float(browser.execute_script("return document.body.dataset.time"))

        wait_until(lambda: session.get("/") == "1", session.log)
        browser.get(f"http://{FAR}:{session.port}/viewer/?url={WORLD}")
        wait_until(lambda: browser.find_element("id", "connect-to").get_property("value"), "the world is not in the form")
        browser.find_element("id", "start").click()
        wait_until(lambda: state() in ("running", "failed"), simulation.log)
        self.assertEqual(state(), "running", status())
        wait_until(lambda: simulated() > 0, "it stands still")
        simulators = simulation.simulators()
        pulled = time.monotonic()
        cable.pull()
        wait_until(lambda: state() == "lost", lambda: f"{state()}: {status()}")
        noticed = time.monotonic() - pulled
        wait_until(lambda: state() != "lost" or time.monotonic() - pulled >= seconds, "time stands still", seconds + 10)
        self.assertEqual(state(), "lost", status())
        self.assertIn("What you see is out of date", status())
        plugged = time.monotonic()
        cable.plug()
        wait_until(lambda: state() != "lost", lambda: f"{state()}: {status()}\n{simulation.log()}")
        print(f"down for {seconds} s: noticed after {noticed:.1f} s, {state()} {time.monotonic() - plugged:.1f} s after the link was up", flush=True)
        if seconds < 60:  # pingTimeout
            self.assertEqual(state(), "running", status())
            before = simulated()
            wait_until(lambda: simulated() > before, lambda: f"it stands still at {before}: {state()}: {status()}", 30)
            self.assertEqual(simulation.simulators(), simulators)  # the same one
            browser.find_element("id", "quit").click()
        elif state() != "running":  # the server has waited for `pingTimeout` and `reconnectGrace`
            self.assertIn("This simulation has ended", status())
        else:
            browser.find_element("id", "quit").click()
        simulation.wait_until_clean()


if __name__ == "__main__":
    main()
