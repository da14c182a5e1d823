#!/usr/bin/python3
"""Pages that are being loaded while the network of their machine changes, as when a phone finds another access point: Chromium drops what it
has not begun to receive. A real browser, fake servers, and a network interface that comes and goes. Exit code 77: there can be no network of
our own, or there is no browser.
"""

import os
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import own_network  # noqa: E402

if __name__ == "__main__":
    own_network.enter()

try:
    from fake_cloud import FakeCloud
except ImportError as missing:
    print(f"skipped: {missing} (package python3-websockets)")
    sys.exit(77)
from support.browser import console_messages, open_browser  # noqa: E402
from support.waiting import wait_until  # noqa: E402

MODULES = "/view/"  # There are more of them than a browser asks a server for at once.
DROPPED = "net::ERR_NETWORK_CHANGED"


def ip(*arguments):
    subprocess.run(["ip", *arguments], check=True)


class NetworkChange(unittest.TestCase):
    def setUp(self):
        self.cloud = self.enterContext(FakeCloud())
        self.browser = self.enterContext(open_browser(360, 740, loads="none", whole=True))

    def check(self, page, is_complete):
        self.cloud.held = MODULES
        self.browser.execute_cdp_cmd("Page.navigate", {"url": page})  # which does not load it again, as `get` does
        wait_until(lambda: any(MODULES in path for path in self.cloud.requests), "no module is asked for")
        said = []

        def is_dropped():
            said.extend(entry["message"] for entry in console_messages(self.browser))
            return any(DROPPED in message for message in said)

        self.change_network()
        wait_until(is_dropped, lambda: f"the browser dropped nothing: {said}")
        self.cloud.held = None
        wait_until(lambda: self.browser.execute_script(f"return {is_complete}"), lambda: self.browser.page_source, 60)
        self.assertFalse(self.browser.find_element("id", "incomplete").is_displayed())

    def change_network(self):
        ip("link", "add", "wlan0", "type", "veth", "peer", "name", "point")
        self.addCleanup(ip, "link", "delete", "wlan0")
        ip("address", "add", "10.80.0.1/24", "dev", "wlan0")
        ip("link", "set", "point", "up")
        ip("link", "set", "wlan0", "up")

    def test_the_viewer_is_complete_although_modules_of_it_were_dropped(self):
        self.check(self.cloud.page, "document.body?.dataset.availability === 'available'")

    def test_the_page_of_a_class_is_complete_although_modules_of_it_were_dropped(self):
        self.check(self.cloud.page.replace("/viewer/", "/class/K7M2QX"), "document.body?.dataset.shown === 'name'")


if __name__ == "__main__":
    unittest.main(verbosity=2)
