#!/usr/bin/python3
"""GET /metrics of both servers, as the tools of Prometheus see it. Protocol section 13.7."""

import os
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.processes import required_program  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main  # noqa: E402


def lint(page):
    """What promtool has against these metrics; empty: nothing."""
    promtool = required_program("promtool", "prometheus")
    finished = subprocess.run([promtool, "check", "metrics"], input=page, capture_output=True, text=True, timeout=PATIENCE)
    return finished.stdout + finished.stderr + ("" if finished.returncode == 0 else f"exit status {finished.returncode}")


class Names(unittest.TestCase):
    def test_promtool_finds_nothing_wrong_with_the_metrics_of_both_servers(self):
        self.assertIn('should not have "_sum" suffix', lint("# HELP x_sum X.\n# TYPE x_sum counter\nx_sum 1\n"))
        with SimulationServer(gateway=True) as simulation, SessionServer([simulation.address], relay=True) as session:
            for server in (simulation, session):
                self.assertEqual(lint(server.get("/metrics")), "", server.PROGRAM)


if __name__ == "__main__":
    main()
