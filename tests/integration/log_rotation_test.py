#!/usr/bin/python3
"""A log that logrotate rotates, with `create` and SIGHUP. Protocol section 9.1."""

import os
import signal
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402


def text(path):
    with open(path) as file:
        return file.read()


class LogRotation(unittest.TestCase):
    def test_after_sighup_lines_go_into_the_file_that_logrotate_has_made(self):
        for kind, server in (("simulation", SimulationServer(debug=False)), ("session", SessionServer([], debug=False))):
            with self.subTest(kind), server:
                log = os.path.join(server.folder, "log", kind, "output.log")
                old = f"{log}-20261128"
                os.rename(log, old)
                os.close(os.open(log, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o640))
                before = text(old)
                server.process.send_signal(signal.SIGHUP)
                wait_until(lambda: text(log), "no line comes")
                self.assertEqual(text(old), before)
                self.assertEqual(os.stat(log).st_mode & 0o777, 0o640)


if __name__ == "__main__":
    main()
