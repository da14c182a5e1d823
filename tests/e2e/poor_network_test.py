#!/usr/bin/python3
"""The viewer page where packets are late or lost, and on a laptop that sleeps: the real servers, the demo simulator, a real browser.

The page reaches the servers through a relay at the other end of a long way (support/access_point.py), on which the packets of its TCP
connections are delayed and dropped. Exit code 77: there can be no network of our own, or there is no browser.
"""

import contextlib
import os
import signal
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import own_network  # noqa: E402

if __name__ == "__main__":
    own_network.enter()

from support.access_point import FAR, PoorNetwork  # noqa: E402
from support.browser import open_browser  # noqa: E402
from support.browser_client import LOCAL, WORLD  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import SessionServer, SimulationServer, descendants, main, wait_until  # noqa: E402

LATE = {"delay": 0.1}  # 200 ms until an answer is there
LOSSY = {"lose_every": 100}
PHONE = {**LATE, **LOSSY, "rate": 2e6 / 8}
NOTHING = {"lose_every": 1}
WATCHED_MS = 1000  # simulated time in which the page has to believe that all is well
ASLEEP_S = 3  # longer than silence is believed in

# Each state that the page was in, however briefly.
RECORD = """
    window.states = [document.body.dataset.state];
    new MutationObserver(() => window.states.push(document.body.dataset.state)).observe(document.body, {attributeFilter: ["data-state"]});
"""


class PoorNetworks(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.simulation = cls.enterClassContext(SimulationServer(**{**LOCAL, "server": FAR, "gateway": True}))
        cls.session = cls.enterClassContext(SessionServer([f"{FAR}:{cls.simulation.port}"], free_port(), server=FAR))
        cls.network = cls.enterClassContext(PoorNetwork(cls.simulation.port, cls.session.port))
        cls.browser = cls.enterClassContext(open_browser(1280, 800, whole=True))

    def setUp(self):
        self.addCleanup(self.network.set)

    def state(self):
        return self.browser.execute_script("return document.body.dataset.state")

    def status(self):
        return self.browser.execute_script("return document.getElementById('status').textContent")

    def simulated(self):
        return float(self.browser.execute_script("return document.body.dataset.time ?? 0"))

    def wait_state(self, *states):
        wait_until(lambda: self.state() in states, lambda: f"{self.state()} and not {states}: {self.status()}\n{self.simulation.log()}")

    def start(self):
        wait_until(lambda: self.session.get("/") == "1", self.session.log)
        self.browser.get(f"http://{FAR}:{self.session.port}/viewer/?url={WORLD}")
        wait_until(lambda: self.browser.find_element("id", "connect-to").get_property("value"), "the world is not in the form")
        self.browser.find_element("id", "start").click()
        self.wait_state("running", "failed")
        self.assertEqual(self.state(), "running", self.status())
        self.addCleanup(self.simulation.wait_until_clean)
        self.addCleanup(self.browser.get, "about:blank")
        self.addCleanup(self.browser.execute_script, "document.getElementById('quit').click()")
        self.simulators = self.simulation.simulators()

    def watch(self):
        """The simulation goes on before the page's eyes, and no false alarm is raised."""
        self.wait_state("running")
        self.browser.execute_script(RECORD)
        before = self.simulated()
        wait_until(lambda: self.simulated() > before + WATCHED_MS, lambda: f"it stands still: {self.state()}: {self.status()}", 30)
        self.assertEqual(self.browser.execute_script("return window.states"), ["running"], self.status())
        self.assertTrue(self.browser.find_elements("css selector", "#picture[data-live]"), "there is no picture")

    def settle(self):
        """The simulation goes on before the page's eyes. Before that the page may say that nothing arrives, which is true: TCP waits longer
        and longer before it sends once more what was lost meanwhile."""

        def went_on():
            self.wait_state("running")
            self.browser.execute_script(RECORD)
            before = self.simulated()
            alarm = "return window.states.length > 1"
            wait_until(lambda: self.browser.execute_script(alarm) or self.simulated() > before + WATCHED_MS, "it stands still without a word", 30)
            return not self.browser.execute_script(alarm)

        wait_until(went_on, lambda: f"it does not settle: {self.state()}: {self.status()}", 60)
        self.assertTrue(self.browser.find_elements("css selector", "#picture[data-live]"), "there is no picture")

    def control(self):
        for button, state in (("pause", "paused"), ("play", "running")):
            pressed = time.monotonic()
            self.browser.find_element("id", button).click()
            self.wait_state(state)
            print(f"{button}: answered after {time.monotonic() - pressed:.2f} s", flush=True)

    def reload(self):
        self.browser.refresh()
        self.wait_state("running")
        self.same_simulation()

    def lose_and_return(self, network):
        self.network.set(**NOTHING)
        lost = time.monotonic()
        self.wait_state("lost")
        print(f"nothing arrives: said after {time.monotonic() - lost:.1f} s", flush=True)
        self.assertIn("What you see is out of date", self.status())
        self.network.set(**network)
        found = time.monotonic()
        self.wait_state("running")
        print(f"running {time.monotonic() - found:.1f} s after packets arrived again", flush=True)
        self.same_simulation()

    def same_simulation(self):
        before = self.simulated()
        wait_until(lambda: self.simulated() > before, lambda: f"it stands still at {before}: {self.state()}: {self.status()}", 30)
        self.assertEqual(self.simulation.simulators(), self.simulators)

    def test_a_page_keeps_its_promises_where_packets_are_late_or_lost(self):
        self.network.set(**LATE)
        self.start()
        for name, network in (("200 ms", LATE), ("1 % lost", LOSSY), ("200 ms, 1 % lost, 2 Mbit/s", PHONE)):
            with self.subTest(name):
                print(name, flush=True)
                self.network.set(**network)
                self.watch()
                self.control()
        self.reload()
        self.lose_and_return(PHONE)

    def test_a_page_finds_its_simulation_again_when_the_laptop_has_slept(self):
        self.start()
        for name, sleeping in (("frozen by the browser", self.frozen), ("stopped, and off the network", self.off)):
            with self.subTest(name):
                with sleeping():
                    slept = time.monotonic()
                    wait_until(lambda slept=slept: time.monotonic() - slept >= ASLEEP_S, "time stands still")
                woken = time.monotonic()
                self.settle()
                self.assertEqual(self.simulation.simulators(), self.simulators)
                print(f"{name}: has gone on for a second {time.monotonic() - woken:.1f} s after waking up", flush=True)

    @contextlib.contextmanager
    def frozen(self):  # Chromium closes the connections of such a page when it goes on
        self.browser.execute_cdp_cmd("Page.setWebLifecycleState", {"state": "frozen"})
        yield
        self.browser.execute_cdp_cmd("Page.setWebLifecycleState", {"state": "active"})
        page = self.browser.current_window_handle  # which the browser took for hidden, and still does
        self.browser.switch_to.new_window("tab")
        self.browser.close()
        self.browser.switch_to.window(page)

    @contextlib.contextmanager
    def off(self):
        processes = descendants(self.browser.service.process.pid)
        for process in processes:
            os.kill(process, signal.SIGSTOP)
        try:
            self.network.set(**NOTHING)
            yield
            self.network.set()
        finally:
            for process in processes:
                os.kill(process, signal.SIGCONT)


if __name__ == "__main__":
    main()
