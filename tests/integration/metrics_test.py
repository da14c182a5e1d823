#!/usr/bin/python3
"""GET /metrics of both servers, as the tools of Prometheus see it. Protocol section 13.7."""

import os
import re
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


DOCUMENT = os.path.join(os.path.dirname(__file__), "../../docs/metrics.md")
SERVERS = {"Both servers": {"session", "simulation"}, "The session server": {"session"}, "The simulation server": {"simulation"}}


def documented(server):
    """The metrics that a server has, by name, with their types, as docs/metrics.md lists them."""
    with open(DOCUMENT) as file:
        sections = dict(section.split("\n", 1) for section in file.read().split("\n## ")[1:])
    return {name: kind for title, text in sections.items() if server in SERVERS[title]
            for name, kind in re.findall(r"^\| `(\w+)` \| (\w+) \|", text, re.M)}


def announced(page):
    return dict(re.findall(r"^# TYPE (\w+) (\w+)$", page, re.M))


class Names(unittest.TestCase):
    def test_promtool_finds_nothing_wrong_with_the_metrics_of_both_servers(self):
        self.assertIn('should not have "_sum" suffix', lint("# HELP x_sum X.\n# TYPE x_sum counter\nx_sum 1\n"))
        with SimulationServer(gateway=True) as simulation, SessionServer([simulation.address], relay=True) as session:
            for server in (simulation, session):
                self.assertEqual(lint(server.get("/metrics")), "", server.PROGRAM)

    def test_servers_have_the_metrics_that_are_documented_and_no_others(self):
        with SimulationServer(gateway=True) as simulation, SessionServer([simulation.address], relay=True) as session:
            self.assertEqual(announced(session.get("/metrics")), documented("session"))
            self.assertEqual(announced(simulation.get("/metrics")), documented("simulation"))


if __name__ == "__main__":
    main()
