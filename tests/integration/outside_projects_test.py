#!/usr/bin/python3
"""Projects outside of "allowedRepositories": whether they run, and what browser and operator are told, depends on what confines simulations.

Protocol section 4.1.2, step 3.
"""

import asyncio
import os
import shutil
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import WORLD, Browser  # noqa: E402
from support.other_user import OwnedServer  # noqa: E402
from support.refusals import error_line, error_pattern  # noqa: E402
from support.servers import main  # noqa: E402

REFUSED = error_line("outside_allowed")


class Outside(unittest.TestCase):
    def started(self, **keys):
        server = OwnedServer(**{"network": "none", "allowedRepositories": ["local:/nobody"], "shareIdleTime": 100, **keys})
        self.addCleanup(server.close)
        if keys["sandbox"] in ("auto", "bubblewrap") and not shutil.which("bwrap"):
            self.skipTest("bubblewrap is not installed")
        server.start()
        return server

    @staticmethod
    def answer(server, wanted="loading: Error:"):
        """What a browser gets for the world of a stranger."""
        async def start():
            async with Browser(server) as browser:
                await browser.start(WORLD)
                return await browser.hear(wanted)
        return asyncio.run(start())

    def test_without_a_sandbox_the_answer_is_the_one_that_browsers_know(self):
        server = self.started(sandbox="none")
        self.assertEqual(self.answer(server), REFUSED)
        self.assertIn("are refused: simulations run without a sandbox.", server.log())

    def test_a_sandbox_with_limits_and_displays_of_its_own_lets_strangers_in_if_it_is_named(self):
        if not shutil.which("Xvfb"):
            self.skipTest("Xvfb is not installed")
        server = self.started(sandbox="bubblewrap", display="private")
        if "limits for each simulation that hold" in server.log():
            self.skipTest("limits of simulations do not hold on this machine")
        self.assertIn("may run here when the machine is idle, in the sandbox bubblewrap.", server.log())
        self.assertTrue(self.answer(server, "webots:").startswith("webots:"))
        server.wait_until_clean()

    def test_a_list_stays_closed_where_the_server_has_chosen_the_sandbox(self):
        server = self.started(sandbox="auto", display="private")
        self.assertTrue(self.answer(server).startswith(REFUSED))

    def test_a_sandbox_that_lacks_something_says_what(self):
        server = self.started(sandbox="bubblewrap", display=":97")
        self.assertRegex(self.answer(server), error_pattern("outside_sandbox"))
        self.assertRegex(server.log(), "To accept them in the sandbox bubblewrap when the machine is idle, this server needs .*\\.")


if __name__ == "__main__":
    main()
