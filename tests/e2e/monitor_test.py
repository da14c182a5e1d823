#!/usr/bin/python3
"""The monitor pages of both servers in a real browser, live. Protocol sections 2.4 and 9.3."""

import contextlib
import hashlib
import http.server
import json
import os
import shutil
import sys
import tempfile
import threading
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser import (accessibility_findings, console_messages, disable_scripts, open_browser, prefer_dark, resize, run_first,  # noqa
                             screenshot)  # noqa: E402
from support.forwarded_socket import forwarded  # noqa: E402
from support.projects import EXAMPLES  # noqa: E402
from support.served import Served  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402

try:
    from selenium.webdriver.common.keys import Keys
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-selenium)") or 77)

SHOTS = os.environ.get("SCREENSHOTS")
LOCAL = {"forges": [{"url": "local:", "directory": os.path.dirname(os.path.abspath(EXAMPLES))}],
         "allowedRepositories": ["local:/demo_projects"]}


class FakeSimulationServer(Served):
    """Answers GET /load with whatever the test says; None: with an error."""

    def __init__(self, load):
        fake = self
        fake.load = load

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self):
                body = json.dumps(fake.load).encode()
                with contextlib.suppress(ConnectionError):  # the session server may end meanwhile
                    self.send_response(200 if fake.load is not None else 500)
                    self.send_header("Content-Length", str(len(body)))
                    self.end_headers()
                    self.wfile.write(body)

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.address = f"127.0.0.1:{self.server.server_port}"


def shot(browser, name):
    """Where pictures are wanted: of the whole page, wide and narrow, light and dark."""
    if not SHOTS:
        return
    for width in (1280, 360):
        resize(browser, width, 900)
        height = browser.execute_script("return document.documentElement.scrollHeight")
        resize(browser, width, max(700, min(height, 3000)))
        for scheme in ("light", "dark"):
            prefer_dark(browser, scheme == "dark")
            browser.execute_async_script("setTimeout(arguments[0], 1500)")
            screenshot(browser, os.path.join(SHOTS, f"{name}_{width}_{scheme}.png"))
    resize(browser, 1280, 900)


def overflow(browser):
    """How far the page is wider than the window, in pixels."""
    return browser.execute_script("return document.documentElement.scrollWidth - document.documentElement.clientWidth")


class SessionMonitor(unittest.TestCase):
    def cell(self, browser, row, label):
        """Its words, or those of the bar in it."""
        return browser.execute_script(
            "const cell = document.querySelector(`#servers tbody tr:nth-child(${arguments[0]}) td[data-label='${arguments[1]}']`);"
            "return (cell?.querySelector('b, a') ?? cell)?.textContent ?? null", row, label)

    def reason(self, browser, row):
        return browser.execute_script("return document.querySelector(`#servers tbody tr:nth-child(${arguments[0]}) .reason`)?.textContent ?? null", row)

    def open(self, browser, session):
        browser.get(session.url + "/monitor")
        browser.execute_script("window.neverReloaded = true")
        wait_until(lambda: browser.execute_script("return document.getElementById('connection')?.innerText") == "Live",
                   lambda: f"the page does not come alive:\n{browser.page_source[:3000]}")

    def test_loads_change_on_the_page_without_reload(self):
        with FakeSimulationServer({"load": 12.5, "sessions": 3}) as first, FakeSimulationServer(20) as second, \
                SessionServer([first.address, second.address], loadThreshold=95) as session, open_browser(1280, 900) as browser:
            self.open(browser, session)
            wait_until(lambda: self.cell(browser, 1, "load") == "13%", "the first load is missing")
            wait_until(lambda: self.cell(browser, 2, "load") == "20%", "the second load is missing")
            self.assertEqual(self.cell(browser, 1, "seats"), "3")
            self.assertEqual(self.cell(browser, 2, "seats"), "\u2013")
            self.assertEqual(browser.find_elements("css selector", ".high"), [])

            drawn = lambda line: browser.execute_script("return document.querySelectorAll('#history .line')[arguments[0]]?.getAttribute('d') ?? ''", line)
            wait_until(lambda: drawn(0), "the chart does not show the first load")
            first.load = {"load": 96.5, "sessions": 8}
            wait_until(lambda: self.cell(browser, 1, "load") == "97%", "the load does not change")
            full = browser.find_element("css selector", "#servers tbody tr:first-child .high b")
            self.assertIn(full.value_of_css_property("color"), ("rgba(179, 38, 30, 1)", "rgb(179, 38, 30)"))  # as Chromium and Firefox write it
            self.assertEqual(self.cell(browser, 1, "seats"), "8")
            legend = lambda: [each.text for each in browser.find_elements("css selector", "#history .legend li")]
            wait_until(lambda: legend() == [f"{first.address} 97%", f"{second.address} 20%"], legend)

            second.load = None
            wait_until(lambda: self.cell(browser, 2, "load") == "\u2013", "a server that fails is not told")
            self.assertEqual(self.cell(browser, 2, "state"), "Does not answer")
            self.assertIn("500", self.reason(browser, 2))
            first.load = {"load": 1, "sessions": 0}
            wait_until(lambda: not browser.find_elements("css selector", ".high"), "it stays red")
            shot(browser, "session_2")
            self.assertFalse(accessibility_findings(browser))
            self.assertTrue(browser.execute_script("return window.neverReloaded"))
            self.assertEqual(console_messages(browser, "SEVERE"), [])

    def test_seats_are_shown_and_full_is_who_has_none_left_whatever_the_load_is(self):
        counts = {"starting": 0, "arrivals": 4, "failed": 0, "departures": 0}
        with FakeSimulationServer({"load": 12.5, "sessions": 4, "capacity": 4, **counts}) as fake, \
                SessionServer([fake.address], loadThreshold=95) as session, open_browser(1280, 900) as browser:
            self.open(browser, session)
            for report, seats, free, state, sentence in (
                    ({"load": 12.5, "sessions": 4, "capacity": 4}, "4 of 4", "0 of 4 free", "Full", "Every seat is taken."),
                    ({"load": 96, "sessions": 3, "capacity": 4}, "3 of 4", "1 of 4 free", "Busy", "The machines are busy: a start may have to wait."),
                    ({"load": 12.5, "sessions": 3, "capacity": 4, "draining": True}, "3 of 4", "0 of 4 free", "Drained",
                     "No machine takes new simulations at the moment."),
                    ({"load": 12.5, "sessions": 3, "capacity": 4}, "3 of 4", "1 of 4 free", "Free", "A machine is free."),
                    (None, "\u2013", "0 of 1 machines free", "Does not answer", "No machine is running.")):
                fake.load = report and {**report, **counts}
                wait_until(lambda: browser.find_element("id", "site").text == sentence, lambda: browser.find_element("id", "site").text)
                wait_until(lambda: [self.cell(browser, 1, name) for name in ("seats", "state")] == [seats, state], (seats, state))
                self.assertEqual(browser.find_element("id", "free").text, free)
            self.assertFalse(accessibility_findings(browser))

    def test_sessions_placed_by_this_server_are_counted(self):
        with FakeSimulationServer({"load": 1, "sessions": 0}) as fake, SessionServer([fake.address]) as session, \
                open_browser(1280, 600) as browser:
            wait_until(lambda: session.get("/").strip() == "1", "no room")
            self.open(browser, session)
            for _ in range(3):
                self.assertEqual(session.get("/session"), f"ws://{fake.address}")
            wait_until(lambda: self.cell(browser, 1, "placed") == "3", "placements are not shown")

    def test_why_somebody_was_sent_there_is_said_to_all_where_the_configuration_says_so(self):
        with FakeSimulationServer({"load": 7, "sessions": 2}) as fake, SessionServer([fake.address], decisionsForAll=True) as session, \
                open_browser(1280, 600) as browser:
            wait_until(lambda: session.get("/").strip() == "1", "no room")
            session.get("/session")
            self.open(browser, session)
            said = lambda: [each.text for each in browser.find_elements("css selector", "#decisions li")]
            wait_until(lambda: any(f"Sent to {fake.address}, which had a load of 7% and 2 simulations." in each for each in said()), said)

    def test_the_page_comes_back_when_the_server_does(self):
        with FakeSimulationServer(5) as fake, SessionServer([fake.address]) as session, open_browser(800, 600) as browser:
            self.open(browser, session)
            session.stop()
            wait_until(lambda: "lost" in browser.find_element("id", "connection").text, "nobody notices")
            session.start()
            wait_until(lambda: browser.find_element("id", "connection").text == "Live", "it stays lost")
            fake.load = 55
            wait_until(lambda: self.cell(browser, 1, "load") == "55%", "it is not live again")
            self.assertTrue(browser.execute_script("return window.neverReloaded"))

    def test_where_no_websocket_gets_through_the_page_asks(self):
        with FakeSimulationServer(5) as fake, SessionServer([fake.address]) as session, open_browser(800, 600) as browser:
            run_first(browser, """
                window.tried = [];
                window.WebSocket = class {
                    constructor(url) { tried.push(new URL(url).pathname); setTimeout(() => this.onclose(), 0); }
                    close() {}
                };""")
            browser.get(session.url + "/monitor")
            wait_until(lambda: browser.find_element("id", "connection").text == "Every 5 seconds", "it does not ask")
            fake.load = 60
            wait_until(lambda: self.cell(browser, 1, "load") == "60%", "it asks only once")
            # The second one is where the rewrite rules of the documentation lead to.
            self.assertEqual(browser.execute_script("return tried")[:2], ["/monitor", f"/{session.port}/monitor"])

    def test_many_servers_stay_readable(self):
        with FakeSimulationServer({"load": 30, "sessions": 2}) as fake:
            # 60 names for one machine: 127.0.0.1 to 127.0.0.60.
            with http.server.ThreadingHTTPServer(("0.0.0.0", 0), fake.server.RequestHandlerClass) as wide:
                wide.daemon_threads = True
                threading.Thread(target=wide.serve_forever, daemon=True).start()
                addresses = [f"127.0.0.{n}:{wide.server_port}" for n in range(1, 61)]
                with SessionServer(addresses) as session, open_browser(1280, 900) as browser:
                    self.open(browser, session)
                    wait_until(lambda: self.cell(browser, 60, "load") == "30%", "the last of many is missing")
                    legend = lambda: [each.text for each in browser.find_elements("css selector", "#history .legend li")]
                    wait_until(lambda: legend() == ["Average 30%", "Highest 30%", "Lowest 30%"], legend)
                    shot(browser, "session_60")
                    resize(browser, 360, 740)
                    self.assertLessEqual(overflow(browser), 0)
                wide.shutdown()

    def test_without_scripts_the_page_says_in_words_what_old_ones_did(self):
        with FakeSimulationServer(42) as fake, SessionServer([fake.address]) as session, open_browser(800, 600) as browser:
            wait_until(lambda: "42.0%" in session.get("/monitor"), "no load")
            disable_scripts(browser)
            browser.get(session.url + "/monitor")
            text = browser.find_element("tag name", "main").text
            self.assertIn("Managing 1 simulation server: average: 42.0%.", text)
            self.assertIn("This page needs JavaScript", text)
            self.assertIn(fake.address, session.get("/monitor"), "programs may look for it")

    def test_nothing_is_fetched_from_elsewhere(self):
        with FakeSimulationServer(1) as fake, SessionServer([fake.address]) as session, open_browser(800, 600) as browser:
            self.open(browser, session)
            fetched = browser.execute_script("return performance.getEntriesByType('resource').map(entry => entry.name)")
            self.assertEqual([name for name in fetched if not name.startswith("data:") and "favicon" not in name], [])

    def test_what_a_server_answers_is_text_on_the_page(self):
        hostile = "<img src=x onerror=window.hacked=1>"
        with FakeSimulationServer(hostile) as fake, SessionServer([fake.address]) as session, open_browser(800, 600) as browser:
            self.open(browser, session)
            wait_until(lambda: "<img src=x" in (self.reason(browser, 1) or ""), "the problem is not told")
            self.assertFalse(browser.execute_script("return window.hacked"))
            self.assertNotIn("<img", session.get("/monitor"))


START = """
    window.told = [];
    const socket = new WebSocket(arguments[0]);
    socket.onopen = () => socket.send(JSON.stringify({start: {url: arguments[1], mode: "mjpeg"}}));
    socket.onmessage = event => told.push(event.data);
    (window.sockets ??= []).push(socket);
"""


class SimulationMonitor(unittest.TestCase):
    def rows(self, browser):
        """Number, world, state, age, processor, memory, processes: the first words of each cell, and the second ones of some."""
        return browser.execute_script("return Array.from(document.querySelectorAll('#simulations tbody tr'),"
                                      " row => Array.from(row.cells, cell => cell.querySelector('b').textContent))")

    def test_simulations_and_figures_are_live(self):
        with SimulationServer(**LOCAL) as simulation, open_browser(1280, 900) as browser:
            browser.get(simulation.url + "/monitor")
            wait_until(lambda: browser.find_element("id", "connection").text == "Live", "the page does not come alive")
            self.assertEqual(self.rows(browser), [])
            self.assertFalse(browser.find_element("id", "simulations").is_displayed())
            for world in ("robots/blob/main/worlds/arena.wbt", "robots/blob/main/worlds/corridor.wbt"):
                browser.execute_script(START, f"ws://{simulation.address}/client", f"local:/demo_projects/{world}")
            wait_until(lambda: [row[2] for row in self.rows(browser)] in (["Paused"] * 2, ["Runs"] * 2), simulation.log)
            wait_until(lambda: all(row[4] and float(row[5].removesuffix(" MB")) > 0.5 for row in self.rows(browser)),
                       lambda: f"their processes are looked at, on another thread, once they have begun: {self.rows(browser)}")
            first, second = self.rows(browser)
            self.assertEqual([first[1], second[1]], ["arena.wbt", "corridor.wbt"])
            hints = browser.execute_script("return Array.from(document.querySelectorAll('#simulations [data-label=processes] .hint'), each => each.textContent)")
            for row, process in zip((first, second), hints):
                self.assertRegex(row[4], r"^\d+(\.\d)?%$")
                self.assertGreaterEqual(int(row[6]), 1)  # processes and threads
                self.assertGreater(int(process.removeprefix("Process ID ")), 1)
            wait_until(lambda: browser.find_element("id", "count").text == "2 simulations", "they are not counted")
            wait_until(lambda: "corridor.wbt" in simulation.get("/monitor"), "the page, which is made once a second, does not show them")

            legend = lambda: browser.execute_script("return Array.from(document.querySelectorAll('#history .legend li'), each => each.innerText.trim())")
            wait_until(lambda: len(legend()) >= 7, legend)
            taken = lambda: sum(int(each.split()[-1]) for each in legend() if each.startswith(("Runs", "Paused")))
            wait_until(lambda: taken() == 2, lambda: f"the simulations are not drawn: {legend()}")
            points = lambda: browser.execute_script("return document.querySelector('#history .line').getAttribute('d').split(/[ML]/).length")
            before = points()
            wait_until(lambda: points() >= before + 2, "the charts stand still")
            shot(browser, "simulation")
            self.assertFalse(accessibility_findings(browser))
            resize(browser, 360, 740)
            self.assertLessEqual(overflow(browser), 0)
            resize(browser, 1280, 900)
            browser.find_element("css selector", "[data-span=day]").click()
            wait_until(lambda: len(browser.find_elements("css selector", "#history .chart")) == 3, "there is no day")

            browser.execute_script("sockets.pop().close()")
            wait_until(lambda: len(self.rows(browser)) == 1, "one that ended stays on the page")
            self.assertEqual(console_messages(browser, "SEVERE"), [])

    def test_an_operators_texts_are_text_on_the_page(self):
        hostile = "<img src=x onerror=window.hacked=1>"
        with SimulationServer(**LOCAL, title=hostile, description=hostile, blockedRepositories=[hostile]) as simulation, \
                open_browser(800, 600) as browser:
            browser.get(simulation.url + "/monitor")
            self.assertEqual(browser.find_element("tag name", "h1").text, hostile)
            wait_until(lambda: browser.find_element("id", "connection").text == "Live", "the page does not come alive")
            self.assertFalse(browser.execute_script("return window.hacked"))


TOKEN = "0123456789abcdef0123456789abcdef"


def token_file(folder):
    """What "operatorTokenFile" names: the token's digest."""
    path = os.path.join(folder, "token")
    with open(path, "w", opener=lambda name, flags: os.open(name, flags, 0o600)) as file:
        file.write("sha256:" + hashlib.sha256(TOKEN.encode()).hexdigest() + "\n")
    return path


class Operator(unittest.TestCase):
    """What the operator does from the pages. One browser, and one set of servers."""

    @classmethod
    def setUpClass(cls):
        cls.resources = contextlib.ExitStack()
        cls.addClassCleanup(cls.resources.close)
        folder = tempfile.mkdtemp(prefix="webots_cloud_token_")
        cls.resources.callback(shutil.rmtree, folder, ignore_errors=True)
        operators = {"operatorTokenFile": token_file(folder)}
        cls.simulation = cls.resources.enter_context(SimulationServer(**LOCAL, **operators, reconnectGrace=0))
        cls.session = cls.resources.enter_context(SessionServer([cls.simulation.address]))
        cls.near = cls.resources.enter_context(FakeSimulationServer({"load": 0, "sessions": 0}))
        cls.far = cls.resources.enter_context(FakeSimulationServer({"load": 900, "sessions": 1}))
        cls.site = cls.resources.enter_context(SessionServer([cls.near.address, cls.far.address], **operators))
        cls.browser = cls.resources.enter_context(open_browser(1280, 900))

    def open(self, url):
        self.browser.get(url + "/monitor")
        wait_until(lambda: self.browser.find_element("id", "connection").text == "Live", "the page does not come alive")

    def find(self, selector):
        return self.browser.find_element("css selector", selector)

    def texts(self, selector):
        """At one moment: the page replaces elements."""
        return self.browser.execute_script("return Array.from(document.querySelectorAll(arguments[0]), each => each.innerText.trim())", selector)

    def press(self, selector):
        self.find(selector).click()

    def become_operator(self, token=TOKEN):
        self.press("#operator")
        wait_until(lambda: self.texts("dialog"), "it asks for no token")
        self.type_token(token)
        wait_until(lambda: self.texts("#operator") == ["Stop being the operator"], lambda: self.texts("dialog .failure"))
        wait_until(lambda: not self.texts("dialog"), "the dialog does not close")

    def type_token(self, token):
        self.find("dialog input").clear()
        self.find("dialog input").send_keys(token + Keys.ENTER)

    def confirm(self):
        self.press("dialog button[type=submit]")
        wait_until(lambda: not self.texts("dialog"), lambda: self.texts("dialog .failure"))

    def setUp(self):
        self.browser.switch_to.default_content()

    def check_looks(self, name):
        """At a desk, and on a phone in both orientations."""
        for width, height in ((360, 740), (740, 360), (1280, 900)):
            resize(self.browser, width, height)
            self.assertLessEqual(overflow(self.browser), 0, (name, width))
            self.assertEqual(self.out_of_reach(), [], (name, width))
            self.assertFalse(accessibility_findings(self.browser), (name, width))
        shot(self.browser, name)

    def out_of_reach(self):
        """What an open dialog has outside of the window, and buttons that are too small for a finger, on a phone."""
        return self.browser.execute_script("""
            const box = element => element.getBoundingClientRect();
            const outside = Array.from(document.querySelectorAll("dialog, dialog *"), each => [each, box(each)])
                .filter(([, {top, bottom, left, right}]) => top < 0 || left < 0 || bottom > innerHeight || right > innerWidth);
            const small = Array.from(document.querySelectorAll("button.act"), each => [each, box(each)])
                .filter(([, {height}]) => innerWidth < 700 && height > 0 && height < 44);
            return [...outside, ...small].map(([each]) => each.outerHTML.slice(0, 200));""")

    def test_the_operator_reads_what_the_doctor_finds(self):
        for server in (self.site, self.simulation):
            self.open(server.url)
            self.assertFalse(self.find("#doctor").is_displayed(), "whoever reads the page is told nothing")
            self.become_operator()
            wait_until(lambda: self.texts("#doctor p")[0].startswith("Looked at "), lambda: self.texts("#doctor"))
            said = self.texts("#doctor li")
            self.assertIn(f"ok public address: {server.url}/livez leads here.", said)
            self.assertIn(f"ok port {server.port}: the server runs there.", said)
            self.check_looks(f"operator_doctor_{server.port}")

    def test_a_machine_is_drained_and_taken_back(self):
        self.open(self.site.url)
        self.assertEqual(self.texts("td.action"), [], "whoever reads the page has no buttons")
        self.become_operator()
        drain, hint = f"[aria-label='Drain {self.near.address}']", self.texts("#hint")
        self.assertEqual(hint, ["To end a simulation, open the page of its machine."])
        self.check_looks("operator_session")
        wait_until(lambda: self.site.get("/session") == f"ws://{self.near.address}", "the machine of less load gets nobody")

        self.press(drain)
        self.assertEqual(self.texts("dialog h2"), [f"Drain {self.near.address}?"])
        self.check_looks("operator_drain")
        self.find("dialog").send_keys(Keys.ESCAPE)
        wait_until(lambda: not self.texts("dialog"), "Escape does not close it")
        self.assertEqual(self.browser.switch_to.active_element.get_attribute("aria-label"), f"Drain {self.near.address}")
        self.assertEqual(self.site.get("/session"), f"ws://{self.near.address}", "nobody has confirmed it")

        self.browser.switch_to.active_element.send_keys(Keys.ENTER)
        self.find("dialog button[type=submit]").send_keys(Keys.ENTER)
        wait_until(lambda: self.texts(".reason")[0] == "Drained by the operator: it gets no new simulations.", "the page does not say so")
        for _ in range(5):
            self.assertEqual(self.site.get("/session"), f"ws://{self.far.address}")
        kept = self.browser.execute_script("return JSON.stringify([{...sessionStorage}, {...localStorage}, document.cookie, Object.values(window).map(String)])")
        self.assertNotIn(TOKEN, kept, "other pages of this origin could read it")
        self.open(self.site.url)  # a reload: the page has forgotten the token, which is kept where no other page can read it
        self.assertEqual(self.texts("#operator"), ["Operator"])
        self.become_operator()
        wait_until(lambda: self.texts("td.action button") == ["Take back", "Drain"], lambda: self.texts("td.action button"))
        self.press("td.action button")
        self.confirm()
        wait_until(lambda: self.texts(".reason")[0] == "", "the page does not say that it is taken back")
        self.assertEqual(self.site.get("/session"), f"ws://{self.near.address}")
        self.press("#operator")
        self.assertEqual(self.texts("td.action"), [])
        self.assertEqual(self.texts("#servers th")[-1], "Last report")
        self.assert_nothing_is_stored()

    def assert_nothing_is_stored(self):
        """Pages of the same origin, a machine's behind a gateway say, would find it there."""
        self.assertEqual(self.browser.execute_script("return [sessionStorage.length, localStorage.length, document.cookie]"), [0, 0, ""])

    def test_a_simulation_is_ended_and_whoever_uses_it_is_told(self):
        self.open(self.simulation.url)
        self.become_operator()
        self.assert_nothing_is_stored()
        self.browser.switch_to.new_window("tab")
        viewer = self.browser.current_window_handle
        self.browser.get(f"{self.session.url}/viewer/?url=local:/demo_projects/robots/blob/main/worlds/arena.wbt&lang=en")
        self.press("#start")
        wait_until(lambda: self.find("body").get_attribute("data-state") == "running", lambda: self.find("body").text)
        monitor = next(handle for handle in self.browser.window_handles if handle != viewer)
        self.browser.switch_to.window(monitor)
        wait_until(lambda: len(self.texts("td.action button")) == 1, "the simulation has no button")
        self.check_looks("operator_simulation")
        self.press("td.action button")
        self.assertIn("arena.wbt: whoever uses it is told", self.find("dialog").text)
        self.check_looks("operator_end")
        self.confirm()
        wait_until(lambda: not self.texts("#simulations tbody tr"), "it is still there")
        self.browser.switch_to.window(viewer)
        wait_until(lambda: "The operator of this server has ended the simulation." in self.find("body").text, lambda: self.find("body").text)
        shot(self.browser, "operator_viewer")
        self.browser.close()
        self.browser.switch_to.window(monitor)
        self.simulation.wait_until_clean()

    def test_a_machine_drains_itself_and_takes_simulations_again(self):
        self.open(self.simulation.url)
        self.become_operator()
        self.press("#intake")
        self.confirm()
        wait_until(lambda: self.texts("#draining") == ["This machine drains: it takes no new simulations."], "the page does not say so")
        self.assertEqual(self.simulation.ask("/readyz"), (503, "draining"))
        self.check_looks("operator_draining")
        self.press("#intake")
        self.confirm()
        wait_until(lambda: not self.find("#draining").is_displayed(), "the page does not say that it is over")
        self.assertEqual(self.simulation.ask("/readyz"), (200, "ready"))

    def test_who_has_no_token_is_told_so_and_does_nothing(self):
        self.open(self.simulation.url)
        self.press("#operator")
        wait_until(lambda: self.texts("dialog"), "it asks for no token")
        for wrong in (TOKEN[:-1], "not \u2603"):
            self.type_token(wrong)
            wait_until(lambda: self.texts("dialog .failure") == ["The server does not accept this token."], lambda: self.texts("dialog"))
        self.check_looks("operator_token")
        self.assertEqual(self.texts("#operator"), ["Operator"])
        self.assert_nothing_is_stored()
        self.type_token(TOKEN)
        wait_until(lambda: self.texts("#operator") == ["Stop being the operator"], "the right one after that")

        self.browser.execute_script("const send = window.fetch; window.fetch = (url, options) => "  # the operator has another one now
                                    "send(url, {...options, headers: {Authorization: 'Bearer another'}})")
        self.press("#intake")
        self.press("dialog button[type=submit]")
        wait_until(lambda: self.texts("dialog .failure") == ["The server does not accept this token."], lambda: self.texts("dialog"))
        self.assertEqual(self.simulation.ask("/readyz"), (200, "ready"))
        self.open(self.simulation.url)
        self.assertEqual(self.texts("#operator"), ["Operator"])

    def test_what_has_ended_meanwhile_is_said(self):
        self.open(self.simulation.url)
        self.become_operator()
        self.browser.execute_script(START, f"ws://{self.simulation.address}/client", "local:/demo_projects/robots/blob/main/worlds/arena.wbt")
        wait_until(lambda: self.texts("td.action button"), "it does not start")
        self.press("td.action button")
        self.browser.execute_script("sockets.pop().close()")
        self.simulation.wait_until_clean()
        self.press("dialog button[type=submit]")
        wait_until(lambda: self.texts("dialog .failure") and self.texts("dialog .failure")[0].startswith("There is no simulation"),
                   lambda: self.texts("dialog"))
        self.assertTrue(self.texts("dialog .failure")[0].endswith(" any more."))

    def test_over_the_operators_socket_no_token_is_needed(self):
        with forwarded(self.simulation.operator_socket()) as port:
            self.browser.get(f"http://localhost:{port}/monitor")
            wait_until(lambda: self.find("#connection").text == "Every 5 seconds", "the page does not ask")
            self.press("#operator")
            wait_until(lambda: self.texts("#operator") == ["Stop being the operator"], lambda: self.texts("dialog"))
            self.press("#intake")
            self.confirm()
            self.assertEqual(self.simulation.ask("/readyz"), (503, "draining"))
            wait_until(lambda: self.texts("#intake") == ["Take simulations again"], "it does not say so")
            self.press("#intake")
            self.confirm()
            self.assertEqual(self.simulation.ask("/readyz"), (200, "ready"))
            # A page of another site, in the same browser, has the port too.
            self.browser.get(self.session.url + "/load")
            self.browser.execute_async_script(
                "fetch(arguments[0], {method: 'POST', mode: 'no-cors'}).finally(arguments[1])", f"http://localhost:{port}/api/drain")
            self.assertEqual(self.simulation.ask("/readyz"), (200, "ready"))

    def test_below_a_gateway_the_page_can_be_read_and_says_where_to_act(self):
        port = self.simulation.port
        with SessionServer([{"address": f"localhost/{port}", "internal": f"127.0.0.1:{port}"}]) as gateway:
            self.open(f"{gateway.url}/{port}")
            self.assertEqual(self.texts("#operator, #doctor, td.action"), [], "nobody types a token into a page that comes from a machine")
            self.assertEqual(self.texts("#elsewhere"), ["To act as the operator, use the machine\u2019s own address, or its command line."])
            self.check_looks("below_a_gateway")

    def test_a_page_in_a_frame_of_another_has_no_buttons(self):
        self.open(self.simulation.url)
        self.become_operator()
        self.browser.get(self.simulation.url + "/load")
        self.browser.execute_script("const frame = document.createElement('iframe'); frame.src = '/monitor'; document.body.append(frame)")
        self.browser.switch_to.frame(self.browser.find_element("css selector", "iframe"))
        wait_until(lambda: self.browser.find_element("id", "connection").text == "Live", "the frame does not come alive")
        self.assertEqual(self.texts("#operator, #intake, td.action"), [])
        self.browser.switch_to.default_content()


if __name__ == "__main__":
    main()
