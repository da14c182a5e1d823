#!/usr/bin/python3
"""What the viewer page shows, and does, when connections are silent, break, or end with the page: headless Chromium against fake servers.

Exit code 77: nothing could be tested. What takes long is tested in session_test.mjs, where time is not waited for.
"""

import json
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import viewer_test  # noqa: E402

RETURN = json.dumps({"reconnect": "a1b2"}, separators=(",", ":"))


class ConnectionTest(viewer_test.ViewerTest):
    def run_lasting_simulation(self):
        self.cloud.keeps = self.cloud.heartbeats = True
        self.cloud.launch = [*self.cloud.good_start(), "reconnectToken: a1b2"]
        self.run_simulation()

    def wait_return(self, times=1):
        self.wait(lambda: self.cloud.started.count(RETURN) == times, "the return")
        self.wait(lambda: self.cloud.leases == 1, "one lease")
        self.wait_state("running")

    def starts(self):
        return sum("start" in json.loads(message) for message in self.cloud.started)


class Silence(ConnectionTest):
    def test_a_silent_server_is_told_and_returned_to_when_it_answers_again(self):
        self.run_lasting_simulation()
        self.cloud.mute = {"simulation", "simulator"}
        self.wait_text("status", "Nothing is arriving from the simulation server")
        self.assertEqual(self.data()["state"], "lost")
        self.assertFalse(self.element("pause").is_enabled())
        self.wait(lambda: RETURN in self.cloud.started, "an attempt to return")
        self.assertEqual(self.data()["state"], "lost")  # a connection that opens and says nothing is none
        self.cloud.mute = set()
        self.wait_state("running")
        self.assertTrue(self.element("pause").is_enabled())
        self.assertEqual(self.starts(), 1)
        self.assertIn(4000, self.cloud.farewells)  # with which the simulation waits

    def test_a_simulator_that_sends_no_pictures_is_told_while_the_server_answers(self):
        self.run_lasting_simulation()
        self.cloud.mute = {"simulator"}
        self.wait_text("status", "No picture has arrived")
        self.assertEqual(self.data()["state"], "lost")
        self.assertTrue(self.element("pause").is_enabled())  # a simulator that is busy hears it later
        self.cloud.mute = set()
        self.wait_state("running")
        self.wait_text("status", "The simulation is running.")
        self.assertEqual(len(self.cloud.started), 1)

    def test_a_stream_that_died_with_the_network_is_replaced_by_a_new_one(self):
        self.run_lasting_simulation()
        self.wait(lambda: self.cloud.streams == 1, "the picture")
        self.cloud.kill_streams()
        self.cloud.mute = {"simulation", "simulator"}
        self.wait_state("lost")
        self.cloud.mute = set()
        self.wait(lambda: self.cloud.streams == 1 and not self.cloud.dead_streams, "a new stream")
        self.wait_state("running")
        before = float(self.data()["time"])
        self.wait(lambda: float(self.data()["time"]) > before, "pictures")


class HiddenPages(ConnectionTest):
    HIDE = """Object.defineProperty(document, 'hidden', { value: arguments[0], configurable: true });
        Object.defineProperty(document, 'visibilityState', { value: arguments[0] ? 'hidden' : 'visible', configurable: true });
        document.dispatchEvent(new Event('visibilitychange'));"""

    def hide(self, hidden):
        self.driver.execute_script(self.HIDE, hidden)

    def test_a_hidden_page_gets_no_pictures_and_is_paused_where_the_operator_wants_that(self):
        self.cloud.defaults = {"pauseHidden": 1}
        self.run_lasting_simulation()
        self.wait(lambda: self.cloud.streams == 1, "the picture")
        self.hide(True)
        self.wait(lambda: self.cloud.streams == 0, "the end of the stream")
        self.wait_control("pause")
        self.wait_state("paused")
        self.hide(False)
        self.wait(lambda: self.cloud.streams == 1, "the picture")
        self.wait_state("running")


class TimeLimit(ConnectionTest):
    def test_the_time_that_is_left_is_shown_and_extended_by_a_button(self):
        self.run_lasting_simulation()
        self.wait(lambda: self.text("left").startswith(("2:00:00", "1:59:")), "two hours")
        self.assertFalse(self.element("extend").is_displayed())
        self.cloud.launch = ["shutdownTimeout: 1100", "extendable: 0"]
        self.cloud.send("simulation", "shutdownTimeout: 200")
        self.cloud.send("simulation", "extendable: 900")
        self.wait_text("warning-text", "3 minutes")
        self.click("extend")
        self.wait(lambda: json.dumps({"extend": 900}, separators=(",", ":")) in self.cloud.started, "the request")
        self.wait(lambda: self.text("left").startswith("0:18:"), "the new limit")
        self.wait(lambda: not self.element("extend").is_displayed() and not self.element("warning").is_displayed(), "no warning")


class Pages(ConnectionTest):
    def test_a_reload_and_the_button_back_return_to_the_simulation(self):
        self.run_lasting_simulation()
        self.driver.refresh()
        self.wait_return()
        # Firefox closes the connections of a page before the page knows that it goes.
        self.assertEqual(self.cloud.farewells, [1001 if viewer_test.browser.BROWSER == "firefox" else 4000])
        self.assertEqual(self.element("connect-to").get_property("value"), viewer_test.WORLD)
        before = float(self.data()["time"])
        self.wait(lambda: float(self.data()["time"]) > before, "a simulation that goes on")
        self.driver.get("about:blank")
        self.driver.back()
        self.wait_return(times=2)
        self.assertEqual(self.starts(), 1)

    def test_disconnect_ends_at_once_and_a_reload_starts_nothing(self):
        self.run_lasting_simulation()
        self.click("quit")
        self.wait_state("idle")
        viewer_test.wait_until(lambda: self.cloud.farewells == [1000], lambda: self.cloud.farewells)
        self.driver.refresh()
        self.wait(lambda: self.data()["availability"] != "unknown", "the page")
        self.assertEqual((self.data()["state"], self.cloud.started.count(RETURN)), ("idle", 0))

    def test_a_duplicated_tab_leaves_the_simulation_to_the_first(self):
        self.run_lasting_simulation()
        first = self.driver.current_window_handle
        self.driver.execute_script("window.open(location.href)")  # which copies the storage of the tab
        [second] = set(self.driver.window_handles) - {first}
        self.driver.switch_to.window(second)
        try:
            self.wait(lambda: self.data().get("availability", "unknown") != "unknown", "the page")
            self.wait(lambda: self.driver.execute_script("return sessionStorage.length") == 0, "a tab of its own")
            self.assertEqual(self.data()["state"], "idle")
        finally:
            self.driver.close()
            self.driver.switch_to.window(first)
        self.assertEqual(self.data()["state"], "running")
        self.assertEqual((self.cloud.leases, len(self.cloud.started)), (1, 1))

    def test_who_loses_the_simulation_to_another_page_is_told(self):
        self.run_lasting_simulation()
        self.cloud.close("simulation", 4001)
        self.wait_state("ended")
        self.assertIn("another page or tab", self.text("status"))
        self.assertNotIn(RETURN, self.cloud.started)


if __name__ == "__main__":
    sys.exit(viewer_test.main())
