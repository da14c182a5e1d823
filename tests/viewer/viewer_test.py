#!/usr/bin/python3
"""Drives the viewer page in headless Chromium against fake servers. Exit code 77: nothing could be tested.

With SCREENSHOTS=<folder> in the environment, pictures of the page are left in that folder.
"""

import json
import os
import sys
import unittest
from urllib.parse import quote

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "../support")]

import browser  # noqa: E402
from waiting import wait_until  # noqa: E402

ENTER = "\ue007"  # as WebDriver calls the key

try:
    from fake_cloud import FakeCloud
except ImportError as error:
    print(f"skipped: {error} (package python3-websockets)")
    sys.exit(77)

WORLD = "https://github.com/owner/repository/blob/main/worlds/arena.wbt"

START = {"url": WORLD, "mode": "mjpeg", "reconnect": True, "heartbeat": True, "extend": True, "reasons": True, "edit": True, "run": True}


class ViewerTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.driver = cls.enterClassContext(browser.open_browser(1280, 800))

    def setUp(self):
        self.cloud = self.enterContext(FakeCloud())
        self.addCleanup(self.driver.get, "about:blank")

    def wait(self, condition, what):
        return wait_until(condition, lambda: f"{what}; status: {self.text('status')!r}, body: {self.data()}")

    def element(self, name):
        return self.driver.find_element("id", name)

    def text(self, name):
        return self.driver.execute_script("return document.getElementById(arguments[0]).textContent", name)

    def data(self):
        return self.driver.execute_script("return {...document.body.dataset}")

    def wait_state(self, state):
        self.wait(lambda: self.data()["state"] == state, f"state {state}")

    def wait_text(self, name, text):
        self.wait(lambda: text in self.text(name), f"{text!r} in #{name}")

    def wait_control(self, message):
        self.wait(lambda: message in self.cloud.controls, f"message {message!r} to the simulator")

    def open_page(self, url=WORLD, page=None):
        self.driver.get(page or self.cloud.page)
        self.wait(lambda: self.data()["availability"] != "unknown", "the first availability")
        self.address(url)

    def address(self, url):
        self.driver.execute_script("document.getElementById('address').open = true")  # folded, while the page has a world
        self.element("connect-to").clear()
        self.element("connect-to").send_keys(url)

    def click(self, name):
        self.element(name).click()

    def start(self, url=WORLD):
        self.open_page(url)
        self.click("start")

    def run_simulation(self, url=WORLD):
        self.start(url)
        self.wait_state("running")

    def picture(self):
        return self.element("picture").screenshot_as_png

    def keep_screenshot(self, name):
        if folder := os.environ.get("SCREENSHOTS"):
            browser.screenshot(self.driver, os.path.join(folder, f"{name}.png"))


class Availability(ViewerTest):
    def test_the_light_follows_the_session_server(self):
        self.open_page()
        self.assertEqual(self.data()["availability"], "available")
        self.assertEqual(self.text("light"), "A machine is free.")
        self.cloud.set_available("0")
        self.wait(lambda: self.data()["availability"] == "full", "a full light")
        self.assertEqual(self.text("light"), "No machine is free.")  # true also when every machine is down

    def test_the_light_comes_back_after_the_session_server_was_away(self):
        self.open_page()
        self.cloud.shut("session")
        self.wait(lambda: self.data()["availability"] == "unknown", "an unknown light")
        self.cloud.set_available("0")
        self.cloud.open("session")
        self.wait(lambda: self.data()["availability"] == "full", "a new connection")


class Start(ViewerTest):
    def test_one_press_starts_a_moving_picture_and_advancing_time(self):
        self.run_simulation()
        [start] = [json.loads(text)["start"] for text in self.cloud.started]
        size = start.pop("size")
        self.assertEqual(start, START)
        self.assertRegex(size, r"^\d+x\d+$")
        self.assertEqual(self.cloud.controls[0], f"mjpeg: {size}")
        self.assertEqual(self.cloud.controls[1], "real-time:-1")  # the size is known
        first = self.picture()
        self.wait(lambda: self.picture() != first, "a different frame")
        before = float(self.data()["time"])
        self.wait(lambda: float(self.data()["time"]) > before, "progress of the simulated time")
        self.keep_screenshot("running-wide")

    def test_progress_lines_are_shown_with_their_percentages(self):
        self.cloud.launch = ["loading: Receiving objects: 42% (42/100)"]
        self.start()
        self.wait_text("status", "Receiving the project: 42%")
        self.assertEqual(self.element("progress").get_property("value"), 42)
        self.cloud.send("simulation", f"webots:{self.cloud.address('simulator')}")
        self.wait_state("running")
        self.assertFalse(self.element("progress").is_displayed())

    def test_the_simulators_own_loading_messages_are_shown(self):
        self.cloud.world = []
        self.run_simulation()
        self.cloud.send("simulator", "loading:Creating nodes:65")
        self.wait_text("status", "Creating nodes (65 %)")
        self.assertEqual(self.element("progress").get_property("value"), 65)

    def test_a_session_server_named_in_the_address_is_asked(self):
        host = self.cloud.page.removesuffix("/viewer/")
        self.run_simulation(f"{host}/session?url={WORLD}")
        self.assertIn(f"/session?url={WORLD}", self.cloud.requests)
        self.assertEqual(json.loads(self.cloud.started[0])["start"]["url"], WORLD)

    def test_a_simulator_is_connected_to_directly_and_left_as_it_is(self):
        self.start(self.cloud.address("simulator"))
        self.wait_state("paused")
        self.assertEqual((self.cloud.started, [c for c in self.cloud.controls if "real-time" in c]), ([], []))

    def test_everything_works_behind_a_proxy_that_rewrites_ports_to_paths(self):
        host = self.cloud.page.removesuffix("/viewer/")
        base = host.replace("http", "ws")
        self.cloud.answer = f"{base}/2000"
        self.cloud.launch = [f"webots:{base}/2001"]
        self.open_page(page=f"{host}/1999/viewer/")
        self.click("start")
        self.wait_state("running")
        first = self.picture()
        self.wait(lambda: self.picture() != first, "a different frame")

    def test_the_address_comes_from_the_page_or_from_the_servers_defaults(self):
        self.cloud.defaults = {"url": WORLD, "mode": "mjpeg", "notice": "A <b>demo</b> simulator"}
        self.driver.get(self.cloud.page)
        self.wait_text("notice", "A <b>demo</b> simulator")
        self.assertEqual(self.element("connect-to").get_property("value"), WORLD)
        self.driver.get(f"{self.cloud.page}?url=ws://localhost:1234")
        self.wait_text("notice", "demo")
        self.assertEqual(self.element("connect-to").get_property("value"), "ws://localhost:1234")


class Failures(ViewerTest):
    def test_the_session_servers_error_is_shown_capitalised(self):
        self.cloud.answer = "Error: no simulation server available at the moment."
        self.start()
        self.wait_state("failed")
        self.assertTrue(self.text("status").startswith("No machine is free at the moment."))
        self.assertEqual(self.text("start"), "Start again")

    NO_MACHINE = "Error: no simulation server available at the moment."

    def refuse_a_start(self, available):
        self.cloud.answer = self.NO_MACHINE
        self.cloud.set_available(available)
        self.start()
        self.wait_state("failed")
        self.assertEqual(self.text("status"), "No machine is free at the moment. Please try again in a few minutes. This page will tell you when there is one.")
        self.assertIn("problem", self.element("status").get_attribute("class"))

    def wait_for_the_offer(self):
        self.wait_text("status", "A machine is available now: press Start simulation.")
        self.assertNotIn("problem", self.element("status").get_attribute("class"))
        self.assertEqual(self.text("start"), "Start simulation")

    def test_a_refusal_is_taken_back_when_a_machine_is_free(self):
        self.refuse_a_start("0")
        self.cloud.answer = None
        self.cloud.set_available("1")
        self.wait_for_the_offer()
        self.click("start")
        self.wait_state("running")

    def test_a_refusal_is_taken_back_when_the_light_never_went_out(self):
        self.refuse_a_start("1")
        self.wait_for_the_offer()

    def test_a_machine_that_is_free_again_leaves_other_errors_and_simulations_alone(self):
        self.cloud.reason = "too-fast"
        self.cloud.answer = "Error: too many sessions are asked for from your network. Please try again in a moment."
        self.start()
        self.wait_state("failed")
        self.cloud.set_available("0")
        self.wait(lambda: self.data()["availability"] == "full", "a full light")
        self.cloud.set_available("1")
        self.wait(lambda: self.data()["availability"] == "available", "a light")
        self.wait_text("status", "Too many simulations were asked for")
        self.cloud.reason = None
        self.cloud.answer = self.NO_MACHINE
        self.click("start")
        self.wait_text("status", "No machine")
        self.cloud.answer = None
        self.click("start")
        self.wait_state("running")
        self.cloud.set_available("1")
        self.cloud.send("simulation", "loading: seen")
        self.wait_text("status", "seen")
        self.assertEqual(self.data()["state"], "running")

    def test_the_simulation_servers_error_survives_the_close_that_follows(self):
        self.cloud.launch = ["loading: Error: Wrong Webots simulation URL"]
        self.start()
        self.wait_text("status", "not the address of a world")
        self.cloud.close("simulation")
        self.wait_state("failed")
        self.assertIn("not the address of a world", self.text("status"))

    def test_an_error_without_the_loading_prefix_is_shown_too(self):
        self.cloud.launch = ["Error: no such world."]
        self.start()
        self.wait_text("status", "No such world.")

    def test_names_of_files_and_addresses_at_the_beginning_of_a_sentence_stay_as_they_are(self):
        self.cloud.launch = []
        self.start()
        self.wait(lambda: self.cloud.leases == 1, "the lease")
        for told in ("nope.wbt does not exist.", "https://github.com can't be reached.", "my_world is empty.", "local:/x is unknown."):
            self.cloud.send("simulation", f"loading: Error: {told}")
            self.wait_text("status", told)

    def test_an_unreachable_simulation_server_is_named(self):
        self.open_page()
        self.cloud.shut("simulation")
        self.click("start")
        self.wait_state("failed")
        self.assertIn(self.cloud.address("simulation"), self.text("status"))
        self.cloud.open("simulation")

    def test_a_senseless_address_is_explained(self):
        self.start("worlds/arena.wbt")
        self.wait_state("failed")
        self.assertEqual(self.text("status"), '"worlds/arena.wbt" is not a complete address: please copy the whole link to the world.')
        self.assertEqual(self.element("connect-to").get_attribute("aria-invalid"), "true")

    def test_the_loss_of_the_lease_is_told_and_a_new_start_works(self):
        self.run_simulation()
        self.cloud.close("simulation")
        self.wait_state("ended")
        self.assertIn("simulation server ended the session", self.text("status"))
        self.wait(lambda: self.cloud.streams == 0, "the end of the picture")
        self.click("start")
        self.wait_state("running")

    def test_the_loss_of_the_simulator_is_told_and_gives_the_lease_back(self):
        self.run_simulation()
        self.cloud.close("simulator")
        self.wait_state("ended")
        self.assertIn("simulator has closed the connection", self.text("status"))
        self.wait(lambda: self.cloud.leases == 0, "the end of the lease")

    def test_the_simulation_servers_reason_for_a_lost_simulator_wins(self):
        self.run_simulation()
        self.cloud.send("simulation", "loading: Error: the simulator crashed")
        self.cloud.close("simulator")
        self.wait_state("ended")
        self.assertEqual(self.text("status"), "The simulator crashed")


class BrokenConnections(ViewerTest):
    """The simulation server has a `reconnectGrace`, and so gave a token."""

    RETURN = json.dumps({"reconnect": "a1b2"}, separators=(",", ":"))

    def run_lasting_simulation(self):
        self.cloud.launch = [*self.cloud.good_start(), "reconnectToken: a1b2"]
        self.run_simulation()

    def test_a_broken_lease_returns_to_its_simulation_with_the_token(self):
        self.run_lasting_simulation()
        self.cloud.drop("simulation")
        self.wait_text("status", "Trying to return to the simulation")
        self.wait(lambda: self.RETURN in self.cloud.started, "the return")
        self.wait_text("status", "The simulation is running.")
        self.assertEqual(self.data()["state"], "running")
        self.assertEqual(self.cloud.leases, 1)
        self.assertEqual(sum(c.startswith("mjpeg: ") for c in self.cloud.controls), 1)  # The simulator was never left.

    def test_a_network_that_breaks_everything_is_survived(self):
        self.run_lasting_simulation()
        self.cloud.drop("simulator")
        self.cloud.drop("simulation")
        self.wait(lambda: self.RETURN in self.cloud.started, "the return")
        self.wait(lambda: sum(c.startswith("mjpeg: ") for c in self.cloud.controls) == 2, "a new picture")
        self.wait(lambda: self.element("play").is_enabled() and "Returning" not in self.text("status"), "the simulation")

    def test_a_broken_connection_to_the_simulator_alone_is_restored(self):
        self.run_lasting_simulation()
        self.cloud.drop("simulator")
        self.wait(lambda: sum(c.startswith("mjpeg: ") for c in self.cloud.controls) == 2, "a new connection")
        self.wait(lambda: "Returning" not in self.text("status"), "the simulation")
        self.assertEqual(len(self.cloud.started), 1)

    def test_a_return_that_comes_too_late_is_told_in_the_servers_words(self):
        self.run_lasting_simulation()
        self.cloud.launch = ["loading: Error: This simulation has ended. Please start it again."]
        self.cloud.drop("simulation")
        self.wait_text("status", "This simulation has ended.")
        self.cloud.close("simulation")
        self.wait_state("ended")
        self.assertEqual(self.text("status"), "This simulation has ended. Please start it again.")

    def test_a_lease_that_the_server_closes_is_over(self):
        self.run_lasting_simulation()
        self.cloud.close("simulation")
        self.wait_state("ended")
        self.assertEqual(len(self.cloud.started), 1)

    def test_without_a_token_a_broken_lease_is_the_end(self):
        self.run_simulation()
        self.cloud.drop("simulation")
        self.wait_state("ended")
        self.assertIn("connection to the simulation server was lost", self.text("status"))


class Running(ViewerTest):
    def test_the_buttons_send_their_messages(self):
        self.run_simulation()
        self.click("pause")
        self.wait_state("paused")
        self.assertIn("pause", self.cloud.controls)
        before = float(self.data()["time"])
        self.click("step")
        self.wait(lambda: float(self.data()["time"]) == before + 32, "one step of simulated time")
        self.click("fast")
        self.wait_state("fast")
        self.wait_control("fast:-1")
        self.click("pause")
        self.wait_state("paused")
        self.click("reset")
        self.wait(lambda: self.data()["time"] == "0", "time zero")
        self.assertEqual(self.text("time"), "0:00:00.000")
        self.click("reload")
        self.wait_control("reload")
        self.click("play")
        self.wait_state("running")

    def test_disconnecting_closes_the_lease_and_the_picture(self):
        self.run_simulation()
        self.wait(lambda: self.cloud.streams == 1, "the picture")
        self.click("quit")
        self.wait_state("idle")
        self.wait(lambda: (self.cloud.leases, self.cloud.streams) == (0, 0), "the end of all connections")
        self.assertFalse(self.element("play").is_enabled())

    def test_enter_in_the_address_starts_but_never_ends_a_simulation(self):
        self.cloud.launch = []
        self.open_page()
        for _ in range(2):  # impatient
            self.press_enter()
            self.wait_state("starting")
        self.wait(lambda: len(self.cloud.started) == 1, "the start")
        self.cloud.send("simulation", f"webots:{self.cloud.address('simulator')}")
        self.wait_state("running")
        self.press_enter()
        self.assertEqual(self.data()["state"], "running")
        self.click("quit")
        self.wait_state("idle")
        self.press_enter()
        self.wait_state("starting")
        self.assertEqual(self.text("start"), "Cancel")

    def press_enter(self):
        self.driver.execute_script("document.getElementById('address').open = true")  # it folds when a simulation starts
        self.element("connect-to").send_keys(ENTER)

    def test_a_double_click_starts_once_and_takes_nothing_back(self):
        from selenium.webdriver import ActionChains
        self.open_page()
        ActionChains(self.driver).double_click(self.element("start")).perform()
        self.wait_state("running")
        self.assertEqual(len(self.cloud.started), 1)

    def test_leaving_the_page_closes_the_lease(self):
        self.run_simulation()
        self.driver.get("about:blank")
        wait_until(lambda: (self.cloud.leases, self.cloud.streams) == (0, 0), "the lease is not given back")

    def test_console_lines_are_text_and_never_markup(self):
        self.run_simulation()
        self.cloud.send("simulator", "stdout:<script>document.title = 'broken'</script>\nstderr:<b>bad</b>\nstdout:\x1b[31mred\x1b[0m")
        self.wait_text("console", "red")
        lines = [line.get_attribute("textContent") for line in self.element("console").find_elements("css selector", "div")]
        self.assertEqual(lines, ["<script>document.title = 'broken'</script>", "<b>bad</b>", "red"])
        self.assertNotEqual(self.driver.title, "broken")
        self.assertEqual(self.element("console").find_elements("css selector", "script, b"), [])

    def test_the_console_keeps_the_last_thousand_lines(self):
        self.run_simulation()
        for block in range(3):
            self.cloud.send("simulator", "\n".join(f"stdout:line {block * 500 + i}" for i in range(500)))
        self.wait_text("console", "line 1499")
        count = "const c = document.getElementById('console'); return [c.childElementCount, c.firstElementChild.textContent]"
        self.assertEqual(self.driver.execute_script(count), [1000, "line 500"])

    def test_a_coming_shutdown_is_announced(self):
        self.run_simulation()
        self.assertFalse(self.element("warning").is_displayed())
        self.cloud.send("simulation", "shutdownTimeout: 301")
        self.wait_text("warning", "5 minutes")
        self.assertTrue(self.element("warning").is_displayed())

    def test_the_mouse_on_the_picture_is_forwarded(self):
        from selenium.webdriver import ActionChains
        self.run_simulation()
        self.wait(lambda: self.cloud.streams == 1, "the picture")
        ActionChains(self.driver).drag_and_drop_by_offset(self.element("picture"), 20, 10).perform()
        self.wait(lambda: any(c.startswith("mouse 1 ") for c in self.cloud.controls), "the release of the button")
        kinds = [c.split()[1] for c in self.cloud.controls if c.startswith("mouse ")]
        self.assertEqual((kinds[0], kinds[-1], set(kinds[1:-1])), ("-1", "1", {"0"}))
        press, release = [next(c for c in self.cloud.controls if c.startswith(f"mouse {k} ")).split() for k in ("-1", "1")]
        self.assertEqual((press[2:4], press[6:]), (["0", "1"], ["0", "0"]))
        moved = [int(after) - int(before) for after, before in zip(release[4:6], press[4:6])]
        self.assertEqual(moved, [20, 10])

    def test_a_spectators_mouse_is_not_forwarded(self):
        from selenium.webdriver import ActionChains
        self.cloud.multimedia = "multimedia: mjpeg pause 640 480"
        self.run_simulation()
        ActionChains(self.driver).click(self.element("picture")).perform()
        self.click("pause")
        self.wait_state("paused")
        self.assertEqual([c for c in self.cloud.controls if c.startswith("mouse")], [])


class Layout(ViewerTest):
    @unittest.skipIf(browser.BROWSER == "firefox", "its windows are at least 450 pixels wide; viewer_page_test is narrow in Firefox as well")
    def test_a_phone_shows_everything_without_scrolling_sideways(self):
        self.addCleanup(browser.resize, self.driver, 1280, 800)
        self.open_page()
        self.keep_screenshot("idle-wide")
        browser.resize(self.driver, 360, 740)
        self.keep_screenshot("idle-narrow")
        self.click("start")
        self.wait_state("running")
        self.cloud.send("simulator", "stdout:" + "word" * 200)
        self.wait_text("console", "word")
        self.keep_screenshot("running-narrow")
        self.assertEqual(self.driver.execute_script("return document.documentElement.scrollWidth"), 360)

    def test_the_simulator_is_told_when_the_window_changes_its_size(self):
        self.addCleanup(browser.resize, self.driver, 1280, 800)
        self.run_simulation()
        browser.resize(self.driver, 700, 800)
        widths = "return [innerWidth, document.getElementById('screen').clientWidth - document.documentElement.clientWidth]"
        self.wait(lambda: self.driver.execute_script(widths) == [700, 0], "the new size")
        size = self.driver.execute_script("const s = document.getElementById('screen'); return `${s.clientWidth}x${s.clientHeight}`")
        self.wait(lambda: self.cloud.controls[-1] == f"resize: {size}", "the simulator is told")

    def test_the_page_causes_no_complaint_in_the_browsers_console(self):
        self.cloud.defaults = {}
        self.cloud.worlds = []
        browser.console_messages(self.driver)
        self.run_simulation()
        # The page asks whether there is a library for scenes, and a browser that can draw them: here, there is neither.
        expected = ("/view/x_ite/x_ite.min.mjs - Failed to load", "software WebGL")
        self.assertEqual([said for said in browser.console_messages(self.driver)
                          if not any(part in said["message"] for part in expected)], [])


class Addresses(ViewerTest):
    CASES = {
        WORLD: {"kind": "session", "server": "http://own/", "request": f"http://own/session?url={WORLD}", "world": WORLD},
        f"http://h:1999/session?url={WORLD}":
            {"kind": "session", "server": "http://h:1999/", "request": f"http://h:1999/session?url={WORLD}", "world": WORLD},
        "https://h/1999/session?url=https%3A%2F%2Fg.org%2Fa%2Fworlds%2Fb.wbt&x=1":
            {"kind": "session", "server": "https://h/1999/", "world": "https://g.org/a/worlds/b.wbt",
             "request": "https://h/1999/session?url=https%3A%2F%2Fg.org%2Fa%2Fworlds%2Fb.wbt&x=1"},
        "http://h:1999/session?url=local%3A%2Fo%2Fr%2Fblob%2Fmain%2Fworlds%2Fa.wbt":
            {"kind": "session", "server": "http://h:1999/", "world": "local:/o/r/blob/main/worlds/a.wbt",
             "request": "http://h:1999/session?url=local%3A%2Fo%2Fr%2Fblob%2Fmain%2Fworlds%2Fa.wbt"},
        "http://h:1999/session?url=https://g.org/100%25/worlds/a%3Ab.wbt":
            {"kind": "session", "server": "http://h:1999/", "world": "https://g.org/100%25/worlds/a%3Ab.wbt",
             "request": "http://h:1999/session?url=https://g.org/100%25/worlds/a%3Ab.wbt"},
        "local:/o/r/blob/main/worlds/a.wbt":
            {"kind": "session", "server": "http://own/", "request": "http://own/session?url=local:/o/r/blob/main/worlds/a.wbt",
             "world": "local:/o/r/blob/main/worlds/a.wbt"},
        " ws://h:2001/ ": {"kind": "simulator", "url": "ws://h:2001"},
        "wss://h/2001": {"kind": "simulator", "url": "wss://h/2001"},
        "ws://h:2000/simulation/abc/2001/": {"kind": "simulator", "url": "ws://h:2000/simulation/abc/2001"},
        "wss://h/2000/simulation/abc/2001": {"kind": "simulator", "url": "wss://h/2000/simulation/abc/2001"},
        f"ws://h:1999/session?url={WORLD}":
            {"kind": "session", "server": "http://h:1999/", "request": f"http://h:1999/session?url={WORLD}", "world": WORLD},
        "wss://h/1999/session?url=https%3A%2F%2Fg.org%2Fa%2Fworlds%2Fb.wbt":
            {"kind": "session", "server": "https://h/1999/", "world": "https://g.org/a/worlds/b.wbt",
             "request": "https://h/1999/session?url=https%3A%2F%2Fg.org%2Fa%2Fworlds%2Fb.wbt"},
    }
    # All of them mean WORLD, at the server that the page is from.
    LINKS = (
        f"https://webots.cloud/run?version=R2025a&url={WORLD}",
        f"https://webots.cloud/run?url={WORLD}&type=demo#top",
        f"webots.cloud/run?version=R2025a&url={quote(WORLD, safe='')}&type=competition",
        f"[![webots.cloud - run](https://img.shields.io/badge/webots.cloud-run-007ACC)](https://webots.cloud/run?version=R2025a&url={quote(WORLD, safe='')})",
        f"[Start it]( <{WORLD}> \"now\")",
        f'<a href="https://webots.cloud/run?version=R2025a&amp;url={WORLD}"><img src="https://img.shields.io/badge/run-007ACC.svg" alt="run"></a>',
        f"<a class='x' href='{WORLD}'>start</a>",
        f"<{WORLD}>",
        f'[1]: https://webots.cloud/run?version=R2025a&url={quote(WORLD, safe="")}&type=competition "Leaderboard"',
        f".. image:: https://img.shields.io/badge/webots.cloud-run-007ACC    :target: https://webots.cloud/run?url={WORLD}",
        WORLD.removeprefix("https://"),
    )
    REFUSED = ("", "nonsense", "http://h:1999/session", "ftp://h/worlds/a.wbt", "https://h/page", "ws://h/p/worlds/a.wbt", "local:/session",
               "mailto:a.wbt", "https://webots.cloud/run", "https://webots.cloud/run?version=R2025a", "https://webots.cloud/run?url=https://h/page",
               "[text](https://h/page)", "ws://h/session?url=", "host.org/page")

    def parse(self, address):
        return self.driver.execute_async_script(
            "const [address, done] = arguments; import('./view/address.js').then(({ parseAddress }) => {"
            "  try { done(parseAddress(address, 'http://own/')); } catch (error) { done(error.message); } })", address)

    def test_each_kind_of_address_is_understood(self):
        self.open_page()
        for address, expected in self.CASES.items():
            with self.subTest(address):
                self.assertEqual(self.parse(address), expected)

    def test_links_of_other_sites_and_badges_lead_to_the_world_that_they_name(self):
        self.open_page()
        for link in self.LINKS:
            with self.subTest(link):
                self.assertEqual(self.parse(link), self.CASES[WORLD])

    @unittest.skipIf(browser.BROWSER == "firefox", "its driver loads modules of its own, without the page's texts")
    def test_every_other_address_is_answered_with_what_was_expected(self):
        self.open_page()
        for address in self.REFUSED:
            with self.subTest(address):
                self.assertRegex(self.parse(address), "^Please enter the address of a world|: please (copy|add|start) ")


def main():
    program = unittest.main(exit=False, verbosity=2)
    result = program.result
    if result.wasSuccessful() and result.skipped and result.testsRun == 0:
        print(f"skipped: {result.skipped[0][1]}")
        return 77
    return 0 if result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
