#!/usr/bin/python3
"""A configuration of 2018 to 2021, which has no key `ssl`, and machines that speak plain http.

The twin: the Python servers since 2021 take `ssl` for true, ask such machines by https and say only that they do not respond (protocol
sections 3 and 8.1). Ours ask the same, and say what is wrong and which key to set.
"""

import os
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.servers import SessionServer, SimulationServer, main, program, wait_until  # noqa: E402


class OldConfiguration(unittest.TestCase):
    def test_the_log_says_that_machines_are_asked_by_https_and_which_key_to_set(self):
        with SimulationServer() as simulation:
            session = SessionServer([simulation.address])
            del session.config["ssl"]
            with session:
                self.assertIn(f'key "ssl" is missing and counts as true: simulation servers are asked by https (https://'
                              f'{simulation.address}/load)', session.log())
                wait_until(lambda: f"{simulation.address} simulation server is not responding (assuming 100% load): it was asked by https, "
                           "and speaks no TLS" in session.log(), session.log)
                self.assertEqual(session.get("/"), "0")  # as with the Python server
                checked = subprocess.run([program("webots-session-server"), "--check-config", os.path.join(session.folder, "config.json")],
                                         capture_output=True, text=True, timeout=30, cwd=session.folder)
                self.assertEqual(checked.returncode, 0)
                self.assertIn('key "ssl" is missing', checked.stdout + checked.stderr)
                session.reread(ssl=False)
                wait_until(lambda: session.get("/") == "1", session.log)


if __name__ == "__main__":
    main()
