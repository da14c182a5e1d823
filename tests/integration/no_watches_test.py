#!/usr/bin/python3
"""A server that is started while all epoll watches of its user are taken says so, and ends: what it waits for first would never come, nor would SIGTERM."""

import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import no_watches  # noqa: E402
from support.servers import SessionServer, SimulationServer, main  # noqa: E402


class WithoutWatches(unittest.TestCase):
    def test_a_server_says_what_is_missing_and_ends(self):
        for server in (SessionServer([]), SimulationServer()):
            with self.subTest(server.PROGRAM):
                self.addCleanup(server.close)
                server.wrapper = (sys.executable, no_watches.__file__)
                with self.assertRaises(AssertionError) as failure:
                    server.start()
                said = str(failure.exception)
                self.assertIn("ended at once", said)
                self.assertIn("have taken all epoll watches that the kernel gives a user", said)
                self.assertIn("raise fs.epoll.max_user_watches", said)
                self.assertEqual(server.process.returncode, 3)


if __name__ == "__main__":
    main()
