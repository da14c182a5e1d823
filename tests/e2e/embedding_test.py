#!/usr/bin/python3
"""A page of another site that shows simulations with class View: a real browser, the real servers, the demo simulator.

Protocol sections 5.1 and 13.1."""

import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser import open_browser, screenshot  # noqa: E402
from support.projects import EXAMPLES  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402
from support.web_site import web_site  # noqa: E402

SITE = "site.example"  # Chromium is told that this is here
WORLD = "local:/demo_projects/robots/blob/main/worlds/arena.wbt"

TEN_LINES = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>My robot</title></head>
<body><main>
<h1>My robot</h1>
<script type="module" src="http://localhost:{port}/view/webots_view.js"></script>
<webots-view data-server="{world}" data-mode="mjpeg" data-autoplay></webots-view>
</main></body>
</html>"""

TELL = "const view = document.querySelector('webots-view').view; "


class Embedding(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        enter = cls.enterClassContext
        cls.keys = enter(tempfile.TemporaryDirectory())
        examples = os.path.dirname(os.path.abspath(EXAMPLES))
        cls.simulation = enter(SimulationServer(
            allowedRepositories=["local:"], forges=[{"url": "local:", "directory": examples}], projectsDir=os.path.abspath(EXAMPLES),
            keyDir=cls.keys, allowedOrigins=["*"]))
        cls.session = enter(SessionServer([cls.simulation.address]))
        cls.site = enter(web_site(TEN_LINES.format(port=cls.session.port, world=WORLD)))
        cls.browser = enter(open_browser(1000, 800, hosts=[SITE]))

    def setUp(self):
        self.addCleanup(self.simulation.wait_until_clean)
        self.addCleanup(self.browser.get, "about:blank")
        self.browser.get(f"http://{SITE}:{self.site}/")
        wait_until(lambda: self.tell("return Boolean(view)"), "the module does not load")

    def tell(self, script, *arguments):
        return self.browser.execute_script(TELL + script, *arguments)

    def message(self):
        return self.browser.execute_script(
            "return document.querySelector('webots-view > div').shadowRoot.querySelector('.said').innerText")

    def await_state(self, state):
        wait_until(lambda: self.tell("return view.state") == state, lambda: f"{state}: {self.tell('return view.state')}, "
                   f"{self.message()!r}\n{self.simulation.log()}")

    def picture(self):
        return self.browser.find_element("tag name", "webots-view").screenshot_as_png

    def await_motion(self):
        self.await_state("running")
        before = self.tell("return view.time")
        wait_until(lambda: self.tell("return view.time") > before + 200, "simulated time stands still")
        first = self.picture()
        wait_until(lambda: self.picture() != first, "the picture stands still")

    def test_ten_lines_show_a_world_that_runs(self):
        self.await_motion()
        if os.environ.get("SCREENSHOTS"):
            screenshot(self.browser, os.path.join(os.environ["SCREENSHOTS"], "embedded.png"))
        self.tell("view.setTimeout(60); view.pause()")
        self.await_state("paused")
        time = self.tell("return view.time")
        self.tell("view.step()")
        wait_until(lambda: self.tell("return view.time") > time, "a step takes no time")
        self.browser.execute_script("document.querySelector('webots-view').remove()")
        self.simulation.wait_until_clean()  # the element has ended what it started

    def test_a_project_of_a_website_and_somebody_who_watches_it(self):
        self.await_state("running")
        self.tell("view.close()")
        self.simulation.wait_until_clean()
        self.tell("view.open(arguments[0], 'mjpeg')", f"ws://localhost:{self.session.port}/robots/worlds/arena.wbt")
        self.await_motion()
        log = self.simulation.log()
        self.assertIn(f"Starting simulation from http://{SITE}:{self.site}/robots/worlds/arena.wbt", log)
        self.assertIn(";monitorActivity;mode=mjpeg", log)
        self.browser.execute_script("""
            const place = document.querySelector('main').appendChild(document.createElement('div'));
            place.id = 'watcher';
            window.watcher = new webots.View(place);
            watcher.broadcast = true;
            watcher.open(arguments[0], 'mjpeg');""", f"ws://localhost:{self.simulation.port + 1}")
        wait_until(lambda: self.browser.execute_script("return watcher.state === 'running' && watcher.time > 0"), "nothing to watch")
        self.tell("view.pause()")
        self.await_state("paused")
        self.browser.execute_script("watcher.play(); watcher.reset(); watcher.close()")
        self.tell("view.step()")
        self.await_state("paused")

    def test_a_server_that_does_not_know_the_site_is_told_of(self):
        self.await_state("running")
        self.tell("view.close()")
        self.simulation.wait_until_clean()
        self.reread(["https://other.example"])
        self.addCleanup(self.reread, ["*"])
        self.tell("view.open(arguments[0], 'mjpeg')", WORLD)
        self.await_state("failed")
        self.assertIn(f"Perhaps it does not accept pages of http://{SITE}:{self.site}", self.message())
        self.assertIn('"allowedOrigins"', self.message())

    def reread(self, origins):
        before = self.simulation.log().count("The configuration was read again")
        self.simulation.reread(allowedOrigins=origins)
        wait_until(lambda: self.simulation.log().count("The configuration was read again") > before, "the configuration is not read")


if __name__ == "__main__":
    main()
