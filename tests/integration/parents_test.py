#!/usr/bin/python3
"""Servers whose parent, a shell for instance, has left them something odd."""

import contextlib
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser, server  # noqa: E402
from support.servers import main  # noqa: E402


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


if __name__ == "__main__":
    main()
