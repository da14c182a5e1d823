#!/usr/bin/python3
"""The second diagram of the documentation ("Web simulation protocol sequence diagram") from its first arrow to its last, with a real
browser, the example of a website, the real servers and the demo simulator. Protocol sections 1, 3, 5 and 7."""

import io
import json
import os
import sys
import unittest
import urllib.parse

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser import BROWSER, accessibility_findings, console_messages, open_browser, run_first, screenshot  # noqa: E402
from support.machine import Machine  # noqa: E402
from support.projects import EXAMPLES  # noqa: E402
from support.servers import SessionServer, SimulationServer, free_port, main, wait_until  # noqa: E402
from support.website_host import ADA, SOURCE, WebsiteHost  # noqa: E402

try:
    from PIL import Image
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-pil)") or 77)

CODE_MIRROR = os.path.join(SOURCE, "build", "node", "src", "web", "view", "node_modules", "@codemirror")  # the pages are built with it
FILE = "robots/controllers/avoid_walls/avoid_walls.py"

# Everything that the page says and hears on WebSockets: ["open" | "sent" | "heard" | "closed", address, text].
RECORDER = """{
window.wire = [];
const note = (what, socket, text) => window.wire.push([what, socket.url, typeof text === 'string' ? text : '(bytes)']);
window.WebSocket = class extends WebSocket {
  constructor(...given) {
    super(...given);
    note('open', this, '');
    this.addEventListener('message', (event) => note('heard', this, event.data));
    this.addEventListener('close', () => note('closed', this, ''));
  }
  send(text) {
    note('sent', this, text);
    super.send(text);
  }
};
}"""


class Page:
    """The website's page in a browser."""

    def __init__(self, browser, website):
        self.browser = browser
        run_first(browser, RECORDER)
        browser.get(f"{website.origin}/?mode=mjpeg")  # the pixels are the simulator's

    def element(self, name):
        return self.browser.find_element("id", name)

    def await_text(self, name, text):
        wait_until(lambda: text in self.element(name).text, lambda: f"{name} says {self.element(name).text!r}; {self.wire()[-20:]} "
                                                                    f"{console_messages(self.browser)}")

    def press(self, name):
        wait_until(lambda: self.element(name).is_enabled(), lambda: f"{name} can't be pressed: {self.element('status').text!r}")
        self.element(name).click()

    def wire(self, what=None, beginning=""):
        """What was said so far, [what, address, text]."""
        return [each for each in self.browser.execute_script("return window.wire") if what in (None, each[0]) and each[2].startswith(beginning)]

    def await_wire(self, what, beginning, after=0):
        """Waits until more than `after` of these have been said, and returns them."""
        return wait_until(lambda: self.wire(what, beginning)[after:], lambda: f"nothing was {what}: {beginning}; {self.wire()[-20:]}")

    def time(self):
        """Of the simulation, milliseconds."""
        return self.browser.execute_script("return webots.currentView.time")

    def await_time(self, reached):
        wait_until(lambda: reached(self.time()), lambda: f"the simulation is at {self.time()} ms")

    def middle(self):
        """The pixels in the middle of the simulation, where no text is."""
        with Image.open(io.BytesIO(self.element("view").screenshot_as_png)) as view:
            return view.crop((view.width * 0.2, view.height * 0.3, view.width * 0.8, view.height * 0.65)).tobytes()

    def edit(self, old, new):
        """Changes a word of the controller as a person does, by the keyboard."""
        from selenium.webdriver import ActionChains
        self.browser.execute_script("""
            const [old] = arguments;
            const field = document.querySelector('#editor textarea');
            if (field) {
              field.focus();
              field.setSelectionRange(field.value.indexOf(old), field.value.indexOf(old) + old.length);
              return;
            }
            const editor = document.querySelector('#editor .code-mirror').shadowRoot;
            const line = [...editor.querySelectorAll('.cm-line')].find((each) => each.textContent.includes(old));
            line.closest('.cm-content').focus();
            const walker = document.createTreeWalker(line, NodeFilter.SHOW_TEXT);
            const at = line.textContent.indexOf(old);
            const place = (index) => {
              walker.currentNode = line;
              for (let node = walker.nextNode(); node; node = walker.nextNode()) {
                if (index <= node.length)
                  return [node, index];
                index -= node.length;
              }
            };
            const range = document.createRange();
            range.setStart(...place(at));
            range.setEnd(...place(at + old.length));
            getSelection().removeAllRanges();
            getSelection().addRange(range);
            """, old)
        ActionChains(self.browser).send_keys(new).perform()  # to what has the focus, which the editor hides from others


class SecondDiagram(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        session_port = free_port()
        cls.website = cls.enterClassContext(WebsiteHost(f"ws://localhost:{session_port}"))
        cls.simulation = cls.enterClassContext(SimulationServer(projectsDir=os.path.abspath(EXAMPLES), keyDir=cls.website.keys))
        # How busy this machine is, nobody knows: no other one is as busy as that.
        cls.overloaded = cls.enterClassContext(Machine(load="5000.0"))
        cls.session = cls.enterClassContext(SessionServer([cls.overloaded.address, cls.simulation.address], port=session_port))

    def instance_file(self):
        (instance,) = self.simulation.instances()
        with open(os.path.join(self.simulation.instances_folder(), instance, "controllers", "avoid_walls", "avoid_walls.py")) as file:
            return file.read()

    def test_from_the_first_arrow_to_the_last(self):
        website, simulation = self.website, self.simulation
        cookies, _ = website.sign_in(ADA)  # what this user has saved on another day
        with open(os.path.join(EXAMPLES, FILE)) as file:
            original = file.read()
        saved = original.replace("CRUISE = 8.0", "CRUISE = 12.0")
        self.assertEqual(website.save(cookies, os.path.dirname(FILE), os.path.basename(FILE), saved), "OK")

        # SE->>SS1, SE->>SS2: Check server availability, Return machine load
        address = f"ws://localhost:{simulation.port}"
        wait_until(lambda: self.session.get("/session") == address, lambda: f"no machine is offered\n{self.session.log()}")
        self.assertTrue(self.overloaded.polls)

        with open_browser(1280, 900) as browser:
            # C->>W: Load web page; W-->>C: Return web page content
            page = Page(browser, website)
            page.await_text("project", "Robots in an arena")
            # W->>SE: Check server availability (the page asks); SE-->>W: 0 or 1, and to pages that ask for it the word
            page.await_text("availability", "A machine is free.")
            self.assertEqual(page.wire("heard")[0], ["heard", f"ws://localhost:{self.session.port}/?state", "free"])
            self.assertEqual(self.session.get("/"), "1")

            # Who has not signed in can't: the user does.
            self.sign_in(browser)
            page.await_text("user", "Signed in as Ada")
            token = browser.execute_script("return webots.User1Authentication")

            # U->>C: Start simulation; C->>SE: Open simulation session; SE-->>C: Return simulation server web socket URL
            page.press("start")
            page.await_wire("heard", "webots:")
            clients = [each[1] for each in page.wire("open") if each[1].endswith("/client")]
            self.assertEqual(clients, [f"{address}/client"], "the one that is not overloaded")
            # C->>SS1: Start simulation
            init = page.wire("sent", '{ "init"')[0]
            self.assertEqual(init[1], f"{address}/client")
            self.assertEqual(json.loads(init[2])["init"], [website.origin, "robots", "arena.wbt", "42", "Ada", token, "", "", ""])
            # SS1->>W: Download simulation project; W-->>SS1: Return simulation project archive
            self.assertRegex(website.log(), r"/ajax/download-project\.php \(\S+\): \d+ bytes")
            self.assertEqual(self.instance_file(), saved)
            # SS1->>SW1: Start Webots
            self.assertRegex(simulation.log(), r'started: ".*controllerEdit.*/worlds/arena\.wbt"')
            self.assertTrue(simulation.simulators())
            # SS1-->>C: Return Webots web socket URL
            simulator = page.wire("heard", "webots:")[0][2].removeprefix("webots:")
            self.assertEqual(simulator, f"ws://localhost:{simulation.port + 1}")
            # C->>SW1: Register client
            hello = wait_until(lambda: [each for each in page.wire("sent") if each[1].rstrip("/") == simulator], "the client does not register")[0]
            self.assertRegex(hello[2], "^([xw]3d(;broadcast)?|mjpeg: [0-9]+x[0-9]+)$")
            # SW1->>C: Send simulation worlds status
            page.await_wire("heard", "scene load completed")
            page.await_wire("heard", "world:")

            # U->>C: Run simulation; C->>SW1: Change simulation running mode
            wait_until(lambda: browser.execute_script("return webots.currentView.state") == "running", "it does not run by itself")
            self.assertEqual(page.await_wire("sent", "real-time:")[0][2], "real-time:600000")
            # loop: SW1->>C: Send simulation world status
            page.await_time(lambda time: time > 500)
            moving = page.middle()
            wait_until(lambda: page.middle() != moving, "the robots stand still")

            # U->>C: Edit and save controller
            page.await_text("editor", "CRUISE = 12.0")
            self.assertFalse(page.element("save").is_enabled(), "there is nothing to save")
            page.edit("12.0", "0.0")
            page.press("save")
            page.await_text("status", "avoid_walls.py is saved.")
            # C->>W: Send new file; W-->>C: Return OK
            changed = saved.replace("12.0", "0.0")
            with open(website.path(ADA, FILE)) as file:
                self.assertEqual(file.read(), changed)
            self.assertRegex(website.log(), r"/ajax/upload-file\.php \(\S+\): OK")
            # C->>SW1: Send new file
            sent = page.wire("sent", "set controller:")
            self.assertEqual([each[1].rstrip("/") for each in sent], [simulator])
            self.assertEqual(sent[0][2].partition("\n")[2], changed)
            wait_until(lambda: self.instance_file() == changed, "the simulator has not stored it")

            # U->>C: Reset simulation; C->>SW1: Reset simulation
            before = page.time()
            page.press("reset")
            page.await_wire("sent", "reset")
            # loop: SW1->>C: Send simulation worlds status
            page.await_wire("heard", "reset finished")
            page.await_time(lambda time: time < before)
            if browser.execute_script("return webots.currentView.state") == "paused":
                browser.execute_script("webots.currentView.play()")
            page.await_time(lambda time: time > 1000)

            def stands():  # The last pictures from before may still be on their way.
                before, now = page.middle(), page.time()
                page.await_time(lambda time: time > now + 1000)
                return page.middle() == before

            wait_until(stands, "with CRUISE = 0.0 no robot moves")
            if folder := os.environ.get("SCREENSHOTS"):
                screenshot(browser, os.path.join(folder, "website_host.png"))
            self.assertFalse(accessibility_findings(browser))
            hosts = browser.execute_script("return performance.getEntriesByType('resource').map(({name}) => new URL(name).hostname)")
            self.assertLessEqual(set(hosts) | {urllib.parse.urlsplit(each[1]).hostname for each in page.wire()}, {"localhost", "127.0.0.1", ""})

            # C-->>SS1: {Client disconnected}
            browser.get("about:blank")
        # SS1->>SW1: Kill Webots
        simulation.wait_until_clean()

    def sign_in(self, browser):
        for name, value in (("email", ADA["email"]), ("password", ADA["password"])):
            browser.find_element("name", name).send_keys(value)
        browser.find_element("css selector", "#sign-in button").click()

    def test_who_signs_out_is_a_visitor_again(self):
        with open_browser(1280, 720) as browser:
            page = Page(browser, self.website)
            page.await_text("availability", "A machine is free.")
            self.sign_in(browser)
            page.await_text("user", "Signed in as Ada")
            self.assertFalse(page.element("sign-in").is_displayed())
            browser.find_element("css selector", "#sign-out button").click()
            page.await_text("status", "You are signed out.")
            self.assertTrue(page.element("sign-in").is_displayed())
            self.assertFalse(browser.execute_script("return webots.User1Authentication"))
            browser.refresh()
            page.await_text("availability", "A machine is free.")
            self.assertTrue(page.element("sign-in").is_displayed())

    def test_the_button_leaves_the_line_while_one_waits(self):
        port = free_port()
        with WebsiteHost(f"ws://localhost:{port}") as website:
            session = self.enterContext(SessionServer([self.overloaded.address], port=port, relay=True, waitingRoom=5))
            with open_browser(1280, 720) as browser:
                page = Page(browser, website)
                page.press("start")
                wait_until(lambda: browser.execute_script("return webots.currentView.state") == "waiting", session.log)
                self.assertEqual(page.element("start").text, "Leave the line")
                self.assertFalse(accessibility_findings(browser))
                page.press("start")
                wait_until(lambda: browser.execute_script("return webots.currentView.state") == "idle", session.log)
                self.assertEqual(page.element("start").text, "Start")
                self.assertEqual(len(page.wire("sent", '{"init"')), 1, "it has asked for another place")

    def test_every_screen_shows_the_robots_and_the_button_without_scrolling(self):
        for width, height in ((1440, 900), (1280, 720), (390, 844), (844, 390)):
            with open_browser(width, height) as browser:
                if browser.execute_script("return innerWidth") != width:
                    continue  # Windows of Firefox are at least 450 pixels wide.
                page = Page(browser, self.website)
                page.await_text("availability", "A machine is free.")
                boxes = browser.execute_script("return ['start', 'view', 'poster'].map((id) => document.getElementById(id).getBoundingClientRect().toJSON())")
                start, view, poster = boxes
                if height > 480:  # There the forms need the screen, and one scrolls to the simulation.
                    self.assertLessEqual(start["bottom"], height)
                self.assertGreaterEqual(view["height"], height * 0.6)
                self.assertLess(abs(poster["height"] - view["height"]), 3)
                self.assertEqual(*browser.execute_script("const {scrollWidth, clientWidth} = document.documentElement; return [scrollWidth, clientWidth]"))
                self.assertFalse(accessibility_findings(browser))

    def test_the_editor_is_that_of_the_session_server(self):
        with open_browser(1280, 900) as browser:
            page = Page(browser, self.website)
            page.await_text("availability", "A machine is free.")
            has_code_mirror = os.path.isdir(CODE_MIRROR)
            self.assertEqual(len(browser.find_elements("css selector", "#editor .code-mirror")), has_code_mirror, console_messages(browser))
            self.assertEqual(len(browser.find_elements("css selector", "#editor textarea")), not has_code_mirror)
            self.assertEqual(page.element("plain").is_displayed(), not has_code_mirror)
            self.assertFalse(accessibility_findings(browser))
            self.assertEqual(console_messages(browser, "SEVERE"), [])

    def test_a_wrong_password_and_a_session_server_that_is_gone_are_said(self):
        with open_browser(400, 800) as browser:
            page = Page(browser, self.website)
            page.await_text("availability", "A machine is free.")
            browser.find_element("name", "email").send_keys(ADA["email"])
            browser.find_element("name", "password").send_keys("x\ue007")  # Enter
            page.await_text("status", "This e-mail address and this password do not belong together.")
            width = browser.execute_script("return document.documentElement.clientWidth") if BROWSER == "firefox" else 400  # whose windows are wider
            self.assertEqual(browser.execute_script("return document.documentElement.scrollWidth"), width)
            with WebsiteHost(f"ws://localhost:{free_port()}") as website:
                page = Page(browser, website)
                page.await_text("status", "can not be reached. Please try again later.")
                self.assertFalse(page.element("start").is_enabled())


if __name__ == "__main__":
    main()
