#!/usr/bin/python3
"""While all epoll watches of their user are taken, programs say so and end: what they wait for first would never come, nor would SIGTERM."""

import json
import os
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import no_watches  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, program  # noqa: E402

WRAPPER = (sys.executable, no_watches.__file__)
TAKEN = "have taken all epoll watches that the kernel gives a user"
REMEDY = "raise fs.epoll.max_user_watches"
FAULT, TRY_AGAIN = 2, 3


class WithoutWatches(unittest.TestCase):
    def assert_said(self, said):
        self.assertIn(TAKEN, said)
        self.assertIn(REMEDY, said)

    def test_a_server_says_what_is_missing_and_ends(self):
        for server in (SessionServer([]), SimulationServer()):
            with self.subTest(server.PROGRAM):
                self.addCleanup(server.close)
                server.wrapper = WRAPPER
                with self.assertRaises(AssertionError) as failure:
                    server.start()
                self.assertIn("ended at once", str(failure.exception))
                self.assert_said(str(failure.exception))
                self.assertEqual(server.process.returncode, TRY_AGAIN)

    def test_the_doctor_says_so_and_looks_at_nothing_else(self):
        for server in (SessionServer([]), SimulationServer()):
            with self.subTest(server.PROGRAM):
                self.addCleanup(server.close)
                server.configure()
                status, said = server.command("--doctor", wrapper=WRAPPER)
                self.assertEqual(status, FAULT, said)
                self.assert_said(said)
                findings = json.loads(server.command("--doctor", "--json", wrapper=WRAPPER)[1])["findings"]
                self.assertEqual([finding["subject"] for finding in findings if finding["verdict"] == "fault"], ["epoll watches"])

    def test_a_configuration_is_checked_as_far_as_that_goes(self):
        for server in (SessionServer([]), SimulationServer()):
            with self.subTest(server.PROGRAM):
                self.addCleanup(server.close)
                server.configure()
                status, said = server.command("--check-config", wrapper=WRAPPER)
                self.assertEqual(status, 0, said)
                self.assert_said(said)

    def test_an_operators_command_says_so(self):
        for server, *command in ((SessionServer([]), "--drain", "localhost:2000"), (SimulationServer(), "--drain")):
            with self.subTest(server.PROGRAM):
                self.enterContext(server)
                status, said = server.command(*command, wrapper=WRAPPER)
                self.assertEqual(status, TRY_AGAIN, said)
                self.assert_said(said)
                self.assertNotIn("Does a server", said)

    def test_a_site_is_not_stopped_to_be_started_in_vain(self):
        server = SimulationServer()
        self.addCleanup(server.close)
        finished = subprocess.run([*WRAPPER, program("webots-site"), "restart"], capture_output=True, text=True, timeout=PATIENCE, cwd=server.folder)
        self.assert_said(finished.stderr)
        self.assertEqual(finished.stdout, "")


if __name__ == "__main__":
    main()
