#!/usr/bin/python3
"""The main job from end to end: a real git server, the real servers, the demo simulator and a real browser.

Protocol sections 1, 4.1.2 and 13 (refs with a slash)."""

import os
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser import open_browser, screenshot  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.machine import Machine  # noqa: E402
from support.projects import CONFIG, demo_project, local_config  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, port_is_free, wait_until  # noqa: E402



def picture(browser):
    """The pixels of the stream as the page shows them now; empty before the first frame."""
    image = browser.find_element("id", "picture")
    return image.screenshot_as_png if image.get_attribute("data-live") is not None else b""


def await_motion(browser):
    """A picture, and then another one."""
    first = wait_until(lambda: picture(browser), "no picture came")
    wait_until(lambda: picture(browser) != first, "the picture stands still")


class FirstMinute(unittest.TestCase):
    """What a newcomer does, without the Internet: opens the page and presses its button."""

    def test_the_world_that_the_local_configuration_proposes_starts_with_one_button(self):
        config = local_config("simulation")
        forges = [{**forge, "directory": os.path.join(CONFIG, "simulation", forge["directory"])}
                  for forge in config["forges"] if isinstance(forge, dict)]
        simulation = self.enterContext(SimulationServer(forges=forges, allowedRepositories=config["allowedRepositories"]))
        session = self.enterContext(SessionServer([simulation.address], viewerUrl=local_config("session")["viewerUrl"]))
        with open_browser(1280, 800) as browser:
            browser.get(f"{session.url}/viewer/")
            body = browser.find_element("tag name", "body")
            wait_until(lambda: browser.find_element("id", "connect-to").get_property("value"), "no world is proposed")
            browser.find_element("id", "start").click()
            wait_until(lambda: body.get_attribute("data-state") in ("running", "failed"), lambda: simulation.log())
            self.assertEqual(body.get_attribute("data-state"), "running", browser.find_element("id", "status").text)
            await_motion(browser)


    # A machine that has just built the servers is busy for a moment.
    def test_a_start_that_was_refused_works_when_the_page_says_so(self):
        simulation = self.enterContext(SimulationServer(allowedRepositories=["local:"], forges=[{
            "url": "local:", "directory": os.path.join(CONFIG, "..", "examples")}]))
        busy = self.enterContext(Machine(load="100.0"))
        session = self.enterContext(SessionServer([busy.address], loadThreshold=95, viewerUrl=local_config("session")["viewerUrl"]))
        with open_browser(1280, 800) as browser:
            browser.get(f"{session.url}/viewer/")
            body, status = browser.find_element("tag name", "body"), browser.find_element("id", "status")
            wait_until(lambda: browser.find_element("id", "connect-to").get_property("value"), "no world is proposed")
            wait_until(lambda: body.get_attribute("data-availability") == "full", "the machine is not busy")
            browser.find_element("id", "start").click()
            wait_until(lambda: body.get_attribute("data-state") == "failed", "it is not refused")
            self.assertEqual(status.text, "No machine is free at the moment. Please try again in a few minutes. This page will tell you when there is one.")
            session.reread(loadThreshold=1000, simulationServers=[simulation.address])
            wait_until(lambda: status.text == "A machine is available now: press Start simulation.", lambda: status.text)
            browser.find_element("id", "start").click()
            wait_until(lambda: body.get_attribute("data-state") in ("running", "failed"), lambda: simulation.log())
            self.assertEqual(body.get_attribute("data-state"), "running", status.text)


class MainJob(unittest.TestCase):
    def setUp(self):
        self.git = self.enterContext(GitServer())
        self.git.add_repository("school", "class", {
            **demo_project("projects/robots"),
            "README.md": "# Our class\n",
        }, branches={"team/blue": demo_project()}, tags={"v1.0": demo_project()})
        self.simulation = self.enterContext(SimulationServer(forges=[self.git.url], allowedRepositories=[self.git.url], gateway=True, reconnectGrace=0))
        self.session = self.enterContext(SessionServer([self.simulation.address]))

    def start_in(self, browser, world):
        browser.get(f"{self.session.url}/viewer/?url={self.git.url}/school/class/{world}")
        body = browser.find_element("tag name", "body")
        wait_until(lambda: body.get_attribute("data-availability") == "available", "the light stays off")
        browser.find_element("id", "start").click()
        wait_until(lambda: body.get_attribute("data-state") == "running", lambda: self.simulation.log())
        return body

    def test_a_person_presses_one_button_and_sees_robots_move(self):
        with open_browser(1280, 800) as browser:
            body = self.start_in(browser, "blob/main/projects/robots/worlds/arena.wbt")
            first_time = float(body.get_attribute("data-time"))
            await_motion(browser)
            wait_until(lambda: float(body.get_attribute("data-time")) > first_time + 300, "simulated time stands still")
            self.assertTrue(self.simulation.simulators())
            if os.environ.get("SCREENSHOTS"):
                screenshot(browser, os.path.join(os.environ["SCREENSHOTS"], "running.png"))

            browser.find_element("id", "pause").click()
            wait_until(lambda: body.get_attribute("data-state") == "paused", "it does not pause")
        # The browser has gone: nothing may stay.
        self.simulation.wait_until_clean()
        for port in range(self.simulation.port + 1, self.simulation.port + 21):
            self.assertTrue(port_is_free(port), port)

    def test_branches_with_slashes_and_tags_are_found(self):
        for world in ("blob/team/blue/worlds/corridor.wbt", "tree/v1.0/worlds/arena.wbt"):
            with self.subTest(world), open_browser(800, 600) as browser:
                self.start_in(browser, world)
            self.simulation.wait_until_clean()

    def test_a_world_that_does_not_exist_is_told_on_the_page(self):
        with open_browser(800, 600) as browser:
            browser.get(f"{self.session.url}/viewer/?url={self.git.url}/school/class/blob/main/projects/robots/worlds/no.wbt")
            browser.find_element("id", "start").click()
            body = browser.find_element("tag name", "body")
            wait_until(lambda: body.get_attribute("data-state") == "failed", "no failure is shown")
            self.assertIn("no.wbt does not exist", browser.find_element("id", "status").text.lower())
        self.simulation.wait_until_clean()


if __name__ == "__main__":
    main()
