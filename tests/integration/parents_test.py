#!/usr/bin/python3
"""Servers whose parent, a shell for instance, has left them something odd."""

import contextlib
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser, server  # noqa: E402
from support.servers import SessionServer, SimulationServer, main  # noqa: E402

TRY_AGAIN = 3


def shell(line):
    return ("bash", "-c", f'{line}; exec "$@"', "bash")


class Signals(unittest.IsolatedAsyncioTestCase):
    async def test_a_server_whose_parent_ignores_signals_sees_programs_end(self):
        simulation = server()
        with contextlib.closing(simulation):
            simulation.wrapper = shell('trap "" HUP CHLD PIPE USR1')
            simulation.start()
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
            simulation.wait_until_clean()
            self.assertNotIn("took too long", simulation.log())  # the guard, which tells what walls there can be


class Limits(unittest.TestCase):
    def test_a_server_that_may_have_too_little_says_what_and_ends(self):
        for limit, sentence in (("-n 20", "A server needs 64 open files at least, and may have 20. Use ulimit -n 65536 before the start"),
                                ("-f 1000", "The logs of a server can't be written, because each file may have 1000 kB at most. Use ulimit -f unlimited")):
            for server in (SessionServer([]), SimulationServer()):
                with self.subTest(limit, program=server.PROGRAM):
                    self.addCleanup(server.close)
                    server.wrapper = shell(f"ulimit {limit}")
                    with self.assertRaises(AssertionError) as failure:
                        server.start()
                    self.assertIn(sentence, str(failure.exception))
                    self.assertEqual(server.process.returncode, TRY_AGAIN)


if __name__ == "__main__":
    main()
